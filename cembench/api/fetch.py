"""Fetch public surfaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cembench.api.settings import AnyPath, Timeout
from cembench.core.arguments import Range, checked
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from cembench.core.errors import CembenchError
    from cembench.mesh.datasets import Dataset
    from cembench.registry import Registry


class PublicSurfaces(dict[str, Path]):
    """The files of public surfaces that are here, by name.

    The name of one that could not be fetched raises the error.

    Parameters
    ----------
    files : mapping of Path
        The files.
    rows : sequence of dict
        Source, licence, counts and path of each surface that was asked for, as ``cembench fetch
        --json`` prints them.
    failed : mapping of CembenchError
        Why the others could not be fetched.

    Examples
    --------
    >>> import cembench
    >>> surfaces = cembench.fetch()
    >>> next(row["licence"] for row in surfaces.rows if row["name"] == "left-hand")
    'Apache-2.0'
    """

    def __init__(
        self,
        files: Mapping[str, Path],
        rows: Sequence[dict[str, Any]],
        failed: Mapping[str, CembenchError],
    ) -> None:
        super().__init__(files)
        self.rows, self.failed = list(rows), dict(failed)

    def __missing__(self, name: str) -> Path:
        if name in self.failed:
            raise self.failed[name]
        raise KeyError(name)


@checked
def fetch(
    names: Sequence[str] | str = (),
    *,
    group: Sequence[str] = (),
    have: Sequence[AnyPath] = (),
    jobs: Annotated[int, Range(1, 16)] = 4,
    timeout: Timeout = 60.0,
    reporter: Reporter = SILENT,
) -> PublicSurfaces:
    """Fetch public surfaces, check them, and return their paths.

    Each file is fetched once and kept in the cache ($CEMBENCH_CACHE); its SHA-256 must match.
    $CEMBENCH_DATA_URL points to a mirror. A failed download does not stop the others; the same call
    resumes. The group ict-face has the files of the face model. What takes names of public surfaces
    fetches those that it needs by itself.

    Parameters
    ----------
    names : sequence of str
        Surfaces to fetch; with none, list them all.
    group : sequence of str
        A whole group: paper, disks, holes, closed or stress.
    have : sequence of paths
        A folder with files already downloaded; matching ones are copied.
    jobs : int
        Parallel downloads.
    timeout : float
        Seconds to wait for a silent server; a slow one must send 4 KiB a second.
    reporter : Reporter
        Receives what is being done.

    Returns
    -------
    PublicSurfaces
        The files by name; if nothing was asked for, those that are here.

    Raises
    ------
    RegistryError
        There is no such surface or group.
    RecordError
        The cache cannot be written to, or its disk is full.

    Examples
    --------
    >>> import cembench
    >>> cembench.fetch("left-hand")["left-hand"]  # doctest: +SKIP
    PosixPath('/home/me/.cache/cembench/left-hand.mat')
    """
    from contextlib import closing

    from cembench.mesh.datasets import fetch_all, is_fetched
    from cembench.registry import load_registry

    registry = load_registry()
    asked = [names] if isinstance(names, str) else names
    wanted = [registry.dataset(name) for name in dict.fromkeys(asked)]
    wanted += [one for name in group for one in registry.group(name) if one not in wanted]
    if not wanted:
        known = list(registry.datasets.values())
        paths = {one.name: one.path for one in known if is_fetched(one)}
        return PublicSurfaces(paths, [about(one) for one in known], {})
    missing = {one.path: one for one in wanted if not is_fetched(one)}
    if len(wanted) > 1:
        reporter.info(_intent(len({one.path for one in wanted}), list(missing.values())))
    limits: dict[str, Any] = {"jobs": jobs, "timeout": timeout, "have": list(map(Path, have))}
    with (
        reporter.downloads(list(missing.values())) as progress,
        closing(fetch_all(wanted, **limits, progress=progress)) as downloads,
    ):
        failed = {one.dataset.name: one.error for one in downloads if one.error is not None}
    if len(wanted) > 1:
        again = f", {len(failed)} failed; the same call tries them again" * bool(failed)
        reporter.info(f"{len(wanted) - len(failed)} of {len(wanted)} fetched{again}.")
    why = {name: {"error": str(error)} for name, error in failed.items()}
    files = {one.name: one.path for one in wanted if one.name not in failed}
    return PublicSurfaces(files, [about(one) | why.get(one.name, {}) for one in wanted], failed)


def _intent(count: int, missing: Sequence[Dataset]) -> str:
    """Return a line with the number of files and the bytes still to fetch."""
    from cembench.report.listings import bytes_text

    total = bytes_text(sum(d.size or 0 for d in missing))
    unknown = sum(d.size is None for d in missing)
    more = f", and {unknown} of unknown size" if unknown else ""
    return f"{count} files, {count - len(missing)} already here; to fetch: {total}{more}."


def about(dataset: Dataset) -> dict[str, Any]:
    """Return what is known of a public surface as plain data."""
    from cembench.mesh.datasets import is_fetched

    texts = ("name", "title", "paper_row", "group")
    facts = ("faces", "licence", "fetch_only", "note", "url", "sha256")
    size = dataset.path.stat().st_size if dataset.path.is_file() else dataset.size
    return {
        **{name: getattr(dataset, name) or None for name in texts},
        **{name: None if (one := getattr(dataset, name)) == "" else one for name in facts},
        **{"size": size, "fetched": is_fetched(dataset), "path": str(dataset.path)},
    }


def local_files(
    meshes: Sequence[Path], registry: Registry, reporter: Reporter = SILENT
) -> list[Path]:
    """Return the file of each path or name of a public surface, which is fetched if necessary.

    A generated surface keeps its name.

    Raises
    ------
    MeshError
        A name is that of no surface.
    """
    from cembench.mesh import datasets
    from cembench.running.surfaces import file_named, is_generated

    def local(path: Path) -> Path:
        if path.exists() or str(path) not in registry.datasets:
            return path if is_generated(str(path), registry) else file_named(path, registry)
        dataset = registry.dataset(str(path))
        with reporter.downloads([dataset]) as progress:
            datasets.fetch(dataset, progress=progress(dataset))
        return datasets.surface_file(dataset)

    return [local(path) for path in meshes]
