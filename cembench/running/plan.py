"""Plan a run: the cells to measure, and their surfaces."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from cembench.conformal.laplacian import non_delaunay_share
from cembench.core.errors import MeshError, ParameterError
from cembench.core.names import did_you_mean
from cembench.linear_algebra.backends import default_backend
from cembench.mesh.datasets import Dataset
from cembench.mesh.files import READERS, is_named_like_a_mesh
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm, Registry
from cembench.results.comparison import circumstances
from cembench.results.papers import NO_PAPER, Paper
from cembench.results.records import DEFAULT_ROUNDS, Cell, MeshFacts, MeshOrigin
from cembench.running.sources import hash_of, map_sources, sources_of

#: The settings of a cell that is not timed.
_UNTIMED: Mapping[str, Any] = MappingProxyType({"repeats": 1, "precision": None})


@dataclass(frozen=True)
class Task:
    """A cell with everything needed to measure it."""

    cell: Cell
    algorithm: Algorithm
    mesh: TriangleMesh
    facts: MeshFacts
    plugins: tuple[str, ...] = ()
    #: SHA-256 of the files behind the cell's `code_hash`, by relative path.
    sources: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Provenance:
    """Where a surface is from: its paper's model, its source, and its family.

    Parameters
    ----------
    paper_row : str
        The model of a paper that it is or stands in for, if any.
    origin : {"model", "stand-in", "surface"}
        Which of the two it is; "surface" for neither.
    source : str
        Who published it, e.g. a repository; "" if unknown.
    family : str
        The object that it shows. Surfaces of one family, such as scans of one statue, are not
        independent samples; "" if unknown, which makes the surface a family of its own.
    fitted : str
        The algorithm whose printed figures the surface was fitted to, if any.
    """

    paper_row: str = ""
    origin: MeshOrigin = "surface"
    source: str = ""
    family: str = ""
    fitted: str = ""


@dataclass(frozen=True)
class MeasurementSettings:
    """Settings that all cells of a plan share."""

    solves: str = "reuse"
    backend: str = field(default_factory=default_backend)
    threads: int = 1
    #: Fixed number of rounds; 0 with a precision.
    repeats: int = DEFAULT_ROUNDS
    #: Largest half-width of the intervals, relative to the figure.
    precision: float | None = None

    @classmethod
    def until_precise(cls, precision: float, **more: Any) -> MeasurementSettings:
        """Return settings for measuring until a precision is reached."""
        return cls(repeats=0, precision=precision, **more)


def plan_cells(
    algorithms: Sequence[Algorithm],
    meshes: Sequence[TriangleMesh],
    parameters: Mapping[str, Any],
    how: MeasurementSettings,
    plugins: Sequence[str] = (),
    standing: Mapping[str, Provenance] = MappingProxyType({}),
    paper: Paper = NO_PAPER,
) -> list[Task]:
    """Return a task for every algorithm on every surface that it takes, grouped by surface.

    A surface that occurs twice under the same name, as from two files of a folder, counts once.

    In `parameters`, the key ``name`` sets a parameter of every algorithm that has it, and
    ``algorithm.name`` of that one only. `standing` is keyed by the surfaces' names; surfaces not in
    it are not the paper's. On the own models of the `paper` that the run is for, algorithms have
    the parameters with which it ran them (:meth:`~cembench.results.papers.Paper.as_printed`),
    unless `parameters` sets others.

    Raises
    ------
    ParameterError
        No algorithm has such a parameter, or one refuses its value.
    MeshError
        Two different surfaces have the same name, or no algorithm takes a surface.
    """
    meshes = list({(mesh.name, mesh.hash): mesh for mesh in meshes}.values())
    names = [mesh.name for mesh in meshes]
    for name in names:
        if names.count(name) > 1:
            raise MeshError(f"two different surfaces are called {name!r}; rename one of the files.")
    distribute_parameters(algorithms, parameters)  # refuses what no algorithm has
    sources = {a.name: sources_of(a) for a in algorithms if a.maps is None}
    tasks = []
    for mesh in meshes:
        takers = [a for a in algorithms if isinstance(mesh, a.mesh_type)]
        if not takers:
            chosen = ", ".join(f"{a.name} ({a.mesh_type.__name__})" for a in algorithms)
            raise MeshError(
                f"{mesh.name} is a {type(mesh).__name__}, which none of the chosen algorithms "
                f"accepts: {chosen}."
            )
        role = standing.get(mesh.name, Provenance())
        facts = mesh_facts(mesh, role)
        is_model = role.origin == "model" and role.paper_row in paper.models
        own = paper.as_printed(role.paper_row, algorithms) if is_model else {}
        arguments = distribute_parameters(algorithms, own | dict(parameters))
        for taker in takers:
            files, settings = sources.get(taker.name, {}), how
            if taker.maps is not None:  # their key does not depend on how others are timed
                files, settings = map_sources(taker, mesh.hash), replace(how, **_UNTIMED)
            cell = cell_of(taker, mesh, arguments[taker.name], settings, files)
            tasks.append(Task(cell, taker, mesh, facts, tuple(plugins), files))
    return tasks


def comparable_groups(tasks: Sequence[Task]) -> list[list[Task]]:
    """Return the tasks whose seconds are compared: same surface, policy, back end and threads."""
    groups: dict[tuple[str, str], list[Task]] = {}
    for task in tasks:
        groups.setdefault((circumstances(task.cell), task.cell.mesh), []).append(task)
    return list(groups.values())


def cell_of(
    algorithm: Algorithm,
    mesh: TriangleMesh,
    arguments: Mapping[str, Any],
    how: MeasurementSettings,
    sources: Mapping[str, str],
) -> Cell:
    """Return the cell of an algorithm, with its checked keyword arguments, on a surface."""
    return Cell(
        algorithm=algorithm.name,
        parameters=dict(arguments),
        code_hash=hash_of(sources),
        mesh=mesh.name,
        mesh_hash=mesh.hash,
        solves=how.solves,
        backend=how.backend,
        threads=how.threads,
        repeats=how.repeats,
        precision=how.precision,
    )


def distribute_parameters(
    algorithms: Sequence[Algorithm], parameters: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    """Return the keyword arguments of each algorithm by its name; see :func:`plan_cells`."""
    chosen: dict[str, dict[str, Any]] = {a.name: {} for a in algorithms}
    for key, value in parameters.items():
        only, _, name = key.rpartition(".")
        takers = [
            a
            for a in algorithms
            if (not only or a.name == only) and name in {p.name for p in a.parameters}
        ]
        if not takers:
            known = "; ".join(
                f"{a.name}: {', '.join(p.name for p in a.parameters) or 'none'}" for a in algorithms
            )
            names = [p.name for a in algorithms for p in a.parameters]
            raise ParameterError(
                f"no chosen algorithm has a parameter {key!r}; known: {known}."
                + did_you_mean(name, names)
            )
        for a in takers:
            chosen[a.name][name] = value
    return {a.name: a.arguments(chosen[a.name]) for a in algorithms}


def mesh_facts(mesh: TriangleMesh, standing: Provenance = Provenance()) -> MeshFacts:
    """Return the facts of a surface for tables."""
    return MeshFacts(
        vertices=mesh.n,
        faces=mesh.m,
        boundary_vertices=sum(len(loop) for loop in mesh.loops),
        non_delaunay_share=non_delaunay_share(mesh),
        notices=mesh.notices,
        **vars(standing),
    )


#: Files of this format in a folder are meshes only if named: most hold other arrays.
_OF_ANYTHING = (".npz",)


def mesh_files(folder: Path) -> list[Path]:
    """Return the entries of a folder with the suffix of a mesh format, sorted by name.

    Entries that are not files (a pipe, a folder, a broken link) are included, so that reading them
    raises an error.

    Raises
    ------
    MeshError
        The path is not a folder, cannot be listed, or has no mesh files.
    """
    try:
        named = (path for path in folder.iterdir() if is_named_like_a_mesh(path))
        files = sorted(path for path in named if path.suffix.lower() not in _OF_ANYTHING)
    except (FileNotFoundError, NotADirectoryError):
        why = "is not a folder"
    except OSError as error:
        why = f"cannot be listed ({error.strerror or error})"
    else:
        why = f"holds no file of a mesh ({', '.join(k for k in READERS if k not in _OF_ANYTHING)})"
        if files:
            return files
    raise MeshError(f"mesh_dir={str(folder)!r} {why}; name another, or single files.")


def provenances(registry: Registry, names: Iterable[str]) -> dict[str, Provenance]:
    """Return where these generated surfaces are from: each name is a family of its own."""
    known = map(registry.surface, names)
    return {
        one.name: Provenance(
            one.paper_row,
            "stand-in" if one.paper_row else "surface",
            family=one.name,
            fitted=one.fitted,
        )
        for one in known
    }


def provenance_of(registry: Registry, mesh: TriangleMesh) -> Provenance:
    """Return where a surface that was not generated is from; it is recognised by its mesh."""
    known = (d for d in registry.datasets.values() if d.mesh_hash == mesh.hash)
    return next(map(provenance_of_dataset, known), Provenance())


def provenance_of_dataset(dataset: Dataset) -> Provenance:
    """Return where a dataset's surface is from."""
    row = dataset.paper_row
    return Provenance(row, "model" if row else "surface", dataset.source, dataset.family)
