"""Map many surfaces to the plane, in this process or in several."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import Future
from functools import partial
from typing import Any, Literal

from cembench.api.parameterize import Check, Result, parameterize
from cembench.api.settings import MapTarget
from cembench.core.errors import CembenchError, ParameterError
from cembench.registry import load_registry
from cembench.running.process_pool import process_pool
from cembench.running.surfaces import SurfaceInput

#: What becomes of a surface without a valid map.
Errors = Literal["raise", "yield"]
#: Surfaces that are on their way to each process.
_AHEAD = 4


def parameterize_many(
    surfaces: Iterable[SurfaceInput],
    algorithm: str | None = None,
    *,
    target: MapTarget | None = None,
    jobs: int = 1,
    check: Check = "fast",
    errors: Errors = "raise",
    keep_invalid: bool = False,
    plugins: Iterable[str] = (),
    **parameters: Any,
) -> Iterator[Result | CembenchError]:
    """Map surfaces to the plane one after the other, and check the maps.

    Surfaces are taken from the iterable as they are needed, so it may be longer than memory.

    Parameters
    ----------
    surfaces : iterable of meshes, paths, names or pairs (V, F); or one path or name
        Disks or surfaces with holes.
    algorithm : str, optional
        As for :func:`parameterize`.
    target : str, optional
        As for :func:`parameterize`.
    jobs : int
        Number of processes. A script that is run as the main program needs
        ``if __name__ == "__main__"`` with more than one.
    check : {"fast", "full"}
        As for :func:`parameterize`, but "fast" by default.
    errors : {"raise", "yield"}
        Whether the first surface without a valid map ends the iteration, or its error is yielded
        in place of a result.
    keep_invalid : bool
        Whether an invalid map is a result; see :attr:`Result.ok`.
    plugins : iterable of str
        Python files or ``module:name`` with more algorithms.
    **parameters
        Parameters of the algorithm.

    Returns
    -------
    iterator of Result or CembenchError
        In the order of the surfaces.

    Raises
    ------
    ParameterError
        `jobs` is below 1, or `check` or `errors` is unknown.
    MeshError, RegistryError, AlgorithmFailed
        As for :func:`parameterize`, unless errors are yielded.

    Examples
    --------
    >>> import cembench
    >>> disks = (cembench.surface("cone", faces) for faces in (100, 200))
    >>> [result.ok for result in cembench.parameterize_many(disks)]
    [True, True]
    """
    if jobs < 1:
        raise ParameterError(f"jobs={jobs} is not allowed; allowed is 1 or more.")
    if errors not in ("raise", "yield"):
        raise ParameterError(f"errors={errors!r} is unknown; allowed: 'raise', 'yield'.")
    one = partial(
        _mapped, algorithm=algorithm, target=target, check=check, keep_invalid=keep_invalid,
        plugins=tuple(plugins), **parameters,
    )  # fmt: skip
    if isinstance(surfaces, str | os.PathLike):
        surfaces = [surfaces]
    results = map(one, surfaces) if jobs == 1 else _in_processes(one, surfaces, jobs)
    return _results(results, raises=errors == "raise")


def _mapped(surface: SurfaceInput, **options: Any) -> Result | CembenchError:
    try:
        return parameterize(surface, **options)
    except CembenchError as error:
        return error


def _results(
    results: Iterator[Result | CembenchError], *, raises: bool
) -> Iterator[Result | CembenchError]:
    for one in results:
        if raises and isinstance(one, CembenchError):
            raise one
        yield one


def _in_processes(one: Any, surfaces: Iterable[SurfaceInput], jobs: int) -> Iterator[Any]:
    """Yield the results of several processes in order, a few surfaces ahead of what is taken."""
    with process_pool(jobs) as pool:
        sent: deque[Future[Any]] = deque()
        for surface in surfaces:
            sent.append(pool.submit(_sent, one, surface))
            if len(sent) == _AHEAD * jobs:
                yield _received(sent.popleft(), one.keywords["plugins"])
        while sent:
            yield _received(sent.popleft(), one.keywords["plugins"])


def _sent(one: Any, surface: SurfaceInput) -> Any:
    """Return a result as parts that can be pickled: functions of plug-ins cannot."""
    result = one(surface)
    if isinstance(result, CembenchError):
        return result
    return result.mesh, result.algorithm.name, result.z, result.outcome


def _received(future: Future[Any], plugins: tuple[str, ...]) -> Result | CembenchError:
    result = future.result()
    if isinstance(result, CembenchError):
        return result
    mesh, name, z, outcome = result
    for array in (mesh.V, mesh.F):
        array.setflags(write=False)  # which is lost on the way
    return Result(mesh, load_registry(plugins).algorithm(name), z, outcome)
