"""The best of the suite's maps to a disk with circular holes."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from cembench.conformal.metrics import CIRCULAR, boundary_circularity
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import HoledMesh
from cembench.registry import algorithm

from ..direct_cem.holes import direct_cem_holes
from ..koebe_cem.koebe_cem import koebe_cem
from .choice import USUAL_WORK, Candidate, best_of

#: In the order of preference.
CANDIDATES = {
    "direct-cem-holes": Candidate(direct_cem_holes),
    "koebe-cem": Candidate(koebe_cem, cost=3),
}


@algorithm(
    "best-holes",
    title="Best of two, holes",
    target="circular holes",
    source="This suite: docs/algorithms.md",
    usual=False,
)
def best_holes(
    mesh: HoledMesh,
    *,
    outer: Annotated[int, Field(ge=0, lt=2**63)] | None = None,
    work: Annotated[float, Field(gt=0, allow_inf_nan=False)] = USUAL_WORK,
    repair: bool = True,
) -> Parameterization:
    """Map to a disk with circular holes by direct-cem-holes and koebe-cem, and keep the better map.

    `outer`, `work`, `chosen` and `tried` are as in direct-cem-holes and best.
    """
    return best_of(mesh, [CANDIDATES], work, _flaw, outer=outer, repair=repair)


def _flaw(mesh: HoledMesh, z: NDArray[np.complex128]) -> str:
    return "" if boundary_circularity(mesh, z) <= CIRCULAR else "holes that are not round"
