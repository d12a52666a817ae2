"""The conformal energy minimised directly over the boundary positions on the unit circle."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any

import numpy as np
import scipy
from pydantic import Field

from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.boundary_energy import EnergyModel, Minimum, in_gauge, minimise
from cembench.conformal.boundary_modes import estimated_energy
from cembench.conformal.circle_domain import CircleDomain
from cembench.conformal.dirichlet_to_neumann import DirichletToNeumann
from cembench.conformal.filled_start import arcs_of_measure
from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.gauge import Gauge, gauge_measure
from cembench.conformal.graded_meshes import better_if_graded
from cembench.conformal.harmonic import edge_lengths
from cembench.conformal.interior_laplacian import InteriorLaplacian, solves_pay
from cembench.conformal.laplacian import delaunay_laplacian, laplacian
from cembench.conformal.last_resort import with_last_resort
from cembench.conformal.quasi_newton import quasi_newton_minimum
from cembench.core.arrays import Complex, Real
from cembench.core.clock import phase
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

#: The start and its name, the minimum, and the map for given boundary values.
_Minimised = tuple[CircleDomain, str, Minimum, Callable[[Complex], Complex]]

#: Arc length is no better a start than harmonic measure if its estimated energy is so many times
#: the other one's, which is known.
SURELY_MORE = 2
#: Where flips move more than this share of the triangles' corners, the interior is ordered by
#: position: so on grids of heights, which lose what made minimum degree cheap. Scans have less.
MANY_FLIPS = 0.2


@algorithm("direct-cem", title="Direct CEM", target="disk", source="This suite: docs/direct_cem.md")
@better_if_graded
@with_last_resort
def direct_cem(
    mesh: DiskMesh,
    *,
    tolerance: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 1e-6,
    max_iterations: Annotated[int, Field(ge=0, le=1_000_000)] = 50,
    gauge: Gauge = "boundary",
    back: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.01,
    delaunay: bool = True,
    even: Annotated[int, Field(ge=0, le=100)] | None = None,
    splits: Annotated[int, Field(ge=0, le=4)] | None = None,
    repair: bool = True,
    last_resort: bool = True,
) -> Parameterization:
    """Minimise the conformal energy over the boundary's angles on the circle, by Newton's method.

    E_C of the harmonic map (Eqs. 5, 7, 8) is a function of the boundary's angles alone,
    z^* S z / 2 - A(z), with S = L_bb - L_bi L_ii^-1 L_ib. One factorisation, interior first and
    boundary last, serves the start, the last Dirichlet solve and S, which is its trailing block.
    Newton steps (trust region, preconditioned by S^-1) involve only the boundary. Where that block
    would be dearer than a few solves, on boundaries of more than 500 vertices, the interior alone
    is factored and the steps are quasi-Newton ones, each a solve from the boundary's neighbours to
    these, which passes a third of the factor (`hessian_products` is then 0); the choice is an
    estimate of operations (`interior_laplacian.py`).

    Decided here: the weights are those of the intrinsic Delaunay triangulation, none of which is
    negative; with `delaunay` off they are the cotangents of the mesh's own edges, as in CEM. The
    recorded energies use the same weights. The start is the harmonic measure of the boundary from
    the triangle nearest to the mean vertex, or arc length if that has lower energy (`start`). It is
    moved into the `gauge`, that is, a mean is moved to 0: of the boundary by length, of that
    triangle, or of the surface by area; from there on Moebius maps are fixed by the start's arcs.
    The iteration ends when the gradient, whose squared norm is about twice what E_C can still
    decrease, shows that this is at most `tolerance` times E_C (`stopped`: "gradient"), when
    only rounding is left ("rounding"), after `max_iterations` ("iterations"), or when too many arcs
    would fall below a tenth of their initial length ("crowded"; `held_arcs` counts those held).
    Near its minimum E_C is flat but the angles are not, and harmonic measure has better ones. So
    the boundary is finally moved back towards it as far as that raises E_C by at most the share
    `back`; 0 keeps the least E_C. E_C counts a triangle by the area of its image; at most `even`
    more steps, each as dear as all of this, lower the mean angle error with weights that count all
    triangles alike (`even_steps`): by default two on graded meshes, whose areas vary over decades,
    and none on others. With `splits`, all this is also done with every triangle split into four,
    so many times, and the map with the smaller mean angle error is kept: by default up to twice on
    meshes with needles or graded ones if more than 5 degrees are left, and at most 25,000
    triangles then. Folds are repaired as in CEM (`fold_repairs`); `last_resort` makes the map
    valid in any case.
    """
    del even, splits  # the decorator's
    L, flipped = delaunay_laplacian(mesh) if delaunay else (laplacian(mesh), 0.0)
    with phase("start"):
        middle = gauge_measure(mesh, "triangle", mesh.boundary)
        centred = middle if gauge == "triangle" else gauge_measure(mesh, gauge, mesh.boundary)
        measures = np.stack([middle, centred], axis=1)
    until = {"tolerance": tolerance, "max_iterations": max_iterations}
    own_gauge = gauge == "triangle"
    many = flipped > MANY_FLIPS
    solved = _by_solves(mesh, L, measures, own_gauge, by_position=many, **until)
    start, begun, minimum, extended = solved or _by_factor(mesh, L, measures, own_gauge, **until)
    energies = minimum.energies
    share = _share(back, energies) if begun == "harmonic measure" else 0.0
    model = minimum.model
    if share:
        model = model.at(in_gauge(model.domain.towards(start, share), model.weights))
        energies += (model.energy,)
    uv = extended(model.domain.points)
    uv, folds = accepted_repair(mesh, uv, L, repair=repair)
    extras = {
        "stopped": minimum.reason,
        "gradient": None if minimum.reason == "crowded" else minimum.gradient,
        "start": begun,
        "hessian_products": minimum.products,
        "held_arcs": minimum.held_arcs,
        **folds,
    }
    return Parameterization(uv, len(energies) - 1, energies, extras)


def _by_factor(
    mesh: DiskMesh, L: scipy.sparse.csc_array, measures: Real, own_gauge: bool, **until: Any
) -> _Minimised:
    """Minimise with S in hand: the end of a factor that has the boundary last."""
    bordered = BorderedLaplacian(mesh, L, (mesh.boundary,))
    S = bordered.dirichlet_to_neumann()
    seen, weights = bordered.swept_to_boundary(measures).T
    start, begun = _start(S, _starts(mesh, seen), weights)
    held = weights if own_gauge else start.outer_measure
    minimum = minimise(S, start, held, **until)
    return start, begun, minimum, bordered.harmonic_extension


def _by_solves(
    mesh: DiskMesh,
    L: scipy.sparse.csc_array,
    measures: Real,
    own_gauge: bool,
    *,
    by_position: bool,
    **until: Any,
) -> _Minimised | None:
    """Minimise with the interior factored alone; None where that is dearer or does not do."""
    if not solves_pay(len(mesh.interior), len(mesh.boundary)):
        return None
    interior = InteriorLaplacian(mesh, L, mesh.boundary, measures, by_position=by_position)
    seen, weights = interior.swept.T
    arcs, begun = _starts(mesh, seen), "harmonic measure"
    start = in_gauge(CircleDomain.of_arcs(arcs[begun]), weights)
    S = interior.dirichlet_to_neumann(start.arcs)
    model = _at_start(S, start, weights, own_gauge)
    otherwise = in_gauge(CircleDomain.of_arcs(arcs["arc length"]), weights)
    if estimated_energy(otherwise.points, start.arcs) < SURELY_MORE * model.energy:
        start, begun = _start(S, arcs, weights)
        model = _at_start(S, start, weights, own_gauge)
    minimum = quasi_newton_minimum(model, **until)
    if minimum is None:
        return None
    return start, begun, minimum, interior.harmonic_extension


def _at_start(
    S: DirichletToNeumann, start: CircleDomain, weights: Real, own_gauge: bool
) -> EnergyModel:
    """Return the energy at the start, in the gauge that the minimisation holds."""
    held = weights if own_gauge else start.outer_measure
    return EnergyModel(S, in_gauge(start, held), held)


def _share(cost: float, energies: tuple[float, ...]) -> float:
    """Return the share of the way back that raises E_C, a parabola along it, by `cost`."""
    fallen = energies[0] - energies[-1]
    return min(1.0, (cost * energies[-1] / fallen) ** 0.5) if fallen > 0 else 0.0


def _starts(mesh: DiskMesh, seen: Real) -> dict[str, Real]:
    """Return the arcs (B,) of both starts; `seen` is the measure from the middle triangle."""
    lengths = edge_lengths(mesh, mesh.boundary)
    return {"harmonic measure": arcs_of_measure(seen, lengths), "arc length": lengths}


def _start(
    S: DirichletToNeumann, arcs: Mapping[str, Real], weights: Real
) -> tuple[CircleDomain, str]:
    """Return the start of lower energy in the gauge, and its name."""
    models = {}
    for name in arcs:
        domain = in_gauge(CircleDomain.of_arcs(arcs[name]), weights)
        models[name] = EnergyModel(S, domain, weights)
    best = min(models, key=lambda name: models[name].energy)
    return models[best].domain, best
