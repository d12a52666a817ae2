"""Sets of surfaces for large runs: named sets, a folder, or an archive.

Surfaces that are not available (a file that cannot be fetched, a surface that is not a disk) are
listed too, with the reason, because success rates need the right denominator.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path
from types import MappingProxyType
from typing import Any

from cembench.api.surface_collections import (
    Names,
    Provided,
    provided,
    surfaces_of_archive,
    surfaces_of_folder,
)
from cembench.core.errors import ParameterError
from cembench.mesh.datasets import Dataset, fetch_all, surface_file
from cembench.mesh.download import Progress
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm, Registry
from cembench.results.exhibits import Exhibit, ExhibitTable
from cembench.running.plan import Provenance, provenance_of, provenance_of_dataset

#: Default number of surfaces from a set without an end.
USUAL_LIMIT = 100
#: Name of the exhibit that lists the surfaces of a run's sets.
EXHIBIT = "surface-set"
#: Environment variable for a folder with the set "corpus", which is otherwise fetched.
CORPUS, CORPUS_VARIABLE = "corpus", "CEMBENCH_CORPUS"

ShowProgress = Callable[[Dataset], Progress | None]


def _quietly(dataset: Dataset) -> None:
    """Show no progress of a download."""


#: Sets of datasets, by the groups of these. Entry points of :data:`SETS` name functions of the
#: registry and a limit that yield the surfaces of others.
GROUPS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "real-disks": ("paper", "disks"),
        "real-holes": ("holes",),
        "closed": ("closed",),
        "stress": ("stress",),
        CORPUS: (CORPUS,),
    }
)
SETS = "cembench.sets"


def surfaces_of_set(
    name: str, registry: Registry, *, limit: int | None = None, progress: ShowProgress = _quietly
) -> Iterator[Provided]:
    """Yield the surfaces of a set, ready to be mapped, each with its name and source.

    Parameters
    ----------
    name : str
        A name in :data:`GROUPS` or of an entry point, or the path of a folder or archive with
        mesh files.
    registry : Registry
        The registry of datasets and surface families.
    limit : int, optional
        Maximum number of surfaces; default: all, or :data:`USUAL_LIMIT` of a set without an end.
    progress : function of a dataset
        Returns the progress callback for a download.

    Raises
    ------
    ParameterError
        There is no such set, folder or archive.
    DatasetError
        The face model cannot be fetched.
    MissingExtra
        The face model needs a package that is not installed.

    Examples
    --------
    >>> import cembench
    >>> from cembench.registry import load_registry
    >>> cembench.write_mesh("flat.obj", cembench.surface("flat-disk", 200))
    >>> [one.name for one in surfaces_of_set(".", load_registry())]
    ['flat']
    """
    if name == CORPUS:
        name = os.environ.get(CORPUS_VARIABLE) or name
    if name in GROUPS:
        chosen = [dataset for group in GROUPS[name] for dataset in registry.group(group)]
        return _of_datasets(chosen[:limit], progress)
    for entry in entry_points(group=SETS, name=name):
        surfaces: Iterator[Provided] = entry.load()(registry, limit or USUAL_LIMIT)
        return surfaces
    return _of_path(name, limit)


def _of_path(name: str, limit: int | None) -> Iterator[Provided]:
    place = Path(name)
    if place.is_dir():
        return surfaces_of_folder(place, limit=limit)
    if place.is_file():
        return surfaces_of_archive(place, limit=limit)
    known = [*GROUPS, *sorted(entry.name for entry in entry_points(group=SETS))]
    raise ParameterError(
        f"there is no set {name!r}, and no folder or archive of that name; sets: "
        f"{', '.join(known)}."
    )


def _of_datasets(datasets: Sequence[Dataset], progress: ShowProgress) -> Iterator[Provided]:
    with closing(fetch_all(datasets, progress=progress)) as downloads:
        downloaded = {one.dataset.name: one for one in downloads}
    for dataset in datasets:
        one = downloaded[dataset.name]
        if one.error is not None:
            why = str(one.error)
            yield Provided(dataset.name, dataset.source_url, error=why, licence=dataset.licence)
        else:
            load = partial(_read, dataset)
            surface = provided(dataset.name, dataset.source_url, load, dataset.licence)
            yield replace(surface, provenance=provenance_of_dataset(dataset))


def _read(dataset: Dataset) -> TriangleMesh:
    return read_mesh(surface_file(dataset), TriangleMesh)


@dataclass(frozen=True)
class Gathered:
    """The surfaces of a run's sets.

    Parameters
    ----------
    surfaces : tuple of Provided
        Surfaces that can be measured, with unique names.
    refused : tuple of Provided
        The other surfaces, each with the reason.
    roles : mapping
        Where each of them is from, by its name.
    """

    surfaces: tuple[Provided, ...]
    refused: tuple[Provided, ...]
    roles: Mapping[str, Provenance]

    @property
    def meshes(self) -> list[TriangleMesh]:
        """The meshes that can be measured."""
        return [one.mesh.renamed(one.name) for one in self.surfaces if one.mesh is not None]


def gathered(
    offered: Iterable[Provided], registry: Registry, algorithms: Sequence[Algorithm]
) -> Gathered:
    """Split the surfaces of sets into those that the algorithms can be measured on, and the rest.

    A surface that occurs twice, with the same vertices and triangles, counts once.
    """
    names, seen = Names(), set[str]()
    kinds = tuple({a.mesh_type for a in algorithms})
    surfaces, refused, roles = [], [], {}
    for one in offered:
        if one.mesh is None:
            refused.append(one)
        elif not isinstance(one.mesh, kinds):
            kind = type(one.mesh).__name__
            why = f"it is a {kind}, which none of the chosen algorithms accepts"
            refused.append(replace(one, mesh=None, error=why))
        elif one.mesh.hash not in seen:
            seen.add(one.mesh.hash)
            kept = replace(one, name=names.of(one.name))
            surfaces.append(kept)
            recognised = provenance_of(registry, one.mesh)
            roles[kept.name] = recognised if recognised.family else one.provenance
    return Gathered(tuple(surfaces), tuple(refused), MappingProxyType(roles))


def exhibit_of(collected: Gathered, sets: Sequence[str], command: str) -> Exhibit:
    """Return an exhibit that lists the surfaces of a run's sets."""
    count = len(collected.surfaces) + len(collected.refused)
    cut = sum(one.cut for one in collected.surfaces)
    text = (
        f"{', '.join(sets)}: {count} surfaces were given, {len(collected.surfaces)} of them can be "
        f"mapped{f', {cut} after they were cut open' if cut else ''}. Success rates refer to "
        "those that can be mapped."
    )
    columns = ("surface", "family", "vertices", "triangles", "boundaries", "from", "licence")
    roles = collected.roles
    rows = tuple(
        (
            *(one.name, roles[one.name].family or one.name, one.mesh.n, one.mesh.m),
            *(len(one.mesh.loops), one.source, one.licence),
        )
        for one in collected.surfaces
        if one.mesh is not None
    )
    tables = [ExhibitTable(title="Surfaces of this run", columns=columns, rows=rows)]
    if collected.refused:
        refused = tuple((one.name, one.error, one.source) for one in collected.refused)
        why = ("surface", "reason", "from")
        tables.append(ExhibitTable(title="Not measured", columns=why, rows=refused))
    facts: dict[str, Any] = {"sets": list(sets), "given": count}
    facts["measured"] = len(collected.surfaces)
    facts["refused"] = {one.name: one.error for one in collected.refused}
    return Exhibit(
        name=EXHIBIT,
        title="The surfaces",
        text=text,
        command=command,
        origin="surface",
        tables=tuple(tables),
        facts=facts,
    )
