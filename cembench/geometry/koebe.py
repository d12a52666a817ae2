"""Koebe's method for surfaces with holes (the paper's Algorithm 2; Zeng et al. 2009).

One step opens one boundary, fills all others, and maps that disk by CEM, so that the open boundary
becomes a circle. A sweep does so with every boundary, the outer one last. Here the cotangent
weights of the surface's own triangles are those of the surface in every step, for its conformal
structure does not change; only the patches come from the plane. So a map is not composed of maps,
each with its error, and errors of earlier steps are forgotten.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.clock import phase
from cembench.errors import AlgorithmFailed
from cembench.geometry.boundary_iteration import iterate_boundary, on_circle, pole
from cembench.geometry.condensed import Condensed, DenseCholesky, condensed
from cembench.geometry.folds import in_order, interior_without_folds
from cembench.geometry.harmonic import harmonic_extension
from cembench.geometry.laplacian import cotangent_laplacian, laplacian
from cembench.geometry.mesh import HoledMesh
from cembench.geometry.patches import disk_patch, fan_patch
from cembench.geometry.planar import backward_arcs, fitted_circle, polygon_area

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Loop = NDArray[np.int64]

#: Round disks glued in, or the paper's fans to the centroid.
Patches: TypeAlias = Literal["disks", "fans"]
#: Whose angles give the weights of the surface's triangles: its own, or those of the last image.
Weights: TypeAlias = Literal["surface", "plane"]


@dataclass(frozen=True)
class Step:
    """What one step of Koebe's method came to.

    Parameters
    ----------
    sweep : int
        Counted from 1.
    boundary : int
        Which boundary became a circle: 0 the outer one, then the holes, longest first.
    before : complex (n,) or None
        The image that the step set out from, inverted at the boundary's centroid so that this lies
        outside; None in the first step, which sets out from the surface in space.
    uv : complex (n,)
        The image after it, the boundary on the unit circle and all others inside.
    energies : tuple of float
        E_C of the filled surface, before and after each iteration of CEM.
    order_kept : int
        How often a step of CEM was changed so that the boundary kept its order.

    """

    sweep: int
    boundary: int
    before: Complex | None
    uv: Complex
    energies: tuple[float, ...]
    order_kept: int


def koebe_steps(
    mesh: HoledMesh,
    *,
    sweeps: int = 1,
    outer: int | None = None,
    patches: Patches = "disks",
    weights: Weights = "surface",
    tolerance: float = 1e-5,
    max_iterations: int = 20,
    inversion: bool = True,
) -> Iterator[Step]:
    """Which images does Koebe's method pass through? Each step as it is done.

    Parameters as in ``algorithms/koebe_cem.py``.

    Raises
    ------
    AlgorithmFailed
        There is nothing to map, or an image has collapsed.
    ParameterError
        `outer` names no boundary.

    """
    first, holes = mesh.outer_and_holes(outer)
    loops = (first, *holes)
    if not len(mesh.interior):
        raise AlgorithmFailed("the mesh has no interior vertex, so no harmonic map has any freedom")
    surface = condensed(mesh, laplacian(mesh), loops)
    uv: Complex | None = None
    kept: dict[int, Complex] = {}
    for sweep in range(1, sweeps + 1):
        for k in reversed(range(len(loops))):
            before = None if uv is None else _outside_in(uv, loops[k])
            points = mesh.V if before is None else np.stack([before.real, before.imag], axis=1)
            if weights == "plane" and before is not None:
                surface = condensed(mesh, _planar_laplacian(points, mesh.F), loops)
            with phase("patches"):
                glued = {j: _patch(points[loop], patches) for j, loop in enumerate(loops) if j != k}
            disk = _FilledSurface(surface, glued, k)
            start = kept[k] if k in kept else disk.start(*pole(points, mesh.F))
            kept[k], uv, energies, order_kept = disk.map(
                start, tolerance=tolerance, max_iterations=max_iterations, inversion=inversion
            )
            yield Step(sweep, k, before, uv, energies, order_kept)


def finished(
    mesh: HoledMesh, uv: Complex, *, outer: int | None = None, rounding: bool = True
) -> tuple[Complex, int]:
    """Which map comes of the last image, its holes made round and its folds mended?

    With `rounding`, each hole is put on the circle fitted to it, radially, as (25) puts the outer
    boundary on its circle (vertices that would change places take the nearest angles in order), and
    the interior is solved for again. The second value counts the repairs of folds.

    Raises
    ------
    AlgorithmFailed
        A hole is too far from a circle for that, or folds remain.

    """
    L = laplacian(mesh)
    if rounding:
        uv = uv.copy()
        for hole in mesh.outer_and_holes(outer)[1]:
            centre, radius = fitted_circle(uv[hole])
            uv[hole] = centre + radius * np.conj(_around(uv[hole], centre))
        boundary = np.concatenate(mesh.loops)
        uv = harmonic_extension(L, boundary, uv[boundary])
    return interior_without_folds(mesh, L, uv)


class _FilledSurface:
    """A surface with patches on all of its boundaries but number `k`: a disk."""

    def __init__(self, surface: Condensed, patches: dict[int, Real], k: int) -> None:
        self._surface = surface
        self._open = surface.parts[k]
        with phase("patches"):
            self._A = surface.S.copy()
            for j, P in patches.items():
                self._A[surface.parts[j], surface.parts[j]] += P
            closed = np.ones(len(self._A), dtype=bool)
            closed[self._open] = False
            self._closed = np.flatnonzero(closed)
        self._filled = DenseCholesky(self._A[np.ix_(self._closed, self._closed)])
        self._across = self._A[self._closed][:, self._open]
        self._ring = DenseCholesky(surface.L_bb[self._open][:, self._open].toarray())
        self._to_interior = surface.L_bi[self._open]
        self._to_closed = surface.L_bb[self._open][:, self._closed]

    def start(self, corners: Loop, values: Complex) -> Complex:
        """Boundary values of the map with a pole (Eqs. 13 to 18) on the filled surface."""
        surface = self._surface
        with phase("start"):
            n = len(surface.interior) + len(surface.boundary)
            rhs = np.zeros(n, dtype=np.complex128)
            rhs[corners] = values
            inside = surface.solve_interior(rhs[surface.interior])
            rhs_b = rhs[surface.boundary] - surface.L_bi @ inside
            # Pinned at one vertex of the open boundary (Theorem 1).
            g = np.zeros(len(rhs_b), dtype=np.complex128)
            free = np.delete(np.arange(len(g)), self._open.stop - 1)
            g[free] = DenseCholesky(self._A[np.ix_(free, free)]).solve(rhs_b[free])
        f_k = g[self._open]
        return np.conj(f_k) if polygon_area(f_k) < 0 else f_k

    def map(
        self, start: Complex, *, tolerance: float, max_iterations: int, inversion: bool
    ) -> tuple[Complex, Complex, tuple[float, ...], int]:
        """CEM (Algorithm 1) from these boundary values.

        Returns the open boundary's values, the map (n,), E_C of the filled surface before and after
        each iteration, and how often the order had to be kept.
        """
        surface, m = self._surface, len(self._closed)

        def dirichlet(f_k: Complex) -> Complex:
            f_c = -self._filled.solve(self._across @ f_k)
            f_b = self._joined(f_k, f_c)
            return np.concatenate([f_c, surface.extension(f_b)])

        def ring(f: Complex) -> Complex:
            return self._ring.solve(-(self._to_interior @ f[m:] + self._to_closed @ f[:m]))

        def energy(f: Complex, f_k: Complex) -> float:
            with phase("energy"):
                f_b = self._joined(f_k, f[:m])
                return 0.5 * float(np.vdot(f_b, self._A @ f_b).real) - polygon_area(f_k)

        f_k, f, history, order_kept = iterate_boundary(
            on_circle(start),
            dirichlet,
            ring,
            energy,
            tolerance=tolerance,
            max_iterations=max_iterations,
            inversion=inversion,
        )
        uv = surface.whole(self._joined(f_k, f[:m]), f[m:])
        return f_k, uv, tuple(history), order_kept

    def _joined(self, f_k: Complex, f_c: Complex) -> Complex:
        f_b = np.empty(len(self._A), dtype=np.complex128)
        f_b[self._open], f_b[self._closed] = f_k, f_c
        return f_b


def _outside_in(uv: Complex, loop: Loop) -> Complex:
    """The image inverted at the loop's centroid, so that the loop lies outside (Algorithm 2)."""
    if polygon_area(uv[loop]) > 0:
        return uv  # it is the outer one already
    away = uv - uv[loop].mean()
    if not np.abs(away).min() > 0:
        raise AlgorithmFailed(
            f"the boundary of vertex {int(loop.min())} came to have a vertex at its own centroid, "
            "where the image is to be inverted"
        )
    return 1 / away


