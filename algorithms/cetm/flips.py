"""Conformal equivalence with flips, to the disk: it converges on every surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.discrete_metric import angle_sums, angles, half_cotangents_of
from cembench.conformal.doubling import doubled
from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.gauge import Gauge, gauge_measure, moved_to_gauge
from cembench.conformal.laplacian import laplacian, laplacian_of_weights
from cembench.conformal.last_resort import with_last_resort
from cembench.core.arrays import Complex, Indices, Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.intrinsic import Triangulation
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

from .flat_metric import descended
from .triangle_map import K, disk_of_triangle

if TYPE_CHECKING:
    from .overlay import RefinedMap


#: The rows of a matrix are ordered anew after flips of more than this share of the triangles.
FEW = 0.0005
#: Edges whose opposite angles sum to pi less this, in radians, are looked at for flips.
NEARLY = 1e-6
#: Below this error of an angle sum, in radians, steps keep the factor until an edge is flipped.
KEPT = 1e-3


def _overlay(mesh: DiskMesh, **parameters: Any) -> RefinedMap:
    """Return the map on the common refinement of the mesh and the flipped triangulation."""
    from .overlay import refined_map  # which needs this module

    return refined_map(mesh, **parameters)


@algorithm(
    "cetm-flips",
    title="CETM, flips",
    target="disk",
    source="Gu, Luo, Sun & Wu 2018; Gillespie, Springborn & Crane 2021; Campen et al. 2021",
    usual=False,
    refinement=_overlay,
)
@with_last_resort
def cetm_flips(
    mesh: DiskMesh,
    *,
    tolerance: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 1e-9,
    max_iterations: Annotated[int, Field(ge=1, le=10_000)] = 200,
    gauge: Gauge = "boundary",
    repair: bool = True,
    last_resort: bool = True,
) -> Parameterization:
    """Map to the disk by scaling edges, with flips that keep the triangulation Delaunay.

    The surface is glued to its mirror copy, and the intrinsic Delaunay triangulation of the result
    is taken. Vertices are scaled by Newton's method on the convex energy of cetm. Whenever an edge
    stops being Delaunay it is flipped and takes its length from Ptolemy's rule, which preserves the
    hyperbolic metric that all discretely equivalent triangulations share. So no triangle ever
    breaks, and a flat metric with any angle sums below 2 pi at some vertices exists (discrete
    uniformisation).

    Decided here: three boundary vertices get the angle pi / 3 and all others are flat, so that the
    surface becomes an equilateral triangle, without unknowns and without a vertex at infinity;
    Dixon's elliptic function takes it to the disk in closed form. They divide the boundary into
    thirds by harmonic measure from the middle triangle. The map is discretely conformal to the
    triangle and smoothly conformal from there. `curvature` is the largest error of an angle sum
    (radians), `flips` counts flips, and `layout` is the largest relative difference between edges
    and their lengths after laying them out triangle by triangle. The map consists of the images of
    the vertices. The surface's own triangles, between straight edges, differ from the flipped ones:
    those that fold are counted (`folded_before_repair`) and repaired as in CEM (`fold_repairs`).
    `last_resort` makes the map valid in any case. ``parameterize(..., overlay=True)`` returns it on
    the common refinement of both triangulations instead.
    """
    b = mesh.boundary
    flat = uniformised(mesh, tolerance, max_iterations)
    with phase("layout"):
        uv = disk_of_triangle(flat.z)
    if not np.isfinite(uv).all():
        raise AlgorithmFailed("a vertex is mapped to the wrong side of the boundary")
    uv[b] /= np.abs(uv[b])
    uv /= np.maximum(np.abs(uv), 1.0)
    uv = moved_to_gauge(uv, gauge_measure(mesh, gauge, b))
    uv[b] /= np.abs(uv[b])
    uv, repaired = accepted_repair(mesh, uv, repair=repair)
    return Parameterization(uv, flat.iterations, extras=repaired | flat.told)


@dataclass(frozen=True)
class Uniformised:
    """A disk flattened to an equilateral triangle.

    Parameters
    ----------
    T : Triangulation
        The flipped triangulation of the surface and its mirror copy.
    u : float (size,)
        The scale of its vertices.
    P : complex (m', 3)
        Images of the corners of its triangles, which may lie in mirror images of the equilateral
        triangle of `disk_of_triangle`.
    z : complex (n,)
        Images of the surface's vertices.
    iterations : int
        Newton steps.
    told : dict
        Further results of cetm-flips.
    """

    T: Triangulation
    u: Real
    P: Complex
    z: Complex
    iterations: int
    told: dict[str, Any]


def uniformised(
    mesh: DiskMesh,
    tolerance: float,
    max_iterations: int,
    watch: Callable[[Triangulation], object] = lambda T: None,
) -> Uniformised:
    """Flatten a disk to an equilateral triangle.

    `watch` is called with the triangulation before all flips, and once it is Delaunay.

    Raises
    ------
    AlgorithmFailed
        Newton's method or the layout fails.
    """
    b = mesh.boundary
    cones = _cones(mesh, BorderedLaplacian(mesh, laplacian(mesh, delaunay=True), (b,)))
    double = doubled(mesh)
    with phase("flips"):
        T = Triangulation.doubled(mesh.F, mesh.V, double.mirror)
        watch(T)
        T.make_delaunay(np.zeros(double.size), flat=True)
        watch(T)
    u, residual, iterations = _flattened(T, double.half, cones, tolerance, max_iterations)
    with phase("layout"):
        P, z, off = _laid_out(T, u, cones, mesh.n)
    extras = {
        "curvature": residual,
        "flips": T.flips,
        "layout": off,
        "corners": cones.tolist(),
    }
    return Uniformised(T, u, P, z, iterations, extras)


def _cones(mesh: DiskMesh, bordered: BorderedLaplacian) -> Indices:
    """Return three boundary vertices in order, a third of the harmonic measure apart."""
    b = mesh.boundary
    seen = bordered.swept_to_boundary(gauge_measure(mesh, "triangle", b)[:, None])[:, 0]
    first = int(np.argmax(np.linalg.norm(mesh.V[b] - mesh.V.mean(axis=0), axis=1)))
    along = np.cumsum(np.roll(np.maximum(seen, 0), -first))
    at = np.searchsorted(along / along[-1], [0.0, 1 / 3, 2 / 3])
    if len(np.unique(at % len(b))) < 3:
        at = np.arange(3) * len(b) // 3
    return b[(first + at) % len(b)]


def _sides(T: Triangulation, u: Real) -> Real:
    """Return the lengths (m, 3) opposite to each corner, scaled to longest side 1 per triangle."""
    a, b, c = T.scaled(u).reshape(-1, 3).T
    longest = np.maximum(np.maximum(a, b), c)
    return np.exp(np.stack([b - longest, c - longest, a - longest], axis=1))


def _flattened(
    T: Triangulation, half: Indices, cones: Indices, tolerance: float, most: int
) -> tuple[Real, float, int]:
    """Return the scale u of the double after flipping along; the residual; the number of steps.

    `half` gives the surface's vertex of each vertex of the double. Copies have the same scale, so
    the unknowns are those of the surface alone, and equations of copies are added.
    """
    n = int(half.max()) + 1
    copies = np.bincount(half)
    flat = np.full(n, 2 * np.pi)
    flat[cones] = 2 * np.pi / 3
    flat *= copies
    u = np.zeros(n)
    free = np.arange(n) != cones[0]

    def missing(u: Real) -> tuple[Real, Real, NDArray[np.bool_]]:
        v, before = u[half], T.flips
        with phase("angles"):
            corners, broken = angles(_sides(T, v))
        with phase("flips"):
            opposite = np.roll(corners, -2, axis=1).ravel()
            T.make_delaunay(v, np.flatnonzero(opposite + opposite[T.twin] > np.pi - NEARLY))
        with phase("angles"):
            if T.flips > before:
                corners, broken = angles(_sides(T, v))
            return flat - angle_sums(half[T.F], corners, n), corners, broken

    gradient, corners, broken = missing(u)
    best = float(np.abs(gradient / copies).max())
    factor: Cholesky | None = None
    ordered = flips = 0
    for iteration in range(most):
        if best <= tolerance:
            return u[half], best, iteration
        if factor is None or best > KEPT or T.flips > flips:
            with phase("assembly"):
                H = laplacian_of_weights(half[T.F], half_cotangents_of(corners, broken), n)
                H = H[free][:, free]
            few = T.flips - ordered <= FEW * len(T.F)
            factor = Cholesky(H, like=factor if few else None)
            ordered = ordered if few and factor is not None else T.flips
            flips = T.flips
        step = np.zeros(n)
        step[free] = -factor.solve(gradient[free])
        slope = float(gradient @ step)
        u, gradient, corners, broken = descended(missing, u, step, step, slope)
        best = float(np.abs(gradient / copies).max())
    raise AlgorithmFailed(
        f"the angle sums are still off by up to {best:.2g} rad after {most} Newton steps, "
        f"tolerance {tolerance:g}. Allow more with max_iterations"
    )


def _laid_out(T: Triangulation, u: Real, cones: Indices, n: int) -> tuple[Complex, Complex, float]:
    """Return the positions of corners (m, 3) and the surface's vertices (n,).

    They are those in the triangle of `disk_of_triangle`.

    Triangles are unfolded in turn, starting from the largest. A vertex beyond an edge of the
    equilateral triangle lies in a mirror image of it, whose corners belong to a lattice.
    """
    log_length = T.scaled(u)
    sides = np.exp(log_length - log_length.max()).reshape(-1, 3)
    corner, _ = angles(_sides(T, u))
    P = np.full(T.F.shape, np.nan + 0j)
    root = int(np.argmax(sides.min(axis=1)))
    P[root] = [0, sides[root, 0], sides[root, 2] * np.exp(1j * corner[root, 0])]
    reached = np.zeros(len(T.F), dtype=bool)
    reached[root] = True
    reached_from = np.empty(len(T.F), dtype=np.int64)
    front = np.array([root])
    while len(front):
        h = (3 * front[:, None] + np.arange(3)).ravel()
        g = T.twin[h]
        new = ~reached[g // 3]
        h, g = h[new], g[new]
        reached_from[g // 3] = np.arange(len(g))
        first = reached_from[g // 3] == np.arange(len(g))
        h, g = h[first], g[first]
        front, t, c, d = g // 3, h // 3, h % 3, g % 3
        p, q = P[t, c], P[t, (c + 1) % 3]
        direction = (p - q) / np.maximum(np.abs(p - q), np.finfo(float).tiny)
        P[front, d], P[front, (d + 1) % 3] = q, p
        far = sides[front, (d + 2) % 3] * np.exp(1j * corner[front, d])
        P[front, (d + 2) % 3] = q + direction * far
        reached[front] = True
    off = np.abs(np.abs(np.roll(P, -1, axis=1) - P) / sides - 1)
    to_disk = _to_corners(T, P, cones)
    P = to_disk[0] * (P - to_disk[1])
    z = np.empty(u.shape, dtype=np.complex128)
    z[T.F.ravel()] = P.ravel()
    return P, z[:n], float(off[np.isfinite(off)].max())


def _to_corners(T: Triangulation, P: Complex, cones: Indices) -> tuple[complex, complex]:
    """Return factor and centre that take an image of the equilateral triangle to the standard one.

    Two corners that are a side apart determine it: the surface lies on the left of the way from one
    to the next.
    """
    images = [np.unique(np.round(P[np.int64(v) == T.F], 13)) for v in cones]
    area = np.abs(np.imag(np.conj(P[:, 1] - P[:, 0]) * (P[:, 2] - P[:, 0]))).sum() / 4
    side = np.sqrt(area * 4 / np.sqrt(3))
    candidates: list[tuple[float, int, complex, complex]] = []
    for k in range(3):
        one, other = images[k], images[(k + 1) % 3]
        off = np.abs(np.abs(other - one[:, None]) / side - 1)
        i, j = np.unravel_index(int(np.argmin(off)), off.shape)
        candidates.append((float(off[i, j]), k, complex(one[i]), complex(other[j])))
    off, k, near, far = min(candidates, key=lambda one: one[0])
    if not off < 1e-3:
        raise AlgorithmFailed(
            f"the flat layout is not an equilateral triangle (off by {off:.2g}): double "
            "precision cannot resolve its positions"
        )
    third = near + (far - near) * np.exp(1j * np.pi / 3)
    centre = (near + far + third) / 3
    return K / ((near, third, far)[k] - centre), centre
