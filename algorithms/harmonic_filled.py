"""The harmonic map of a surface with holes, which are filled temporarily."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian
from cembench.conformal.metrics import flipped_triangles
from cembench.conformal.patches import filled
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import HoledMesh
from cembench.registry import algorithm


@algorithm(
    "harmonic-filled",
    title="Harmonic, filled",
    target="disk with holes",
    source="Eq. (10) on the filled surface; Floater & Hormann 2005, Sec. 3",
)
def harmonic_filled(
    mesh: HoledMesh,
    *,
    outer: Annotated[int, Field(ge=0, lt=2**63)] | None = None,
    repair: bool = True,
) -> Parameterization:
    """Map a surface with holes by one Dirichlet solve, with its holes filled temporarily.

    The simple alternative to Koebe's method, and the baseline for it: every hole gets a fan to its
    centroid, and the outer boundary (that of the vertex `outer`, or the widest) keeps its arc
    length on the unit circle. Nothing makes the holes round, so the target is a disk with holes of
    any shape; the record's circularity measures how far from circles they are. Folds are repaired
    on the filled surface (`fold_repairs`).
    """
    _, holes = mesh.outer_and_holes(outer)
    disk = filled(mesh, holes)
    L = laplacian(disk)
    own = harmonic_extension(L, disk.boundary, arc_length_circle(disk))
    z, folds = accepted_repair(disk, own, L, repair=repair)
    if folds["folded_before_repair"]:  # some may be of the patches
        folds["folded_before_repair"] = flipped_triangles(mesh, own)
    return Parameterization(z[: mesh.n].copy(), extras=folds)
