"""Boundary first flattening to the unit disk."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from cembench.conformal.boundary_energy import in_gauge
from cembench.conformal.circle_domain import CircleDomain
from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.gauge import Gauge, gauge_measure
from cembench.conformal.last_resort import with_last_resort
from cembench.core.arrays import Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

from .yamabe import YamabeBoundary

#: Largest ratio of boundary lengths; above it the boundary is too crowded.
CROWDED = 1e13


@algorithm(
    "bff",
    title="BFF",
    target="disk",
    source="Sawhney & Crane, Boundary first flattening, 2017",
    usual=False,
)
@with_last_resort
def bff(
    mesh: DiskMesh,
    *,
    tolerance: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 1e-3,
    max_sweeps: Annotated[int, Field(ge=1, le=1_000_000)] = 100,
    gauge: Gauge = "boundary",
    delaunay: bool = False,
    repair: bool = True,
    last_resort: bool = True,
) -> Parameterization:
    """Map to the disk with exterior angles of the boundary in proportion to its lengths.

    The exterior angles k~ of a flat image and the log scale u of its boundary depend on each other
    linearly, k~ = k - L_bi L_ii^-1 Omega + S u with S the Schur complement of the Laplacian. A
    circle has k~_i = 2 pi (l~_i-1 + l~_i) / (2 sum l~). Starting from u = 0, u and the lengths
    l~_ij = l_ij exp((u_i + u_j) / 2) are computed from each other in turn, on the boundary alone.
    One factorisation, interior first, serves all sweeps and the Dirichlet solve at the end.

    Decided here: after each sweep the vertices are put on the circle with arcs in proportion to l~,
    which have exactly those exterior angles, and a Moebius map moves them into the `gauge` of
    direct-cem, since sweeps alone drift through Moebius images and never end. The sweeps end when
    no arc changes by more than a relative `tolerance` (`sweeps`, `change`), and fail after
    `max_sweeps`; each removes about half of the error. The interior is the harmonic extension of
    both coordinates. `gauss_bonnet` is the distance of the sum of the natural k~ (u = 0) from 2 pi.
    Folds are repaired as in CEM (`fold_repairs`); `last_resort`
    makes the map valid in any case.
    """
    yamabe = YamabeBoundary(mesh, delaunay=delaunay)
    measure = gauge_measure(mesh, gauge, mesh.boundary)
    weights = yamabe.bordered.swept_to_boundary(measure[:, None])[:, 0]
    with phase("boundary sweeps"):
        domain, sweeps, change = _circular(yamabe, weights, tolerance, max_sweeps)
    uv = yamabe.bordered.harmonic_extension(domain.points)
    uv, folds = accepted_repair(mesh, uv, yamabe.L, repair=repair)
    extras = {
        "sweeps": sweeps,
        "change": change,
        "gauss_bonnet": abs(float(yamabe.natural.sum()) - 2 * np.pi),
    }
    return Parameterization(uv, extras={**extras, **folds})


def _turns(lengths: Real) -> Real:
    """Return the exterior angles, in radians, of the polygon on a circle with these arcs."""
    return np.asarray(np.pi * (lengths + np.roll(lengths, 1)) / lengths.sum())


def _circular(
    yamabe: YamabeBoundary, weights: Real, tolerance: float, most: int
) -> tuple[CircleDomain, int, float]:
    """Return arcs whose exterior angles are in proportion; the sweeps and the last change."""
    domain = in_gauge(CircleDomain.of_arcs(yamabe.lengths), weights)
    for sweep in range(1, most + 1):
        u = yamabe.scale(_turns(domain.arcs))
        if not np.ptp(u) <= np.log(CROWDED):
            raise AlgorithmFailed(
                f"the boundary is too crowded: in sweep {sweep} the scale varies by a factor of "
                f"exp({np.ptp(u):.3g}) between its vertices, beyond the range of doubles. "
                "Use direct-cem, which keeps vertices apart"
            )
        before, domain = domain, in_gauge(CircleDomain.of_arcs(yamabe.scaled(u)), weights)
        change = float(np.abs(np.log(domain.arcs / before.arcs)).max())
        if change <= tolerance:
            return domain, sweep, change
    raise AlgorithmFailed(
        f"the boundary's arcs have not converged after {most} sweeps: the last one changed an "
        f"arc by the factor exp({change:.2g}), tolerance {tolerance:g}. Allow more with max_sweeps"
    )
