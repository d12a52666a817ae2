"""Conformal energy minimisation (the paper's Algorithm 1)."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.boundary_iteration import Stop, iterate_boundary, on_circle, pole_start
from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.laplacian import laplacian
from cembench.conformal.last_resort import with_last_resort
from cembench.core.arrays import Complex
from cembench.core.parameterization import Parameterization
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm


@algorithm("cem", title="CEM", target="disk", source="The CEM paper, Algorithm 1")
@with_last_resort
def cem(
    mesh: DiskMesh,
    *,
    tolerance: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 1e-5,
    max_iterations: Annotated[int, Field(ge=0, le=1_000_000)] = 20,
    stop: Stop = "drop",
    inversion: bool = True,
    best: bool = False,
    delaunay: bool = False,
    repair: bool = True,
    last_resort: bool = False,
) -> Parameterization:
    """Map a disk by Algorithm 1 of the paper.

    Faithful to Algorithm 1: start (14), (18), (15), (16); iteration (30), (24), (25), (22), or (23)
    instead of (30) with ``inversion=False``. With the vertices ordered interior first, boundary
    last, and the last one pinned, a single Cholesky factor serves the start, by forward
    substitution, and its leading block all Dirichlet solves, by back substitution. Iterations need
    the map next to the boundary only, so they pass no more of the factor than leads there, and the
    rest of the interior is solved for once. If the boundary is short for the surface, its
    neighbours come right before it (`ring_order.py` estimates what pays): then iterations use only
    the dense end of the factor. The maps are the same. `delaunay` takes the weights of the
    intrinsic Delaunay triangulation.

    Decided here, where the paper is silent: the start's triangle is the one whose barycentre is
    nearest to the mean vertex. The iteration ends after the first step that does not lower E_C by
    at least `tolerance`, or after `max_iterations`, and the last iterate is the map, even if that
    step raised E_C. These two readings give the most of the figures that the paper prints for its
    public models. With `stop="change"` a step that raises E_C by `tolerance` or more does not end
    the iteration; if the first one does raise it, that is suggested as the `alternative`. `best`
    returns the iterate of least E_C, where the history then ends (`iterations_dropped` counts those
    after it). A vertex at the origin, which has no inverse, counts as zero in (30). If (30) would
    make boundary vertices change places, which folds the map, that step is (23), and the iteration
    ends if (23) would do so too (`order_kept` counts these steps; 0 on most surfaces). If negative
    cotangent weights still fold the final map, patches around the folds are laid out again
    (`fold_repairs`), unless `repair` is off.
    """
    return map_from_triangle(
        mesh,
        None,
        tolerance=tolerance,
        max_iterations=max_iterations,
        stop=stop,
        inversion=inversion,
        best=best,
        delaunay=delaunay,
        repair=repair,
    )


def map_from_triangle(
    mesh: DiskMesh,
    triangle: int | None,
    *,
    tolerance: float = 1e-5,
    max_iterations: int = 20,
    stop: Stop = "drop",
    inversion: bool = True,
    best: bool = False,
    delaunay: bool = False,
    repair: bool = True,
) -> Parameterization:
    """Map by CEM starting from the given triangle; None for the usual one."""
    L = laplacian(mesh, delaunay=delaunay)
    bordered = BorderedLaplacian(mesh, L, (mesh.boundary,), iterations=max_iterations)
    ring = Cholesky(bordered.L_bb)

    def ring_solution(f_i: Complex) -> Complex:
        return ring.solve(-(bordered.L_bi @ f_i))  # Eq. 23

    f_b, f_i, history, order_kept = iterate_boundary(
        on_circle(pole_start(mesh.V, mesh.F, bordered.solved_boundary, triangle)),
        bordered.dirichlet,
        ring_solution,
        bordered.conformal_energy,
        tolerance=tolerance,
        max_iterations=max_iterations,
        stop=stop,
        inversion=inversion,
        best=best,
    )
    iterations = int(np.argmin(history)) if best else len(history) - 1
    uv = bordered.completed(f_i, f_b)
    uv, folds = accepted_repair(mesh, uv, L, repair=repair)
    extras = {
        "order_kept": order_kept,
        "iterations_dropped": len(history) - 1 - iterations,
        **folds,
    }
    if stop == "drop" and len(history) == 2 and history[1] > history[0]:
        extras["alternative"] = {"stop": "change"}
    return Parameterization(uv, iterations, tuple(history[: iterations + 1]), extras)
