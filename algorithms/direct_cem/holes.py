"""The conformal energy minimised directly over unit disks with circular holes."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import Annotated

import numpy as np
from pydantic import Field

from cembench.conformal.annulus import annulus_map
from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.boundary_energy import EnergyModel, in_gauge, minimise
from cembench.conformal.circle_domain import CircleDomain
from cembench.conformal.filled_start import CROWDED, widest_start
from cembench.conformal.gauge import Gauge, gauge_measure
from cembench.conformal.harmonic import edge_lengths
from cembench.conformal.laplacian import laplacian
from cembench.conformal.metrics import SampledAngleError, dirichlet_energy, image_area
from cembench.core.arrays import Complex, Loop
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import HoledMesh
from cembench.registry import algorithm

from .gauge_walk import STEPS, gauge_walk
from .opened import valid_with_holes

#: Largest relative increase of E_C for giving crowded arcs the proportions of the start.
MAX_COST = 0.01


@algorithm(
    "direct-cem-holes",
    title="Direct CEM",
    target="circular holes",
    source="This suite: docs/direct_cem.md",
)
def direct_cem_holes(
    mesh: HoledMesh,
    *,
    tolerance: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 1e-7,
    max_iterations: Annotated[int, Field(ge=0, le=1_000_000)] = 100,
    gauge: Gauge = "boundary",
    outer: Annotated[int, Field(ge=0, lt=2**63)] | None = None,
    delaunay: bool = False,
    repair: bool = True,
    last_resort: bool = True,
) -> Parameterization:
    """Map a surface with holes to the circle domain of least conformal energy.

    As `direct-cem`, without its final move back, and with the centre and the radius of every hole
    as further unknowns. The holes are open in every step, and their circles exact. The outer
    boundary is that of the vertex `outer`, or the widest.

    Decided here: the start fills the holes with disks, with the vertices on the rim spaced by the
    hole's equilibrium measure, and fits circles to their images. The origin is near the middle
    triangle or among the holes, whichever has the lower energy, and is then moved into the `gauge`.
    If a circle has a radius below 1e-3, each boundary is tried as the outer one; the one that makes
    the smallest circle largest is outside while E_C is minimised (`outside_while_minimised`; the
    energy history is that of this domain), and a Moebius map then brings the outer boundary
    outside. Arcs below a hundredth of the mean arc, which hardly change the energy, take the
    proportions of the start's if that has better angles and raises E_C by at most 1 % (`settled`).
    A surface with one hole whose radius stays below 1e-3 is mapped by its logarithm (`stopped`:
    "annulus"), since E_C in the disk does not see the far end of a tube. Folds are repaired with
    the boundary fixed (`fold_repairs`); a map that had some gives way to a better one of the filled
    surface, with circles cut out of it (`last_resort`).
    """
    L = laplacian(mesh, delaunay=delaunay)
    with phase("boundary"):
        widest, holes = mesh.outer_and_holes(_only_loop_with_ears(mesh) if outer is None else outer)
    bordered = BorderedLaplacian(mesh, L, (widest, *holes))
    S = bordered.dirichlet_to_neumann()
    with phase("start"):
        measures = [gauge_measure(mesh, name, widest) for name in ("triangle", gauge)]
    seen, weights = bordered.swept_to_boundary(np.stack(measures, axis=1)).T
    with phase("start"):
        lengths = [edge_lengths(mesh, loop) for loop in (widest, *holes)]
        start = widest_start(S, seen, lengths)
    if len(holes) == 1 and start.radii.min() < CROWDED:
        with suppress(AlgorithmFailed):  # too few vertices to go around a circle
            return _annulus(mesh, widest, holes[0], repair, last_resort)
    chart = start.rims.outer
    start = start if chart else in_gauge(start, weights)
    held = weights if gauge == "triangle" and not chart else start.outer_measure
    minimum = minimise(S, start, held, tolerance=tolerance, max_iterations=max_iterations)
    angle_error = SampledAngleError(mesh)
    model, settled = _settled(minimum.model, start, bordered.harmonic_extension, angle_error)
    energies = minimum.energies + ((model.energy,) if settled else ())
    if chart:
        model = model.at(in_gauge(model.domain.inside_out(0), weights))
    steps = STEPS if gauge == "boundary" and minimum.reason == "gradient" else 0
    uv, walked = gauge_walk(model, bordered.harmonic_extension, angle_error, steps)
    energies += () if chart else walked
    uv, folds = valid_with_holes(mesh, (widest, *holes), uv, repair=repair, last_resort=last_resort)
    extras = {
        "stopped": minimum.reason,
        "gradient": None if minimum.reason == "crowded" else minimum.gradient,
        "gauge_steps": len(walked),
        "hessian_products": minimum.products,
        "held_arcs": minimum.held_arcs,
        "settled": settled,
        "outside_while_minimised": int(widest[0] if not chart else holes[chart - 1][0]),
        **folds,
    }
    return Parameterization(uv, len(energies) - 1, energies, extras)


def _only_loop_with_ears(mesh: HoledMesh) -> int | None:
    """Return a vertex of the one loop that has triangles with all corners on it; None for others.

    Such a triangle lies inside a circle, so it folds at a hole.
    """
    of = np.full(mesh.n, -1)
    for k, loop in enumerate(mesh.loops):
        of[loop] = k
    corners = of[mesh.F]
    alike = (corners[:, 0] >= 0) & (np.ptp(corners, axis=1) == 0)
    loops = np.unique(corners[alike, 0])
    return int(mesh.loops[int(loops[0])][0]) if len(loops) == 1 else None


def _annulus(
    mesh: HoledMesh, outer: Loop, hole: Loop, repair: bool, last_resort: bool
) -> Parameterization:
    """Return the map of a surface with one hole by its logarithm."""
    own = annulus_map(mesh, outer, hole)
    uv, folds = valid_with_holes(mesh, (outer, hole), own, repair=repair, last_resort=last_resort)
    energy = dirichlet_energy(mesh, uv) - image_area(mesh, uv)
    return Parameterization(uv, 0, (energy,), {"stopped": "annulus", **folds})


def _settled(
    here: EnergyModel,
    start: CircleDomain,
    extended: Callable[[Complex], Complex],
    angle_error: SampledAngleError,
) -> tuple[EnergyModel, bool]:
    """Return the minimum with the start's proportions in crowded arcs, if that improves angles."""
    domain = here.domain.settled(start)
    if domain is here.domain:
        return here, False
    there = here.at(in_gauge(domain, here.weights))
    if there.energy > (1 + MAX_COST) * here.energy:
        return here, False
    errors = [angle_error(extended(model.domain.points)) for model in (here, there)]
    return (there, True) if errors[1] < errors[0] else (here, False)
