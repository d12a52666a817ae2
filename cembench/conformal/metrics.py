"""How good is a map? Figures computed from the mesh and the map alone, never by the algorithm.

Angles are in degrees. Energies and areas are in the units of the map squared: for a unit disk they
are comparable between surfaces, for a free boundary only after scaling the image.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.beltrami import beltrami_coefficients, dilatations_of
from cembench.conformal.laplacian import corner_products, half_cotangents
from cembench.conformal.planar import fitted_circle, polygon_area, signed_areas
from cembench.mesh.triangle_mesh import TriangleMesh

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: How many triangles stand for all in :class:`SampledAngleError`.
SAMPLE = 4_000


def dirichlet_energy(mesh: TriangleMesh, uv: Complex) -> float:
    """E_D (Eq. 5): half the sum over edges of cotangent weight times squared image length."""
    F = mesh.F
    weights = half_cotangents(mesh.V, F)
    squared = np.stack(
        [np.abs(uv[F[:, (c + 1) % 3]] - uv[F[:, (c + 2) % 3]]) ** 2 for c in range(3)]
    )
    return 0.5 * float((weights.T * squared).sum())


def image_area(mesh: TriangleMesh, uv: Complex) -> float:
    """A (Eq. 8): what the boundary polygons enclose, holes subtracted; not pi for a disk."""
    return sum(polygon_area(uv[loop]) for loop in mesh.loops)


def corner_angles(points: Real | Complex, F: NDArray[np.int64]) -> Real:
    """What are the triangles' angles? Degrees, shape (m, 3), unsigned.

    `points` is (n, 3) in space or complex (n,) in the plane. A triangle whose image is a point
    has angles of zero.
    """
    planar = np.iscomplexobj(points)
    V = np.stack([points.real, points.imag], axis=1) if planar else np.asarray(points, np.float64)
    dots, double_area = corner_products(V, F)
    return np.rad2deg(np.arctan2(double_area[:, None], dots))


def angle_errors(mesh: TriangleMesh, uv: Complex) -> Real:
    """By how many degrees does each corner's angle change (Table 4)? Absolute, shape (m, 3)."""
    return np.abs(corner_angles(mesh.V, mesh.F) - corner_angles(uv, mesh.F))


class SampledAngleError:
    """By how many degrees does a map change a corner's angle in the mean, over every k-th triangle?

    Of a large mesh these are 4,000 triangles or a few more: enough to compare two maps of it.
    """

    def __init__(self, mesh: TriangleMesh) -> None:
        self._V, self._F = mesh.V, mesh.F[:: max(1, mesh.m // SAMPLE)]

    @cached_property
    def _in_space(self) -> Real:
        return corner_angles(self._V, self._F)

    def __call__(self, uv: Complex) -> float:
        """Degrees, for a map (n,)."""
        return float(np.abs(self._in_space - corner_angles(uv, self._F)).mean())


def flipped_triangles(mesh: TriangleMesh, uv: Complex) -> int:
    """How many triangles are folded over or collapsed: image area not positive?"""
    return int(np.count_nonzero(~(signed_areas(uv, mesh.F) > 0)))


def dilatations(mesh: TriangleMesh, uv: Complex) -> Real:
    """How far from a similarity is each triangle: largest over smallest stretch, 1 when conformal?

    Shape (m,); infinite for a triangle that collapsed to a segment or a point.
    """
    return dilatations_of(beltrami_coefficients(uv, mesh.F, mesh.V))


@dataclass(frozen=True)
class BoundaryCircle:
    """The circle that lies closest to a boundary's image.

    Parameters
    ----------
    vertex : int
        The smallest vertex of the boundary loop, by which it is known.
    vertices : int
        How many vertices the loop has.
    centre : complex
        The circle's centre.
    radius : float
        Its radius; NaN where the image determines no circle.
    circularity : float
        The largest ``| |z - c| - r | / r`` over the loop; infinite where there is no circle.

    """

    vertex: int
    vertices: int
    centre: complex
    radius: float
    circularity: float


def boundary_circles(mesh: TriangleMesh, uv: Complex) -> tuple[BoundaryCircle, ...]:
    """Which circles are the boundary images nearly, and how nearly? That of largest area first."""
    loops = sorted(mesh.loops, key=lambda loop: polygon_area(uv[loop]), reverse=True)
    return tuple(circle_of(loop, uv[loop]) for loop in [*loops[:1], *sorted(loops[1:], key=min)])


def circle_of(loop: NDArray[np.int64], z: Complex) -> BoundaryCircle:
    """Which circle is the image z (k,) of a boundary loop (k,) nearly?"""
    centre, radius = fitted_circle(z)
    with np.errstate(divide="ignore", invalid="ignore"):
        off = float(np.max(np.abs(np.abs(z - centre) - radius) / np.float64(radius)))
    circularity = off if np.isfinite(off) else float("inf")
    return BoundaryCircle(int(loop.min()), len(loop), centre, radius, circularity)


def boundary_circularity(mesh: TriangleMesh, uv: Complex) -> float:
    """How far from circles are the boundary images: the largest ``| |z - c| - r | / r``?

    Centre and radius are fitted to each loop; infinite where a loop determines no circle.
    """
    return max((circle.circularity for circle in boundary_circles(mesh, uv)), default=0.0)


def all_metrics(mesh: TriangleMesh, uv: Complex) -> dict[str, float | int]:
    """Every figure that a record holds, under the record's keys."""
    energy, area = dirichlet_energy(mesh, uv), image_area(mesh, uv)
    errors = angle_errors(mesh, uv)
    stretch = dilatations(mesh, uv)
    return {
        "dirichlet_energy": energy,
        "image_area": area,
        "conformal_energy": energy - area,
        "angle_error_mean_deg": float(errors.mean()),
        "angle_error_sd_deg": float(errors.std()),
        "flipped_triangles": flipped_triangles(mesh, uv),
        "dilatation_mean": float(stretch.mean()),
        "dilatation_max": float(stretch.max()),
        "boundary_circularity": boundary_circularity(mesh, uv),
    }