def _patch(rim: Real, patches: Patches) -> Real:
    """What fills a loop that lies at these points (k, 2 or 3)?"""
    if patches == "disks" and rim.shape[1] == 2:
        z = rim[:, 0] + 1j * rim[:, 1]
        try:
            turned = _around(z, fitted_circle(z)[0])
            return disk_patch(np.unwrap(np.angle(turned)))
        except AlgorithmFailed:
            pass  # too far from round for a disk: its own polygon is nearer
    return fan_patch(rim)


def _around(z: Complex, centre: complex) -> Complex:
    """Directions from the centre of a hole, which runs clockwise, mirrored: counter-clockwise."""
    away: Complex = np.conj(z - centre)
    if not np.abs(away).min() > 0:
        raise AlgorithmFailed("a hole's image passes through the centre of its fitted circle")
    circle: Complex = away / np.abs(away)
    return in_order(circle) if backward_arcs(circle) else circle


def _planar_laplacian(points: Real, F: NDArray[np.int64]) -> sparse.csc_array:
    with np.errstate(divide="ignore", invalid="ignore"):
        L = cotangent_laplacian(points, F)
    if not np.isfinite(L.data).all():
        raise AlgorithmFailed(
            "a triangle has collapsed in the image, so the plane gives it no weights; take those "
            "of the surface (weights=surface)"
        )
    return L
