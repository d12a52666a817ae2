"""The Dirichlet-to-Neumann matrix seen from afar: Fourier modes in harmonic measure.

In the coordinate theta that gives every piece of the boundary its harmonic measure, the continuous
operator is diagonal: it multiplies the mode exp(i k theta) by ``|k|``. That needs no factor.
"""

from __future__ import annotations

import math

import numpy as np
import scipy

from cembench.conformal.boundary_energy import MODES
from cembench.core.arrays import Complex, Real
from cembench.linear_algebra.cholesky import Cholesky

#: A vertex stands for the piece of boundary between its second neighbours.
NEIGHBOURS = 2
#: Grid points of the circle for each vertex, at least. A finer grid, for the shortest arcs, gives
#: the same number of steps: vertices that share its cells are told apart by L_bb.
POINTS_A_VERTEX = 4


class InverseByModes:
    """An approximation of the inverse of S + m m^T, m = 1 / B, without a factor of the interior.

    Smooth functions see S as ``|k|`` in harmonic measure; those that change from vertex to vertex
    see L_bb. So the inverse is taken as a sum: that of ``|k|`` between averages over four edges,
    and that of L_bb, which S is never above. Modes above :data:`MODES` have the weight of the
    energy's Hessian, ``|k| - 1``; an :class:`EnergyModel` gives it to those below.

    Parameters
    ----------
    arcs : float (B,)
        Harmonic measure from each vertex to the next, in radians; at least five vertices.
    L_bb : sparse (B, B)
        The boundary's rows and columns of the Laplacian.
    """

    def __init__(self, arcs: Real, L_bb: scipy.sparse.sparray) -> None:
        self._size = 2 ** math.ceil(math.log2(POINTS_A_VERTEX * len(arcs)))
        self._ends = _interval_ends(arcs, self._size)
        k = np.arange(self._size // 2 + 1.0)
        k[0] = np.inf  # constants are not seen
        # The averages are differences of a primitive, so each side divides by k once more.
        self._weights = self._size / (2 * math.pi) / (k * k * np.where(k > MODES, k - 1, k))
        self._near = Cholesky(L_bb)

    def __call__(self, g: Real) -> Real:
        """Return the approximate inverse applied to columns g (B, k) of sum 0."""
        modes = np.fft.rfft(self._ends.T @ g, axis=0) * self._weights[:, None]
        return self._ends @ np.fft.irfft(modes, self._size, axis=0) + self._near.solve(g)


def _interval_ends(arcs: Real, size: int) -> scipy.sparse.csr_array:
    """Return the matrix (B, size) from a function's primitive on a grid to its averages."""
    B = len(arcs)
    at = np.concatenate([[0.0], np.cumsum(arcs)])[:B]
    around = np.concatenate([at - 2 * math.pi, at, at + 2 * math.pi])
    j = np.arange(B)
    low, high = around[j + B - NEIGHBOURS], around[j + B + NEIGHBOURS]
    wide = np.maximum(high - low, 2 * math.pi / size)  # crowded vertices share a grid cell
    low, high = (low + high - wide) / 2, (low + high + wide) / 2
    row, column, value = [], [], []
    for end, sign in ((high, 1.0), (low, -1.0)):
        whole, part = np.divmod(end * (size / (2 * math.pi)), 1.0)
        for step, share in ((0, 1 - part), (1, part)):
            row.append(j)
            column.append((whole.astype(np.int64) + step) % size)
            value.append(sign * share / wide)
    entries = (np.concatenate(value), (np.concatenate(row), np.concatenate(column)))
    return scipy.sparse.csr_array(scipy.sparse.coo_array(entries, shape=(B, size)))


def estimated_energy(z: Complex, arcs: Real) -> float:
    """Return about the conformal energy of the harmonic map with boundary values z (B,).

    `arcs` as for :class:`InverseByModes`. On the exact disk the energy is 2 pi times the sum of
    ``|k| |c_k|^2`` over negative k, with c the Fourier coefficients; modes that the boundary's
    vertices do not resolve are left out.
    """
    B = len(arcs)
    at = np.concatenate([[0.0], np.cumsum(arcs)])
    grid = np.arange(4 * B) * (2 * math.pi / (4 * B))
    closed = np.append(z, z[0])
    c = np.fft.fft(np.interp(grid, at, closed.real) + 1j * np.interp(grid, at, closed.imag))
    k = np.arange(1, B // 4)
    return float(2 * math.pi * (k * np.abs(c[-k] / len(c)) ** 2).sum())
