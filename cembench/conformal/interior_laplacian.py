"""A Laplacian whose interior alone is factored: what the boundary needs of it takes solves.

With the boundary last in the order, as in :mod:`cembench.conformal.bordered`, a factor ends in a
dense triangle, and before it the boundary's rows fill. On long boundaries that costs more than the
interior's own factor and the few solves that replace it, from the boundary's neighbours to the
boundary's neighbours: they pass a third of the factor (:mod:`cembench.linear_algebra.factor_part`).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.conformal.boundary_modes import InverseByModes
from cembench.conformal.dirichlet_to_neumann import DirichletToNeumann
from cembench.conformal.laplacian import by_rows
from cembench.conformal.ring_order import ENTRIES, OPERATIONS_AN_ENTRY
from cembench.core.arrays import Complex, Indices, Mask, Real, marked
from cembench.core.clock import phase
from cembench.linear_algebra.cholesky import Cholesky, keeps_factors
from cembench.linear_algebra.lower_triangle import permuted_lower
from cembench.mesh.triangle_mesh import TriangleMesh

#: Shorter boundaries are always kept last: their dense triangle is small, and serves any step.
MIN_BOUNDARY = 500
#: The boundary's rows of a factor take so many operations, times B^2 sqrt(n): the separators that
#: they meet have about sqrt(n) vertices.
ROWS = 4.7
#: What is spared must be worth so many passes of the factor with two columns. Harmonic measure, the
#: start and each of up to eight steps pass a third of it, the map little over half, where the
#: boundary's order needs two in all; at two the ways cost about the same on real surfaces, and the
#: rest is for those that have to be mapped the other way after all.
PASSES = 3
#: Boundaries that are multiples of each other, up to this relative deviation, have one solve.
ALIKE = 1e-11
#: How many harmonic maps are kept.
KEPT = 8


def solves_pay(interior: int, boundary: int) -> bool:
    """Return whether solves with L_ii are cheaper than a factor with the boundary last.

    That factor takes about B^3 / 3 + 4.7 B^2 sqrt(n) operations more for n interior and B boundary
    vertices. The solves cost less than :data:`PASSES` passes of a factor of 4.5 n log2(n) entries,
    each of which is worth :data:`OPERATIONS_AN_ENTRY` operations.

    Parameters
    ----------
    interior, boundary : int
        Numbers of vertices.

    Examples
    --------
    >>> solves_pay(550_053, 2_976)
    True
    >>> solves_pay(17_089, 245)
    False
    """
    if boundary <= MIN_BOUNDARY or interior < 2 or not keeps_factors():
        return False
    spared = boundary**3 / 3 + ROWS * boundary**2 * math.sqrt(interior)
    one_pass = ENTRIES * interior * math.log2(interior) * OPERATIONS_AN_ENTRY
    return spared > PASSES * one_pass


class InteriorLaplacian:
    """L_ii, factored in its own fill-reducing order, beside the boundary's rows of L.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface, with an interior vertex.
    L : sparse (n, n)
        Its Laplacian.
    boundary : int64 (B,)
        Its boundary, in the order wanted.
    measure : float (n, k)
        What :attr:`swept` is the harmonic measure of.
    by_position : bool
        Order the rows by the vertices' positions instead of by minimum degree.

    Attributes
    ----------
    swept : float (B, k)
        Boundary weights that give every harmonic function the same mean as `measure`.
    L_bb : sparse (B, B)
        The boundary's rows and columns of L.

    Raises
    ------
    NotPositiveDefinite
        L_ii is not positive definite.
    """

    def __init__(
        self,
        mesh: TriangleMesh,
        L: scipy.sparse.csc_array,
        boundary: Indices,
        measure: Real,
        *,
        by_position: bool = False,
    ) -> None:
        self.interior, self.boundary = mesh.interior, boundary
        with phase("assembly"):
            rows = by_rows(L)
            own = permuted_lower(rows, self.interior)
            of_boundary = rows[boundary]
            self.L_bb = scipy.sparse.csc_array(of_boundary[:, boundary])
            L_bi = of_boundary[:, self.interior]
            inside = measure[self.interior]
            some, few, near = _sparse_columns(inside, L_bi)
            self._L_bn = L_bi[:, near]
            self._L_nb = scipy.sparse.csr_array(self._L_bn.T)
        points = mesh.V[self.interior] if by_position else None
        factor = Cholesky(own, lower=True, points=points)
        self._near = factor.among(near)
        self._maps: list[tuple[Complex, Complex]] = []
        self.swept = measure[boundary]
        if few.any():
            self.swept[:, few] -= self._L_bn @ self._near.solve(inside[np.ix_(near, few)])
        if some.any():
            self.swept[:, some] -= L_bi @ factor.solve(inside[:, some])

    def harmonic_near(self, f_b: Complex) -> Complex:
        """Return the values next to the boundary of f with L_ii f_i = -L_ib f_b (Eq. 22).

        A boundary that is a complex multiple of an earlier one takes no solve.
        """
        for known, inside in self._maps:
            turn = np.vdot(known, f_b) / np.vdot(known, known)
            if np.abs(f_b - turn * known).max() <= ALIKE * np.abs(f_b).max():
                return np.asarray(turn * inside)
        with phase("assembly"):
            right = -(self._L_nb @ f_b)
        values: Complex = self._near.solve(right)
        self._maps = [(f_b, values), *self._maps[: KEPT - 1]]
        return values

    def harmonic_extension(self, f_b: Complex) -> Complex:
        """Return the harmonic map (n,) with these boundary values, by little over half a solve."""
        f = np.empty(len(self.interior) + len(self.boundary), dtype=np.complex128)
        f[self.boundary] = f_b
        f[self.interior] = self._near.solve_everywhere(-(self._L_nb @ f_b))
        return f

    def dirichlet_to_neumann(self, arcs: Real) -> DirichletToNeumann:
        """Return S, whose products take a solve each, with an approximate inverse without any.

        `arcs` (B,) are the boundary's harmonic measure, in radians.
        """
        return _BySolves(self, InverseByModes(arcs, self.L_bb))

    def product(self, f: Complex) -> Complex:
        """Return S f for f (B,)."""
        return np.asarray(self.L_bb @ f + self._L_bn @ self.harmonic_near(f))


def _sparse_columns(inside: Real, L_bi: scipy.sparse.csr_array) -> tuple[Mask, Mask, Indices]:
    """Return which columns (n_i, k) have many entries, which have few, and the rows of interest.

    These rows are the boundary's neighbours and those of the columns with few entries, fewer than
    there are neighbours.
    """
    wanted = marked(len(inside), L_bi.indices)
    entries = np.count_nonzero(inside, axis=0)
    few = (entries > 0) & (entries <= np.count_nonzero(wanted))
    wanted |= inside[:, few].any(axis=1)
    return (entries > 0) & ~few, few, np.flatnonzero(wanted)


class _BySolves(DirichletToNeumann):
    """S by solves with L_ii, and an inverse good enough to precondition."""

    def __init__(self, laplacian: InteriorLaplacian, inverse: InverseByModes) -> None:
        self._laplacian, self._near = laplacian, inverse

    def __call__(self, f: NDArray[Any]) -> NDArray[Any]:
        return self._laplacian.product(f)

    def inverse(self, g: Real) -> Real:
        columns = g.reshape(len(g), -1)
        total = columns.sum(axis=0)
        x = self._near(columns - total / len(g))
        return (x - x.mean(axis=0) + total).reshape(g.shape)
