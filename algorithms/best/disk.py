"""The best of the suite's maps to the disk."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from time import perf_counter
from typing import Annotated

from pydantic import Field

from cembench.conformal.angle_gauge import angle_gauge
from cembench.conformal.even_weights import evened
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

from ..cetm.disk import cetm
from ..cetm.flips import cetm_flips
from ..direct_cem.disk import direct_cem
from .choice import Candidate, best_of

#: In the order of their cost.
CANDIDATES = {
    "direct-cem": Candidate(direct_cem),
    "direct-cem, back=0": Candidate(partial(direct_cem, back=0.0)),
    "cetm": Candidate(cetm, cost=4),
    "cetm-flips": Candidate(cetm_flips, cost=8),
}

#: The most steps from the best map, which the last of them do not improve any more.
MOST_STEPS = 10


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
    seconds: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 60.0,
    repair: bool = True,
) -> Parameterization:
    """Map to the disk by direct-cem, cetm and cetm-flips, and keep the smallest mean angle error.

    For somebody with one surface, who wants the best map and not a comparison: no single algorithm
    has the smallest angle errors everywhere. direct-cem always has a valid map, with its usual
    `back` and at the least E_C; cetm has slightly better angles where the mesh has a flat metric;
    cetm-flips is better on surfaces that must be scaled very unevenly. An algorithm that would
    probably end later than `seconds` after the start is left out. The best map is moved to the
    Moebius gauge that is best for its angles; within this time, steps whose weights count all
    triangles alike lower its mean angle error further, until one wins less than a thousandth
    (`even_steps`). `chosen` names the algorithm, `tried` has the mean angle error of each, in
    degrees, before all this.
    """
    start = perf_counter()
    chosen = best_of(mesh, CANDIDATES, seconds, repair=repair)
    uv, steps = angle_gauge(mesh, chosen.uv), 0
    while steps < MOST_STEPS and perf_counter() - start < seconds:
        uv, taken = evened(mesh, uv, 1)
        if not taken:
            break
        steps += 1
    return replace(chosen, uv=uv, extras=chosen.extras | {"even_steps": steps})
