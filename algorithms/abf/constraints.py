"""The constraints on the angles of a flat triangulation, and vertices from angles."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.conformal.free_boundary import pinned_map, two_distant_vertices, with_area_pi
from cembench.conformal.laplacian import laplacian_of_weights
from cembench.conformal.metrics import corner_angles
from cembench.core.arrays import Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed, NotPositiveDefinite
from cembench.core.parameterization import Parameterization
from cembench.linear_algebra.cholesky import Cholesky, factor_like
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh


class Angles:
    """The constraints on the angles of a mesh, and the pattern of the linear systems.

    Angles are (m, 3) in radians, as the corners of `mesh.F`. After eliminating the triangles the
    unknowns are, for every interior vertex, one multiplier of its angle sum and one of its wheel.
    """

    def __init__(self, mesh: DiskMesh | HoledMesh) -> None:
        if not len(mesh.interior):
            raise AlgorithmFailed(
                "the mesh has no interior vertex, so its angles have no constraints"
            )
        self.mesh = mesh
        self.number = np.full(mesh.n, -1)
        self.number[mesh.interior] = np.arange(len(mesh.interior))
        self.k = len(mesh.interior)
        self._cholesky: Cholesky | None = None
        with phase("assembly"):
            # The six rows of each triangle: the sums at its corners, then the wheels.
            self._rows = np.concatenate([self.number[mesh.F], self.number[mesh.F]], axis=1)
            self._rows[:, 3:] += np.where(self._rows[:, 3:] >= 0, self.k, 0)
            self._A, self._place, self._inside = _pattern(self.number[mesh.F], self.k)

    @property
    def wanted(self) -> Real:
        """The surface's own angles, scaled to sum to 2 pi around every interior vertex."""
        F = self.mesh.F
        own = np.deg2rad(corner_angles(self.mesh.V, F))
        share = np.ones(self.mesh.n)
        inside = self.mesh.interior
        share[inside] = 2 * np.pi / np.bincount(F.ravel(), own.ravel(), self.mesh.n)[inside]
        return np.asarray(own * share[F])

    def at_vertices(self, values: Real) -> Real:
        """Return the sums of corner values (m, 3) at the interior vertices, (k,)."""
        total = np.bincount(self.mesh.F.ravel(), values.ravel(), self.mesh.n)
        return np.asarray(total[self.mesh.interior], dtype=np.float64)

    def residuals(self, angles: Real) -> tuple[Real, Real, Real]:
        """Return the residuals of triangles, pi (m,), of vertices, 2 pi (k,), of wheels, 0 (k,)."""
        log_sine = np.log(np.sin(angles))
        # Seen from a corner, the sine of the next corner over that of the one before.
        wheel = np.roll(log_sine, -1, axis=1) - np.roll(log_sine, 1, axis=1)
        return (
            np.pi - angles.sum(axis=1),
            2 * np.pi - self.at_vertices(angles),
            -self.at_vertices(wheel),
        )

    def told(self, angles: Real) -> dict[str, float]:
        """Return the largest residual of each kind, as extras."""
        names = ("triangle_residual", "vertex_residual", "wheel_residual")
        residuals = zip(names, self.residuals(angles), strict=True)
        return {name: float(np.abs(r).max()) for name, r in residuals}

    def step(self, angles: Real, D: Real, gradient: Real) -> tuple[Real, Real]:
        """Return one Newton step on the constraints, linearised at `angles`.

        Minimise e^T D^-1 e / 2 + gradient e over all e that satisfy the constraints to first order:
        e = D (C^T y - gradient). The multipliers of triangles are eliminated first, since each
        triangle has three corners of its own; what remains is one symmetric positive definite
        system.

        Returns
        -------
        e : float (m, 3)
            The change of the angles.
        y_w : float (k,)
            Multipliers of the wheels.

        Raises
        ------
        AlgorithmFailed
            The constraints are dependent up to rounding.
        """
        triangle, vertex, wheel = self.residuals(angles)
        with phase("assembly"):
            cot = 1 / np.tan(angles)
            # Derivatives of the six rows of a triangle by its three angles, (m, 6, 3).
            J = np.zeros((len(angles), 6, 3))
            for c in range(3):
                J[:, c, c] = 1.0
                J[:, 3 + c, (c + 1) % 3] = cot[:, (c + 1) % 3]
                J[:, 3 + c, (c + 2) % 3] = -cot[:, (c + 2) % 3]
            JD = J * D[:, None, :]
            to_triangle = JD.sum(axis=2)
            total = D.sum(axis=1)
            blocks = JD @ J.transpose(0, 2, 1)
            blocks -= to_triangle[:, :, None] * (to_triangle / total[:, None])[:, None, :]
            self._A.data[:] = np.bincount(
                self._place, blocks.reshape(-1)[self._inside], len(self._A.data)
            )
            moved = D * gradient
            free = triangle + moved.sum(axis=1)
            b = np.concatenate([vertex, wheel])
            b += self._sum(
                np.einsum("trc,tc->tr", J, moved) - to_triangle * (free / total)[:, None]
            )
        try:
            self._cholesky = factor_like(self._cholesky, self._A)
        except NotPositiveDefinite as error:
            thin = np.rad2deg(float(np.minimum(angles, np.pi - angles).min()))
            raise AlgorithmFailed(
                f"the angle constraints are linearly dependent in double precision ({error}): the "
                f"sharpest angle is {thin:.2g} degrees. Remesh the needles, or use bff-free or lscm"
            ) from None
        y = self._cholesky.solve(b)
        with phase("assembly"):
            own = np.where(self._rows >= 0, y[self._rows], 0.0)
            y_t = (free - (to_triangle * own).sum(axis=1)) / total
            e = D * (np.einsum("trc,tr->tc", J, own) + y_t[:, None]) - moved
        return e, y[self.k :]

    def _sum(self, values: Real) -> Real:
        """Return the sums of the triangles' row values (m, 6) per row, (2 k,)."""
        there = self._rows >= 0
        return np.bincount(self._rows[there], values[there], 2 * self.k).astype(np.float64)


