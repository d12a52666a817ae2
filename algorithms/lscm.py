"""Least squares conformal map: minimal conformal energy with a free boundary."""

from __future__ import annotations

from cembench.conformal.free_boundary import pinned_map, two_distant_vertices, with_area_pi
from cembench.conformal.laplacian import laplacian
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh
from cembench.registry import algorithm


@algorithm(
    "lscm",
    title="LSCM",
    target="free boundary",
    source="Levy, Petitjean, Ray & Maillot 2002; Desbrun, Meyer & Alliez 2002",
)
def lscm(mesh: DiskMesh, *, delaunay: bool = False, repair: bool = True) -> Parameterization:
    """Map a disk with a free boundary and least conformal energy, with two vertices pinned.

    E_C = E_D - A (Eq. 7) is a quadratic form in (u, v); pinning two vertices makes it positive
    definite, and one Cholesky solve minimises it. Decided here: the pins are the boundary vertex
    farthest from the mean vertex and the boundary vertex farthest from that one, at -1 and 1; the
    image is then scaled to area pi, so that its energies can be compared with those of a disk,
    although its angle errors are lower for lack of a boundary condition. If negative cotangent
    weights fold the interior, patches around the folds are laid out again (`fold_repairs`); if that
    does not help, as with a boundary that crosses itself, folds remain.
    """
    return least_energy(mesh, delaunay=delaunay, repair=repair)


def least_energy(
    mesh: DiskMesh | HoledMesh, *, delaunay: bool = False, repair: bool = True
) -> Parameterization:
    """Return the map of :func:`lscm`, with the boundaries of holes free too."""
    pins = two_distant_vertices(mesh)
    uv = pinned_map(laplacian(mesh, delaunay=delaunay), mesh.loops, pins)
    uv, folds = with_area_pi(mesh, uv, repair=repair)
    return Parameterization(uv, extras={"pins": pins.tolist(), **folds})
