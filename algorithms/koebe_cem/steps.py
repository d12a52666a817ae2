"""Koebe's method for surfaces with holes (the paper's Algorithm 2; Zeng et al. 2009).

One step opens one boundary, fills all others, and maps that disk by CEM, so that the open boundary
becomes a circle. A sweep repeats this for every boundary, the outer one last. The surface's own
triangles keep the cotangent weights of the surface in every step, because its conformal structure
does not change; only the patches get weights from the plane. So the map is not a composition of
inexact maps, and the errors of earlier steps do not accumulate.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.boundary_iteration import iterate_boundary, on_circle, pole
from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.folds import in_order
from cembench.conformal.laplacian import cotangent_laplacian, laplacian
from cembench.conformal.patches import disk_patch, fan_patch
from cembench.conformal.planar import backward_arcs, fitted_circle, polygon_area
from cembench.core.arrays import Complex, Loop, Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed, NotPositiveDefinite
from cembench.core.parameterization import MapStep
from cembench.linear_algebra.dense_cholesky import DenseCholesky
from cembench.mesh.triangle_mesh import HoledMesh

#: How holes are filled: by round disks, or by the paper's fans to the centroid.
Patches: TypeAlias = Literal["disks", "fans"]
#: Source of the triangles' weights: the surface's own angles, or those of the last image.
Weights: TypeAlias = Literal["surface", "plane"]


@dataclass(frozen=True)
class KoebeStep:
    """The result of one step of Koebe's method.

    Parameters
    ----------
    sweep : int
        Number of the sweep, from 1.
    boundary : int
        The boundary that became a circle: 0 is the outer one, then the holes, longest first.
    before : complex (n,) or None
        The image before the step, inverted at the boundary's centroid so that the boundary is
        outside; None in the first step, which starts from the surface in space.
    uv : complex (n,)
        The image after the step, with the boundary on the unit circle and all others inside.
    energies : tuple of float
        E_C of the filled surface, before and after each iteration of CEM.
    order_kept : int
        Number of CEM steps that were changed to keep the boundary's order.
    surface : BorderedLaplacian
        The surface with its own weights, factored.
    """

    sweep: int
    boundary: int
    before: Complex | None
    uv: Complex
    energies: tuple[float, ...]
    order_kept: int
    surface: BorderedLaplacian


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
) -> Iterator[KoebeStep]:
    """Yield the steps of Koebe's method, each as soon as it is done.

    Parameters as in ``koebe_cem.py``.

    Raises
    ------
    AlgorithmFailed
        There is nothing to map, or an image has collapsed.
    ParameterError
        `outer` names no boundary.
    """
    first, holes = mesh.outer_and_holes(outer)
    loops = (first, *holes)
    own = surface = BorderedLaplacian(mesh, laplacian(mesh), loops)
    uv: Complex | None = None
    kept: dict[int, Complex] = {}
    for sweep in range(1, sweeps + 1):
        for k in reversed(range(len(loops))):
            before = None if uv is None else _outside_in(uv, loops[k])
            points = mesh.V if before is None else np.stack([before.real, before.imag], axis=1)
            if weights == "plane" and before is not None:
                surface = BorderedLaplacian(mesh, _planar_laplacian(points, mesh.F), loops)
            closed = {j: points[loop] for j, loop in enumerate(loops) if j != k}
            try:
                disk = _FilledSurface(surface, closed, k, patches)
            except NotPositiveDefinite:  # rims put in order crowd: fill their own polygons
                disk = _FilledSurface(surface, closed, k, "fans")
            starts = [kept[k] if k in kept else disk.start(*pole(points, mesh.F))]
            if before is not None:
                starts += _projected(before[loops[k]])
            start = min(map(on_circle, starts), key=disk.energy)
            kept[k], uv, energies, order_kept = disk.map(
                start, tolerance=tolerance, max_iterations=max_iterations, inversion=inversion
            )
            yield KoebeStep(sweep, k, before, uv, energies, order_kept, own)


def shown_steps(mesh: HoledMesh, *, sweeps: int = 1, outer: int | None = None) -> Iterator[MapStep]:
    """Yield the steps of Koebe's method, with the final map of each sweep."""
    for step in koebe_steps(mesh, sweeps=sweeps, outer=outer):
        result = None if step.boundary else finished(mesh, step, outer=outer)[0]
        yield MapStep(step.sweep, step.boundary, step.before, step.uv, step.energies, result)


def finished(
    mesh: HoledMesh,
    step: KoebeStep,
    *,
    outer: int | None = None,
    rounding: bool = True,
    repair: bool = True,
) -> tuple[Complex, dict[str, Any]]:
    """Return the final map of a step, its holes made round and its folds repaired.

    With `rounding`, each hole is put radially on the circle fitted to it, as (25) does with the
    outer boundary (vertices that would change places get the nearest angles in order), and the
    interior is solved for again. The second value is that of
    :func:`cembench.conformal.fold_repair.accepted_repair`.

    Raises
    ------
    AlgorithmFailed
        A hole is too far from a circle.
    """
    uv = step.uv
    if rounding:
        uv = uv.copy()
        for hole in mesh.outer_and_holes(outer)[1]:
            centre, radius = fitted_circle(uv[hole])
            uv[hole] = centre + radius * np.conj(_around(uv[hole], centre))
        f_b = uv[step.surface.boundary]
        uv = step.surface.in_order(step.surface.dirichlet(f_b), f_b)
    return accepted_repair(mesh, uv, repair=repair)