def _pattern(
    corners: NDArray[np.intp], k: int
) -> tuple[scipy.sparse.csc_array, NDArray[np.intp], NDArray[np.bool_]]:
    """Return the system's matrix (2 k, 2 k) of zeros, and where the triangles' blocks lie in it.

    `corners` (m, 3) are numbers of interior vertices, -1 at the boundary. The matrix has four
    blocks of order k, sums and wheels by sums and wheels, with one pattern. Of the entries of all
    triangles' blocks (m, 6, 6), flattened, those of the mask's are in it, at these places.
    """
    i, j = np.repeat(corners, 3, axis=1), np.tile(corners, (1, 3))
    inside = (i >= 0) & (j >= 0)
    unique, inverse = np.unique(j[inside] * k + i[inside], return_inverse=True)
    column, row = np.divmod(unique, k)
    degree = np.bincount(column, minlength=k)
    start = np.concatenate([[0], np.cumsum(degree)])
    # A column holds its rows among the sums, then the same rows among the wheels.
    block = len(unique)
    among_sums = np.arange(block) + start[column]
    rows = np.empty(4 * block, dtype=np.intp)
    for wheel in (0, 2 * block):
        rows[among_sums + wheel] = row
        rows[among_sums + wheel + degree[column]] = row + k
    pointers = np.concatenate([2 * start[:-1], 2 * (block + start)])
    A = scipy.sparse.csc_array((np.zeros(4 * block), rows, pointers), shape=(2 * k, 2 * k))
    places = np.zeros(inside.shape, dtype=np.intp)
    places[inside] = inverse
    place = np.tile(among_sums[places].reshape(-1, 3, 3), (1, 2, 2))
    place[:, 3:] += np.tile(degree[column][places].reshape(-1, 3, 3), (1, 1, 2))
    place[:, :, 3:] += 2 * block
    inside = np.tile(inside.reshape(-1, 3, 3), (1, 2, 2)).ravel()
    return A, place.ravel()[inside], inside


def kept_positive(angles: Real, e: Real) -> tuple[Real, float]:
    """Take a step, cut so that every angle keeps a tenth of itself; also return the share taken."""
    with np.errstate(divide="ignore"):
        room = np.where(e < 0, -0.9 * angles / e, np.inf).min()
        upper = np.where(e > 0, 0.9 * (np.pi - angles) / e, np.inf).min()
    share = float(min(1.0, room, upper))
    return angles + share * e, share


def placed(
    mesh: DiskMesh | HoledMesh,
    angles: Real,
    told: dict[str, Any],
    *,
    repair: bool,
    iterations: int = 0,
) -> Parameterization:
    """Place vertices by least squares conformal maps of triangles with these angles."""
    with phase("assembly"):
        # A triangle's angles must sum to pi, even if a step was cut.
        weights = 0.5 / np.tan(angles * (np.pi / angles.sum(axis=1, keepdims=True)))
        L = laplacian_of_weights(mesh.F, weights, mesh.n)
    uv = pinned_map(L, mesh.loops, two_distant_vertices(mesh))
    uv, folds = with_area_pi(mesh, uv, repair=repair)
    return Parameterization(uv, iterations, extras={**told, **folds})
