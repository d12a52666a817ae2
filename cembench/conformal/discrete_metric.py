"""Discrete metrics: edge lengths of triangles, scaled at vertices (discrete conformal equivalence).

Lengths are stored by triangle; ``lengths[t, c]`` is opposite to the corner ``F[t, c]``. Scaling a
vertex by u multiplies each of its edges by exp(u / 2).
"""

from __future__ import annotations

import numpy as np
import scipy

from cembench.core.arrays import Complex, Indices, Mask, Real
from cembench.mesh.gluing import edges_of_half_edges

#: Half the cotangent of 60 degrees, used for lengths that form no triangle.
REGULAR = 0.5 / np.sqrt(3)


def scaled(lengths: Real, F: Indices, u: Real) -> Real:
    """Return the lengths (m, 3) after scaling vertices by u (n,): l exp((u_i + u_j) / 2)."""
    corners = u[F]
    return np.asarray(lengths * np.exp((corners.sum(axis=1, keepdims=True) - corners) / 2))


def angles(lengths: Real) -> tuple[Real, Mask]:
    """Return the angles (m, 3) in radians, and which triangles are broken (m,).

    If one side is at least as long as the other two together, its opposite angle is pi and the
    others are 0. The energy whose gradient they form then stays convex (Springborn et al. 2008,
    Sec. 3).
    """
    a, b, c = lengths.T
    # Sum of two sides less the third: the three factors of Heron's formula. Column by column, which
    # is several times as fast as reductions of rows of three.
    spare = np.stack([b + c - a, c + a - b, a + b - c])
    broken = np.asarray((spare[0] <= 0) | (spare[1] <= 0) | (spare[2] <= 0))
    spare[:, broken] = 1.0
    x, y, z = spare
    radians = 2 * np.arctan2(np.sqrt(x * y * z / (x + y + z)), spare).T
    radians[broken] = np.where(
        lengths[broken] == lengths[broken].max(axis=1, keepdims=True), np.pi, 0.0
    )
    return radians, broken


def half_cotangents_of(angles: Real, broken: Mask) -> Real:
    """Return half the cotangent of each angle (m, 3); of 60 degrees for broken triangles."""
    with np.errstate(divide="ignore"):
        weights = 0.5 / np.tan(angles)
    weights[broken] = REGULAR
    return weights


def angle_sums(F: Indices, angles: Real, n: int) -> Real:
    """Return the sum of the angles (m, 3) at each vertex, (n,)."""
    return np.bincount(F.ravel(), weights=angles.ravel(), minlength=n).astype(np.float64)


def length_cross_ratios(F: Indices, lengths: Real) -> Real:
    """Return the logarithms (e,) of the length cross ratios of the interior edges.

    For the edge ij with triangles ijk and jil the ratio is l_ik l_jl / (l_kj l_li). Two metrics on
    the same triangles are discretely conformally equivalent if these agree.
    """
    _, edge, faces = edges_of_half_edges(F)
    side = np.log(lengths)
    # Half-edge c of a triangle runs from corner c to the next. The sides at its start and its end
    # are those opposite to the next corner and to corner c.
    ratio = (np.roll(side, -1, axis=1) - side).ravel()
    total = np.bincount(edge, weights=ratio, minlength=len(faces))
    return np.asarray(total[faces == 2])


class BlockPattern:
    """Laplacians with changing weights on the same triangles, restricted to some vertices.

    All have the same stored entries, zeros included, so one symbolic analysis serves all.

    Parameters
    ----------
    F : int64 (m, 3)
        The triangles.
    kept : bool (n,)
        Which vertices have a row and a column.
    """

    def __init__(self, F: Indices, kept: Mask) -> None:
        ends, self._edge, _ = edges_of_half_edges(F)
        self._ends, self.kept, self._n = ends, kept, len(kept)
        number = np.cumsum(kept) - 1
        self._inside = np.flatnonzero(kept[ends].all(axis=1))
        i, j = number[ends[self._inside]].T
        size = int(kept.sum())
        diagonal = np.arange(size)
        rows, columns = np.concatenate([i, j, diagonal]), np.concatenate([j, i, diagonal])
        entry = np.arange(1, len(rows) + 1)
        self._A = scipy.sparse.csc_array(
            scipy.sparse.coo_array((entry, (rows, columns)), shape=(size, size))
        )
        self._A.sort_indices()
        self._entry = self._A.data - 1
        self._A = self._A.astype(np.float64)

    def weights_of_edges(self, weights: Real) -> Real:
        """Return the sums over edges (e,) of weights (m, 3) for the opposite corners."""
        # The side opposite to corner c is half-edge c + 1.
        return np.bincount(
            self._edge, weights=np.roll(weights, 1, axis=1).ravel(), minlength=len(self._ends)
        ).astype(np.float64)

    def block(self, weights: Real) -> scipy.sparse.csc_array:
        """Return the rows and columns of the kept vertices of the Laplacian with weights (m, 3)."""
        w = self.weights_of_edges(weights)
        return self._filled(-w[self._inside], self._degrees(w))

    def dirichlet(
        self, weights: Real, fixed: Mask, f: Complex
    ) -> tuple[scipy.sparse.csc_array, Complex]:
        """Return A and b of A x = b for the harmonic map that is f (n,) at fixed vertices (n,).

        All vertices that are not kept are fixed. Kept vertices that are fixed have the equation x =
        f, in the same pattern.
        """
        w = self.weights_of_edges(weights)
        free = ~fixed & self.kept
        known = np.where(free, 0, f)
        i, j = self._ends.T
        right = np.zeros(self._n, dtype=np.complex128)
        for row, column in ((i, j), (j, i)):
            moved = w * known[column]
            right += np.bincount(row, moved.real, self._n) + 1j * np.bincount(
                row, moved.imag, self._n
            )
        right[~free] = f[~free]
        open_ = free[self._ends[self._inside]].all(axis=1)
        inside = np.where(open_, -w[self._inside], 0.0)
        return self._filled(inside, np.where(free, self._degrees(w), 1.0)), right[self.kept]

    def _degrees(self, w: Real) -> Real:
        return np.bincount(self._ends.ravel(), np.repeat(w, 2), self._n).astype(np.float64)

    def _filled(self, inside: Real, diagonal: Real) -> scipy.sparse.csc_array:
        values = np.concatenate([inside, inside, diagonal[self.kept]])
        self._A.data[:] = values[self._entry]
        return self._A.copy()
