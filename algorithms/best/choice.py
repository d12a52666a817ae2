"""Choose among the maps of several algorithms: the least angle error, then the most even area."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from cembench.conformal.angle_gauge import EQUAL
from cembench.conformal.metrics import MapFigures, flipped_triangles
from cembench.conformal.planar import signed_areas
from cembench.conformal.texel_density import texel_density_ratio
from cembench.core.arrays import Complex
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import TriangleMesh

M = TypeVar("M", bound=TriangleMesh)

#: A mean angle error, in degrees, above which a later tier may be better.
POOR = 10.0
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
    mesh: M,
    tiers: Sequence[Mapping[str, Candidate]],
    work: float,
    flaw: Callable[[M, Complex], str] = lambda mesh, z: "",
    **given: Any,
) -> Parameterization:
    """Return the valid map with the smallest mean angle error; of equal ones the most even in area.

    Errors within 1 % of the smallest are equal. Where no map is valid, those with the fewest folds
    count. Candidates are tried in their order, those of a later tier only if no map of an earlier
    one is valid with an error of at most 10 degrees. One is left out if the triangles of the
    surface times the costs of its tier up to it exceed `work`; the first of a tier never is. So the
    choice depends on the surface alone.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    tiers : sequence of mappings
        Candidates by name.
    work : float
        The limit, in triangles that a candidate of cost 1 maps.
    flaw : function
        Returns why a map without folds is not valid; "" if it is.
    **given
        Parameters of all candidates.

    Returns
    -------
    Parameterization
        The map, with the iterations, energies and extras of the chosen algorithm. In its extras,
        ``chosen`` is that algorithm's name, and ``tried`` has, for each, ``angle_error_mean_deg``
        and ``texel_density_ratio``, or why there is no valid map.

    Raises
    ------
    AlgorithmFailed
        No candidate has a map.
    """
    surface = MapFigures(mesh, np.zeros(mesh.n, dtype=np.complex128))
    tried: dict[str, dict[str, float] | str] = {}
    maps: list[tuple[tuple[int, bool], float, float, str, Parameterization]] = []
    for tier in tiers:
        spent, first = 0.0, next(iter(tier))
        for name, one in tier.items():
            spent += one.cost * mesh.m
            if name != first and spent > work:
                tried[name] = f"not tried: on {mesh.m:,} triangles it needs work={spent:.2g}"
                continue
            try:
                made = one.call(mesh, **given)
            except AlgorithmFailed as error:
                tried[name] = str(error)
                continue
            folds = flipped_triangles(mesh, made.uv)
            why = f"{folds:,} folds" if folds else flaw(mesh, made.uv)
            off = float(surface.angle_errors_of(made.uv).mean())
            ratio = texel_density_ratio(surface.areas, signed_areas(made.uv, mesh.F))
            tried[name] = why or {"angle_error_mean_deg": off, "texel_density_ratio": ratio}
            maps.append(((folds, bool(why)), off, ratio, name, made))
        if any(not why and off <= POOR for (_, why), off, *_ in maps):
            break
    if not maps:
        causes = "; ".join(f"{name}: {why}" for name, why in tried.items())
        raise AlgorithmFailed(f"no algorithm has a map ({causes})")
    fewest, least, *_ = min(maps, key=lambda one: one[:2])
    equal = [one for one in maps if one[0] == fewest and one[1] <= (1 + EQUAL) * least]
    *_, name, made = min(equal, key=lambda one: one[2])
    return replace(made, extras=made.extras | {"chosen": name, "tried": tried})
