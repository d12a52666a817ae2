"""The surfaces of the paper: public models, and stand-ins."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from time import monotonic

from cembench.api.settings import bytes_of
from cembench.core.errors import CembenchError, RecordError
from cembench.core.extras import MissingExtra
from cembench.core.reporter import Reporter
from cembench.mesh.datasets import Dataset, fetch_all, is_fetched
from cembench.mesh.download import Progress
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Registry, Surface, load_registry
from cembench.running.process_pool import process_pool
from cembench.running.surfaces import generate_surface

#: Seconds for fetching the paper's models, in all.
FETCH_SECONDS = 20.0
#: Bytes that making a stand-in needs; the largest of the profile `quick` takes a third of it.
STAND_IN_BYTES = 2**30
#: The group of datasets that are models of the paper.
GROUP = "paper"


def public_models(registry: Registry, rows: Sequence[str]) -> list[Dataset]:
    """Return the public models among these of the paper."""
    datasets = registry.datasets.values()
    return [one for one in datasets if one.group == GROUP and one.paper_row in rows]


def fetch_models(
    wanted: Sequence[Dataset],
    progress: Callable[[Dataset], Progress | None] = lambda dataset: None,
    seconds: float = FETCH_SECONDS,
) -> str:
    """Fetch models within a time limit; return a line on what happened.

    What is complete at the limit is kept.
    """
    missing = [dataset for dataset in wanted if not is_fetched(dataset)]
    if not missing:
        return f"{len(wanted)} of the paper's models are here, fetched before"
    until = monotonic() + seconds
    why = _fetch(missing, progress, seconds)
    if monotonic() >= until:
        why = f"not complete within {seconds:g} s"
    left = sum(not is_fetched(dataset) for dataset in missing)
    if left == len(wanted):
        return f"the paper's models could not be reached ({why}): stand-ins are measured"
    return (
        f"fetched {len(missing) - left} of the paper's models"
        + f" ({len(wanted) - len(missing)} fetched before)" * (len(missing) < len(wanted))
        + f"; {left} could not be reached ({why}): stand-ins are measured" * bool(left)
    )


def _fetch(
    missing: Sequence[Dataset], progress: Callable[[Dataset], Progress | None], seconds: float
) -> str:
    """Fetch all at once, so that the limit is that of all; return why the first failed, if any."""
    try:
        downloads = list(fetch_all(missing, jobs=len(missing), seconds=seconds, progress=progress))
    except CembenchError as error:
        return _briefly(error)
    return next((_briefly(one.error) for one in downloads if one.error is not None), "")


def _briefly(error: CembenchError) -> str:
    """Return why a dataset could not be fetched, in a few words."""
    if isinstance(error, MissingExtra):
        return "the library requests is not installed"
    if isinstance(error, RecordError):
        return "the cache cannot be written to"
    if error.__cause__ is None:
        return "the server has another file"
    beneath = error.__cause__.__cause__
    return str(error.__cause__) if beneath is None else type(beneath).__name__


def stand_ins(
    registry: Registry, names: Sequence[str], jobs: int, reporter: Reporter
) -> list[TriangleMesh]:
    """Return these surfaces, like :func:`make_stand_ins` in as many processes as memory allows."""
    with reporter.busy("making stand-ins"):
        return make_stand_ins(
            *(registry, names, min(jobs, bytes_of(None) // STAND_IN_BYTES)),
            lambda name, done, total: reporter.info(f"[{done}/{total}] made {name}"),
        )


def make_stand_ins(
    registry: Registry, names: Sequence[str], jobs: int, made: Callable[[str, int, int], None]
) -> list[TriangleMesh]:
    """Return these surfaces; those that are not in the cache are made in `jobs` processes.

    `made` receives the name of each that was made, how many
    were, and how many were not in the cache.
    """
    new = [name for name in names if not is_kept(registry.surface(name))]
    stand_ins: dict[str, TriangleMesh] = {}
    if min(jobs, len(new)) > 1:
        # A process that breaks its memory limit ends them all: one at a time needs less.
        with (
            suppress(BrokenProcessPool, MemoryError),
            process_pool(min(jobs, len(new)), STAND_IN_BYTES) as pool,
        ):
            waiting = {pool.submit(_make, name): name for name in new}
            for future in as_completed(waiting):
                stand_ins[waiting[future]] = future.result()
                made(waiting[future], len(stand_ins), len(new))
    for name in (*new, *names):
        if name not in stand_ins:
            stand_ins[name] = generate_surface(registry, name)
            if name in new:
                made(name, len(stand_ins), len(new))
    return [stand_ins[name] for name in names]


def _make(name: str) -> TriangleMesh:
    return generate_surface(load_registry(), name)


def is_kept(surface: Surface) -> bool:
    """Whether a surface was made before and is in the cache."""
    return surface.kept is not None and surface.kept(**surface.arguments({})).is_file()
