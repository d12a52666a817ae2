"""Choose the map with the smallest angle errors among those of several algorithms."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any, TypeVar

from cembench.conformal.metrics import angle_errors, flipped_triangles
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import TriangleMesh

M = TypeVar("M", bound=TriangleMesh)


@dataclass(frozen=True)
class Candidate:
    """An algorithm that is tried.

    Parameters
    ----------
    call : function
        The algorithm.
    cost : float
        About how many times as long it takes as the first candidate.

    """

    call: Callable[..., Parameterization]
    cost: float = 1.0


def best_of(
    mesh: M, candidates: Mapping[str, Candidate], seconds: float, **given: Any
) -> Parameterization:
    """Return the map with the fewest folds and, of these, the smallest mean angle error.

    Candidates are tried in their order. One is left out if it would probably end later than
    `seconds` after the start; the first never is. `given` are parameters of all of them.

    Returns
    -------
    Parameterization
        The map, with what the chosen algorithm tells of it. In its extras, ``chosen`` is that
        algorithm's name, and ``tried`` has, for each, the mean angle error in degrees or why there
        is none.

    Raises
    ------
    AlgorithmFailed
        No candidate has a map.

    """
    start, first = perf_counter(), 0.0
    tried: dict[str, float | str] = {}
    best: tuple[int, float, str, Parameterization] | None = None
    for name, one in candidates.items():
        spent = perf_counter() - start
        if tried and spent + one.cost * first > seconds:
            tried[name] = f"not tried: it may take longer than {seconds:g} s"
            continue
        try:
            chosen = one.call(mesh, **given)
        except AlgorithmFailed as error:
            tried[name] = str(error)
        else:
            folds = flipped_triangles(mesh, chosen.uv)
            off = float(angle_errors(mesh, chosen.uv).mean())
            tried[name] = f"{folds:,} folds" if folds else off
            if best is None or (folds, off) < best[:2]:
                best = folds, off, name, chosen
        first = first or perf_counter() - start
    if best is None:
        causes = "; ".join(f"{name}: {why}" for name, why in tried.items())
        raise AlgorithmFailed(f"no algorithm has a map ({causes})")
    *_, name, chosen = best
    return replace(chosen, extras=chosen.extras | {"chosen": name, "tried": tried})
