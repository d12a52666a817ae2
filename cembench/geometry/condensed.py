"""A surface condensed onto its boundary: its Laplacian with the interior eliminated, once for all.

Whatever is glued to the boundary afterwards, patches that fill holes, changes only small dense
blocks. One sparse factorisation of the surface serves every filled surface that way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from cembench.clock import phase
from cembench.errors import NotPositiveDefinite
from cembench.geometry.cholesky import Cholesky
from cembench.geometry.mesh import TriangleMesh

Loop = NDArray[np.int64]
Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Condensed:
    """The Laplacian L of a surface, its interior i eliminated.

    Parameters
    ----------
    interior, boundary : int64
        Indices i, and b: the loops one behind the other.
    parts : tuple of slice
        Where each loop lies in `boundary`.
    S : float64 (k, k)
        L_bb - L_bi L_ii^-1 L_ib, dense; positive semi-definite, rows sum to zero.
    L_bi, L_bb : sparse
        The boundary rows of L.

    """

    interior: Loop
    boundary: Loop
    parts: tuple[slice, ...]
    S: Real
    L_bi: sparse.csr_array
    L_bb: sparse.csr_array
    _bordered: Cholesky

    def solve_interior(self, rhs: NDArray[Any]) -> NDArray[Any]:
        """L_ii x = rhs."""
        return self._bordered.solve_leading(rhs)

    def extension(self, f_b: Complex) -> Complex:
        """The interior of the map that is harmonic on the surface for boundary values f_b."""
        return self._bordered.solve_leading(-(self.L_bi.T @ f_b))

    def whole(self, f_b: Complex, f_i: Complex) -> Complex:
        """Both parts in the order of the vertices."""
        f = np.empty(len(self.interior) + len(self.boundary), dtype=np.complex128)
        f[self.interior], f[self.boundary] = f_i, f_b
        return f


def condensed(mesh: TriangleMesh, L: sparse.sparray, loops: Sequence[Loop]) -> Condensed:
    """Eliminate the interior of a surface with Laplacian L; `loops` are all of its boundaries.

    One factorisation: that of L pinned at one boundary vertex, boundary last, holds the factors of
    L_ii and of S pinned.

    Raises
    ------
    NotPositiveDefinite
        L pinned is not.

    """
    with phase("assembly"):
        i, b = mesh.interior, np.concatenate(loops)
        order = np.concatenate([i, b])
        ordered = sparse.csr_array(sparse.csr_array(L)[order][:, order])
        n_i, ends = len(i), np.cumsum([0, *map(len, loops)])
    bordered = Cholesky(ordered[:-1, :-1], leading=n_i)
    C = bordered.schur_factor()
    with phase("condensation"):
        pinned = C @ C.T
        # The last row and column follow from sums of zero (Theorem 1).
        S = np.zeros((len(b), len(b)))
        S[:-1, :-1] = pinned
        S[-1, :-1] = S[:-1, -1] = -pinned.sum(axis=0)
        S[-1, -1] = pinned.sum()
    return Condensed(
        i,
        b,
        tuple(slice(*ends[k : k + 2]) for k in range(len(loops))),
        S,
        ordered[n_i:, :n_i],
        ordered[n_i:, n_i:],
        bordered,
    )


class DenseCholesky:
    """Solves systems with a small dense symmetric positive definite matrix.

    Raises
    ------
    NotPositiveDefinite
        It is not.

    """

    def __init__(self, A: Real) -> None:
        with phase("dense factorisation"):
            try:
                self._factor = linalg.cho_factor(A, lower=True, check_finite=False)
            except linalg.LinAlgError as error:
                raise NotPositiveDefinite(
                    f"the dense matrix of order {len(A)} is not positive definite ({error})"
                ) from None

    def solve(self, b: NDArray[Any]) -> NDArray[Any]:
        """A x = b, real or complex."""
        with phase("solves"):
            if np.iscomplexobj(b):  # LAPACK would make a complex copy of the factor
                return self._solve(b.real) + 1j * self._solve(b.imag)
            return self._solve(b)

    def _solve(self, b: Real) -> Real:
        x: Real = linalg.cho_solve(self._factor, b, check_finite=False)
        return x
