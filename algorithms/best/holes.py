"""The best of the suite's maps to a disk with circular holes."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import HoledMesh
from cembench.registry import algorithm

from ..direct_cem.holes import direct_cem_holes
from ..harmonic_filled import harmonic_filled
from ..koebe_cem.koebe_cem import koebe_cem
from .choice import Candidate, best_of

#: In the order of preference.
CANDIDATES = {
    "direct-cem-holes": Candidate(direct_cem_holes),
    "harmonic-filled": Candidate(harmonic_filled),
    "koebe-cem": Candidate(koebe_cem, cost=3),
}


@algorithm(
    "best-holes",
    title="Best of three, holes",
    target="circular holes",
    source="This suite: docs/algorithms.md",
    usual=False,
)
def best_holes(
    mesh: HoledMesh,
    *,
    outer: Annotated[int, Field(ge=0, lt=2**63)] | None = None,
    seconds: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 60.0,
    repair: bool = True,
) -> Parameterization:
    """Map to a disk with circular holes by three algorithms, and keep the best valid map.

    These are direct-cem-holes, harmonic-filled and koebe-cem, of which each has valid maps where
    others fold. `outer`, `seconds`, `chosen` and `tried` are as in direct-cem-holes and best.
    """
    return best_of(mesh, CANDIDATES, seconds, outer=outer, repair=repair)