class _FilledSurface:
    """A surface with patches on all of its boundaries, `rims`, except number `k`: a disk.

    The closed boundaries c are eliminated too, so that an iteration of CEM needs only the open
    boundary o and the interior: f_c = -W f_o, and half of f_o^* S f_o is the Dirichlet energy.
    """

    def __init__(
        self, surface: BorderedLaplacian, rims: dict[int, Real], k: int, patches: Patches
    ) -> None:
        self._surface = surface
        o = self._open = surface.parts[k]
        with phase("patches"):
            A = surface.S.copy()
            for j, rim in rims.items():
                A[surface.parts[j], surface.parts[j]] += _patch(rim, patches)
            closed = np.ones(len(A), dtype=bool)
            closed[o] = False
            c = self._closed = np.flatnonzero(closed)
        filled = DenseCholesky(A[np.ix_(c, c)])
        self._W = filled.solve(A[c][:, o])
        with phase("condensation"):
            self._S = A[o, o] - A[o][:, c] @ self._W
        self._ring = DenseCholesky(surface.L_bb[o][:, o].toarray())
        self._to_interior = surface.L_bi[o]
        self._to_closed = surface.L_bb[o][:, c]

    def start(self, corners: Loop, values: Complex) -> Complex:
        """Return the boundary values of the filled surface's map with a pole (Eqs. 13 to 18)."""
        surface = self._surface
        with phase("start"):
            n = len(surface.interior) + len(surface.boundary)
            rhs = np.zeros(n, dtype=np.complex128)
            rhs[corners] = values
            inside = surface.solve_interior(rhs[surface.interior])
            rhs_b = rhs[surface.boundary] - surface.L_bi @ inside
            rhs_o = rhs_b[self._open] - _product(self._W.T, rhs_b[self._closed])
        # The last vertex is pinned (Theorem 1).
        f_o = np.append(DenseCholesky(self._S[:-1, :-1]).solve(rhs_o[:-1]), 0.0)
        return np.conj(f_o) if polygon_area(f_o) < 0 else f_o

    def energy(self, f_o: Complex) -> float:
        """Return E_C (Eq. 7) of the filled surface's harmonic map with these boundary values."""
        with phase("energy"):
            return 0.5 * float(np.vdot(f_o, _product(self._S, f_o)).real) - polygon_area(f_o)

    def map(
        self, start: Complex, *, tolerance: float, max_iterations: int, inversion: bool
    ) -> tuple[Complex, Complex, tuple[float, ...], int]:
        """Run CEM (Algorithm 1) from these boundary values on the unit circle.

        Returns the open boundary's values, the map (n,), E_C of the filled surface before and after
        each iteration, and how often the order had to be kept.
        """
        surface, m = self._surface, len(self._closed)

        def on_boundaries(f_o: Complex) -> Complex:
            f_b = np.empty(len(surface.boundary), dtype=np.complex128)
            f_b[self._open], f_b[self._closed] = f_o, -_product(self._W, f_o)
            return f_b

        def dirichlet(f_o: Complex) -> Complex:
            f_b = on_boundaries(f_o)
            return np.concatenate([f_b[self._closed], surface.dirichlet(f_b)])

        def ring(f: Complex) -> Complex:
            return self._ring.solve(-(self._to_interior @ f[m:] + self._to_closed @ f[:m]))

        f_o, f, history, order_kept = iterate_boundary(
            start,
            dirichlet,
            ring,
            lambda _, f_o: self.energy(f_o),
            tolerance=tolerance,
            max_iterations=max_iterations,
            stop="change",
            inversion=inversion,
        )
        uv = surface.in_order(f[m:], on_boundaries(f_o))
        return f_o, uv, tuple(history), order_kept


def _product(M: Real, f: Complex) -> Complex:
    """Return M f without a complex copy of M."""
    return M @ f.real + 1j * (M @ f.imag)


def _projected(z: Complex) -> list[Complex]:
    """Put an outer boundary's image radially on its fitted circle, if its order is kept."""
    away: Complex = z - fitted_circle(z)[0]
    if not np.abs(away).min() > 0 or backward_arcs(away):
        return []
    return [away / np.abs(away)]


def _outside_in(uv: Complex, loop: Loop) -> Complex:
    """Invert the image at the loop's centroid, so that the loop is outside (Algorithm 2)."""
    if polygon_area(uv[loop]) > 0:
        return uv  # it is already the outer one
    away = uv - uv[loop].mean()
    if not np.abs(away).min() > 0:
        raise AlgorithmFailed(
            f"the boundary of vertex {int(loop.min())} has a vertex at its own centroid, the "
            "centre of the inversion"
        )
    return 1 / away


def _patch(rim: Real, patches: Patches) -> Real:
    """Return the patch that fills a loop at these points (k, 2 or 3)."""
    if patches == "disks" and rim.shape[1] == 2:
        z = rim[:, 0] + 1j * rim[:, 1]
        try:
            turned = _around(z, fitted_circle(z)[0])
            return disk_patch(np.unwrap(np.angle(turned)))
        except AlgorithmFailed:
            pass  # too far from round for a disk: use its own polygon
    return fan_patch(rim)


def _around(z: Complex, centre: complex) -> Complex:
    """Return directions from a hole's centre, mirrored to run counter-clockwise."""
    away: Complex = np.conj(z - centre)
    if not np.abs(away).min() > 0:
        raise AlgorithmFailed("a hole's image passes through the centre of its fitted circle")
    circle: Complex = away / np.abs(away)
    return in_order(circle) if backward_arcs(circle) else circle


def _planar_laplacian(points: Real, F: NDArray[np.int64]) -> scipy.sparse.csc_array:
    """Return the cotangent Laplacian of an image."""
    with np.errstate(divide="ignore", invalid="ignore"):
        L = cotangent_laplacian(points, F)
    if not np.isfinite(L.data).all():
        raise AlgorithmFailed(
            "a triangle has collapsed in the image, so it has no weights in the plane; use those "
            "of the surface (weights=surface)"
        )
    return L
