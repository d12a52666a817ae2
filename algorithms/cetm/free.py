"""Conformal equivalence of triangle meshes with a free boundary."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from cembench.conformal.boundary_curve import closed_curve
from cembench.conformal.discrete_metric import angle_sums, length_cross_ratios
from cembench.conformal.free_boundary import is_strip, unrolled, with_area_pi
from cembench.conformal.harmonic import edge_lengths
from cembench.core.parameterization import Parameterization
from cembench.mesh.side_lengths import side_lengths
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

from .flat_metric import flat_metric


@algorithm(
    "cetm-free",
    title="CETM, free",
    target="free boundary",
    source="Springborn, Schroeder & Pinkall, Conformal equivalence of triangle meshes, 2008",
    usual=False,
)
def cetm_free(
    mesh: DiskMesh,
    *,
    tolerance: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 1e-10,
    max_iterations: Annotated[int, Field(ge=0, le=10_000)] = 50,
    repair: bool = True,
) -> Parameterization:
    """Flatten by scaling edges at their vertices, with the boundary keeping its lengths.

    Lengths l~_ij = l_ij exp((u_i + u_j) / 2) with u = 0 on the boundary, such that the angles
    around every interior vertex sum to 2 pi: the minimum of a convex energy, by Newton's method
    with one analysed pattern (`factorisations`). The length cross ratios of the map are those of
    the surface (`cross_ratios` is the largest change of their logarithms).

    Decided here: a step is halved while the energy rises steeply at its end. The iteration ends
    when all angle sums are within `tolerance` (`curvature`, radians), and fails if triangles break
    the triangle inequality, since no edge is flipped. The boundary is laid out from its lengths and
    angles (`closing` is the largest relative change of a length that closes it), the interior by
    one solve in the flat metric, and the image is scaled to area pi. Folds inside are repaired as
    in LSCM (`fold_repairs`), after which cross ratios are no longer kept.
    """
    if is_strip(mesh):
        return unrolled(mesh)
    b = mesh.boundary
    lengths = side_lengths(mesh.V, mesh.F)
    flat = np.full(mesh.n, 2 * np.pi)
    flattened = flat_metric(
        mesh.F,
        lengths,
        np.zeros(mesh.n),
        b,
        flat,
        tolerance=tolerance,
        max_iterations=max_iterations,
    )
    turns = np.pi - angle_sums(mesh.F, flattened.angles, mesh.n)[b]
    z = np.zeros(mesh.n, dtype=np.complex128)
    z[b], closing = closed_curve(edge_lengths(mesh, b), turns)
    fixed = np.zeros(mesh.n, dtype=bool)
    fixed[b] = True
    uv = flattened.laid_out(mesh.F, fixed, z)
    uv, folds = with_area_pi(mesh, uv, repair=repair)
    kept = {"closing": closing, "cross_ratios": cross_ratio_change(mesh, uv)}
    extras = flattened.told | kept | folds
    return Parameterization(uv, len(flattened.history) - 1, extras=extras)


def cross_ratio_change(mesh: DiskMesh, uv: NDArray[np.complex128]) -> float:
    """Return the largest change of the logarithm of a length cross ratio."""
    plane = np.stack([uv.real, uv.imag], axis=1)
    before, after = (length_cross_ratios(mesh.F, side_lengths(V, mesh.F)) for V in (mesh.V, plane))
    return float(np.abs(after - before).max(initial=0.0))
