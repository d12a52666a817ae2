"""Choose among the maps of several algorithms: the least angle error, then the most even area."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from cembench.conformal.angle_gauge import EQUAL
from cembench.conformal.metrics import CIRCULAR, MapFigures, boundary_circularity, flipped_triangles
from cembench.conformal.texel_density import texel_density_ratio
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import HoledMesh, TriangleMesh

M = TypeVar("M", bound=TriangleMesh)

#: The usual limit of `work`: about a minute.
USUAL_WORK = 2e7


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
    mesh: M, candidates: Mapping[str, Candidate], work: float, **given: Any
) -> Parameterization:
    """Return the valid map with the smallest mean angle error; of equal ones the most even in area.

    Errors within 1 % of the smallest are equal. Where no map is valid, those with the fewest folds
    count, and of these those with round holes. Candidates are tried in their order. One is left out
    if the triangles of the surface times the costs up to it exceed `work`; the first never is. So
    the choice depends on the surface alone. `given` are parameters of all candidates.

    Returns
    -------
    Parameterization
        The map, with the iterations, energies and extras of the chosen algorithm. In its extras,
        ``chosen`` is that algorithm's name, and ``tried`` has, for each, ``angle_error_mean_deg``
        and ``texel_density_ratio``, or why there is no map to compare.

    Raises
    ------
    AlgorithmFailed
        No candidate has a map.

    """
    tried: dict[str, dict[str, float] | str] = {}
    maps: list[tuple[tuple[int, bool], float, float, str, Parameterization]] = []
    spent = 0.0
    for name, one in candidates.items():
        spent += one.cost * mesh.m
        if tried and spent > work:
            tried[name] = f"not tried: on {mesh.m:,} triangles it needs work={spent:.2g}"
            continue
        try:
            made = one.call(mesh, **given)
        except AlgorithmFailed as error:
            tried[name] = str(error)
            continue
        faults = flipped_triangles(mesh, made.uv), not _has_round_holes(mesh, made)
        figures = MapFigures(mesh, made.uv)
        off = float(figures.angle_errors.mean())
        ratio = texel_density_ratio(figures.areas, figures.image_areas)
        known = {"angle_error_mean_deg": off, "texel_density_ratio": ratio}
        tried[name] = known if faults == (0, False) else _words(*faults)
        maps.append((faults, off, ratio, name, made))
    if not maps:
        causes = "; ".join(f"{name}: {why}" for name, why in tried.items())
        raise AlgorithmFailed(f"no algorithm has a map ({causes})")
    fewest, least, *_ = min(maps, key=lambda one: one[:2])
    equal = [one for one in maps if one[0] == fewest and one[1] <= (1 + EQUAL) * least]
    *_, name, made = min(equal, key=lambda one: one[2])
    return replace(made, extras=made.extras | {"chosen": name, "tried": tried})


def _has_round_holes(mesh: TriangleMesh, made: Parameterization) -> bool:
    """Whether holes are circles as "circular holes" promises; True for a disk."""
    return not isinstance(mesh, HoledMesh) or boundary_circularity(mesh, made.uv) <= CIRCULAR


def _words(folds: int, unround: bool) -> str:
    return f"{folds:,} folds" if folds else "holes that are not round"
