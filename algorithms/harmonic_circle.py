"""Harmonic map with the boundary on the circle, spaced by arc length."""

from __future__ import annotations

from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian
from cembench.conformal.last_resort import with_last_resort
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm


@algorithm(
    "harmonic-circle",
    title="Harmonic",
    target="disk",
    source="Eq. (10) with a prescribed boundary; Floater & Hormann 2005, Sec. 3",
    conformal=False,
)
@with_last_resort
def harmonic_circle(
    mesh: DiskMesh, *, delaunay: bool = False, repair: bool = True, last_resort: bool = False
) -> Parameterization:
    """Map a disk by one Dirichlet solve, with the boundary spaced by arc length.

    The cheapest map to the disk, and the baseline for all others: nothing adapts the boundary, so
    it is conformal only where the arc lengths happen to be right. `delaunay` takes the weights of
    the intrinsic Delaunay triangulation. Decided here: if cotangent weights are negative and the
    map folds, patches around the folds are laid out again (`fold_repairs`).
    """
    L = laplacian(mesh, delaunay=delaunay)
    z = harmonic_extension(L, mesh.boundary, arc_length_circle(mesh))
    z, folds = accepted_repair(mesh, z, L, repair=repair)
    return Parameterization(z, extras=folds)
