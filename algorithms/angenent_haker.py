"""The linear map with a pole, from which CEM starts, with its natural boundary."""

from __future__ import annotations

from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.boundary_iteration import pole_start
from cembench.conformal.free_boundary import is_strip, unrolled, with_area_pi
from cembench.conformal.laplacian import laplacian
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm


@algorithm(
    "angenent-haker",
    title="Angenent-Haker",
    target="free boundary",
    source="The CEM paper, Eqs. 11-15; Angenent, Haker et al. 1999; Haker et al. 2000",
    usual=False,
)
def angenent_haker(
    mesh: DiskMesh, *, delaunay: bool = False, repair: bool = True
) -> Parameterization:
    """Map a disk by the linear map with a pole in the middle, whose boundary is natural.

    Eqs. 11-14 and 18: L f = b with a dipole in the triangle nearest to the mean vertex and no
    boundary condition; the image of the boundary is therefore natural, and nearly a circle (Eq.
    12). CEM starts from this map, before it puts the boundary on the unit circle (16) and iterates.
    Comparing the two shows what these steps add.

    Decided here: f takes the surface to the outside of the curve, with folded triangles at the
    pole, and is far from conformal around it, so it is not useful as a map. As in CEM's own start,
    only the boundary is kept, mirrored so that it runs counter-clockwise, with its mean moved to 0
    (15), and the interior is one Dirichlet solve with the same factor. The image is scaled to area
    pi; folds inside are repaired as in LSCM (`fold_repairs`).
    """
    if is_strip(mesh):
        return unrolled(mesh)
    L = laplacian(mesh, delaunay=delaunay)
    bordered = BorderedLaplacian(mesh, L, (mesh.boundary,))
    f_b = pole_start(mesh.V, mesh.F, bordered.solved_boundary)
    f_b = f_b - f_b.mean()
    uv = bordered.in_order(bordered.dirichlet(f_b), f_b)
    uv, folds = with_area_pi(mesh, uv, repair=repair)
    return Parameterization(uv, extras=folds)
