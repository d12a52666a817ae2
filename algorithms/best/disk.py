"""The best of the suite's maps to the disk."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Annotated, Any

from pydantic import Field

from cembench.conformal.angle_gauge import angle_gauge
from cembench.conformal.even_weights import evened
from cembench.conformal.graded_meshes import USUAL_STEPS, is_graded
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

from ..cetm.disk import cetm
from ..cetm.flips import cetm_flips
from ..direct_cem.disk import direct_cem
from .choice import USUAL_WORK, Candidate, best_of


def _evened_if_graded(method: Callable[..., Parameterization]) -> Callable[..., Parameterization]:
    """Let a method end with the even steps that direct-cem takes by itself on graded meshes."""

    def better(mesh: DiskMesh, **parameters: Any) -> Parameterization:
        own = method(mesh, **parameters)
        uv, steps = evened(mesh, own.uv, USUAL_STEPS if is_graded(mesh) else 0)
        return replace(own, uv=uv) if steps else own

    return better


#: In the order of their cost.
CANDIDATES = {
    "direct-cem": Candidate(direct_cem),
    "direct-cem, back=0": Candidate(partial(direct_cem, back=0.0)),
    "cetm": Candidate(_evened_if_graded(cetm), cost=4),
    "cetm-flips": Candidate(_evened_if_graded(cetm_flips), cost=8),
}

#: The most steps from the best map, and what each costs as in :class:`Candidate`.
MAX_STEPS, STEP = 10, 4.0


@algorithm(
    "best",
    title="Best of three",
    target="disk",
    source="This suite: docs/algorithms.md",
    usual=False,
)
def best(
    mesh: DiskMesh,
    *,
    work: Annotated[float, Field(gt=0, allow_inf_nan=False)] = USUAL_WORK,
    repair: bool = True,
) -> Parameterization:
    """Map to the disk by direct-cem, cetm and cetm-flips, and keep the smallest mean angle error.

    For somebody with one surface, who wants the best map and not a comparison: no single algorithm
    has the smallest angle errors everywhere. direct-cem always has a valid map, with its usual
    `back` and at the least E_C; cetm has slightly better angles where the mesh has a flat metric;
    cetm-flips is better on surfaces that must be scaled very unevenly. Of maps whose angle errors
    are within 1 % of the smallest, the one with the most even texel density is taken. It is moved
    to the Moebius gauge that is best for its angles, by the same rule; steps whose weights count
    all triangles alike lower its mean angle error further, until one wins less than a thousandth
    (`even_steps`). `work` limits the triangles mapped, in the time that direct-cem takes for one:
    algorithms and steps that exceed it are left out, by the size of the surface alone, so that the
    same surface always has the same map. `chosen` names the algorithm, `tried` has the mean angle
    error, in degrees, and the texel density ratio of each before all this, but on graded meshes
    after the two such steps that direct-cem takes by itself.
    """
    chosen = best_of(mesh, [CANDIDATES], work, repair=repair)
    most = min(MAX_STEPS, int(work / (STEP * mesh.m)))
    uv, steps = evened(mesh, angle_gauge(mesh, chosen.uv), most)
    return replace(chosen, uv=uv, extras=chosen.extras | {"even_steps": steps})
