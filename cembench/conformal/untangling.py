"""Lay out patches of a planar map without folds, with everything around them fixed.

For the map of a triangle with derivatives f_z and f_zbar, let ``N = |f_z|^2 + |f_zbar|^2``, and let
``D = |f_z|^2 - |f_zbar|^2`` be its Jacobian, both in units of the local N. The objective is::

    the mean of 2 |f_zbar|^2 + BARRIER (N + AREA) / chi(D), chi(D) = (D + sqrt(D^2 + eps^2)) / 2

The first term is the density of the conformal energy, so that unfolded parts hardly change. The
second term is a barrier against folds. chi is positive everywhere, so the barrier is finite for a
folded map, and eps goes to 0 while the folds disappear: Garanzha, Kaporin, Kudryavtseva, Protais,
Ray and Sokolov, "Foldover-free maps in 50 lines of code", ACM Trans. Graph. 40 (2021). Steps are
Newton's with the positive semi-definite part of the Hessian: N / chi is convex where chi is linear.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.conformal.laplacian import corner_products
from cembench.core.arrays import Complex, Indices, Mask, Real, numbered
from cembench.core.errors import NotPositiveDefinite
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.triangle_mesh import TriangleMesh

#: Maximal number of Newton steps; five to thirty are enough if it succeeds.
STEPS = 60
#: Weight of the barrier: a smaller one raises E_C less, but below 0.01 the last folds remain.
BARRIER = 0.05
#: Weight of the area in it: without it a patch may shrink to a point instead of unfolding.
AREA = 0.1
#: Initial eps in units of the local N; a step reduces it by at most this factor.
FIRST, DECAY = 0.1, 0.7
#: eps stays above this share of the depth of the deepest fold, and above the last value.
DEPTH, LAST = 0.2, 1e-9
#: A patch has converged if the predicted relative decrease of its energy is below this.
SETTLED = 0.1
#: Added to the scaled Hessian, whose diagonal is 1.
REGULAR = 1e-10


def untangled(
    mesh: TriangleMesh,
    z: Complex,
    free: Mask,
    graph: scipy.sparse.csr_array,
    steps: int = STEPS,
    first: float = FIRST,
) -> tuple[Complex, Indices]:
    """Lay out the free vertices of a planar map without folds, if possible.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    z : complex (n,)
        Its map.
    free : bool (n,)
        Which vertices may move. Free vertices that share edges form a patch; patches are
        independent.
    graph : sparse (n, n)
        Which vertices share an edge.
    steps : int
        Maximal number of Newton steps.
    first : float
        The first eps; with 0 a map without folds keeps having none.

    Returns
    -------
    z : complex (n,)
        The map with its free vertices moved; a patch may still be folded.
    patch : int64 (m,)
        The patch of each triangle; -1 for triangles without a free vertex.
    """
    patches = _Patches(mesh, z, free, graph)
    moving = z[patches.vertices]
    eps = np.full(patches.count, first)
    for _ in range(steps):
        depth = np.maximum(-patches.least(moving), 0)
        eps = np.maximum(DECAY * eps, np.hypot(LAST, DEPTH * depth))
        try:
            step, slope = patches.newton_step(moving, eps)
        except NotPositiveDefinite:
            break  # beyond the resolution of doubles; the caller counts the remaining folds
        moving, energy = patches.line_search(moving, step, slope, eps)
        if ((patches.least(moving) > 0) & (-slope < SETTLED * energy)).all():
            break
    z = z.copy()
    z[patches.vertices] = moving
    return z, patches.of_all


class _Patches:
    """The energy of all patches at once, and its derivatives, as functions of their vertices.

    Rows of `corners` are the triangles' corners as indices of moving vertices, -1 for a fixed
    corner.
    """

    def __init__(
        self, mesh: TriangleMesh, z: Complex, free: Mask, graph: scipy.sparse.csr_array
    ) -> None:
        self.vertices = np.flatnonzero(free)
        among = graph[self.vertices][:, self.vertices]
        count, label = scipy.sparse.csgraph.connected_components(among, directed=False)
        self.count, self._label = int(count), label
        patch = np.full(mesh.n, -1)
        patch[self.vertices] = label
        self.of_all = patch[mesh.F].max(axis=1)
        T = mesh.F[self.of_all >= 0]
        self._of = self.of_all[self.of_all >= 0]
        place = numbered(mesh.n, self.vertices)
        self._corners = place[T]
        self._held = z[T]
        to_z, to_zbar, area = _derivatives(mesh.V, T)
        self._to_z, self._to_zbar = to_z, to_zbar
        # Sizes vary by orders of magnitude within a patch, so N is scaled by its local mean.
        f_z, f_zbar = self._maps(z[self.vertices])
        size = np.repeat(np.abs(f_z) ** 2 + np.abs(f_zbar) ** 2, 3)
        at_vertices = np.bincount(T.ravel(), size) / np.maximum(np.bincount(T.ravel()), 1)
        local = np.sqrt(np.maximum(at_vertices[T].mean(axis=1), np.finfo(float).tiny))[:, None]
        self._to_z, self._to_zbar = to_z / local, to_zbar / local
        weight = area * local[:, 0]
        self._share = weight / self._sums(weight)[self._of]

    def _sums(self, values: Real) -> Real:
        """Return the sums over the triangles of each patch."""
        return np.bincount(self._of, values, self.count).astype(np.float64)

    def _maps(self, moving: Complex) -> tuple[Complex, Complex]:
        """Return f_z and f_zbar of every triangle."""
        u = np.where(self._corners < 0, self._held, moving[self._corners])
        u -= u[:, :1]  # nearby points are subtracted exactly
        return (self._to_z * u).sum(axis=1), (self._to_zbar * u).sum(axis=1)

    def least(self, moving: Complex) -> Real:
        """Return the least D of each patch."""
        f_z, f_zbar = self._maps(moving)
        least = np.full(self.count, np.inf)
        np.minimum.at(least, self._of, np.abs(f_z) ** 2 - np.abs(f_zbar) ** 2)
        return least

    def _energy(self, moving: Complex, eps: Real) -> Real:
        f_z, f_zbar = self._maps(moving)
        N, chi, _ = _ratio(f_z, f_zbar, eps[self._of])
        return self._sums(self._share * (2 * np.abs(f_zbar) ** 2 + BARRIER * N / chi))

    def newton_step(self, moving: Complex, eps: Real) -> tuple[Complex, Real]:
        """Return a Newton step, and the derivative of each patch's energy along it, negative."""
        f_z, f_zbar = self._maps(moving)
        N, chi, slope = _ratio(f_z, f_zbar, eps[self._of])
        by_z, by_zbar = np.conj(f_z)[:, None] * self._to_z, np.conj(f_zbar)[:, None] * self._to_zbar
        dN, dchi = 2 * _real_row(by_z + by_zbar), 2 * slope[:, None] * _real_row(by_z - by_zbar)
        squared, squared_bar = _hessian_of_square(self._to_z), _hessian_of_square(self._to_zbar)
        across = _outer(dN, dchi)
        H = (squared + squared_bar) / chi[:, None, None]
        H -= (across + across.transpose(0, 2, 1)) / (chi**2)[:, None, None]
        H += (2 * N / chi**3)[:, None, None] * _outer(dchi, dchi)
        g = dN / chi[:, None] - (N / chi**2)[:, None] * dchi
        H, g = 2 * squared_bar + BARRIER * H, 4 * _real_row(by_zbar) + BARRIER * g
        step, gradient = self._solved(self._share[:, None, None] * H, self._share[:, None] * g)
        along = (np.conj(gradient) * step).real
        return step, np.bincount(self._label, along, self.count).astype(np.float64)

    def _solved(self, H: Real, g: Real) -> tuple[Complex, Complex]:
        """Assemble the triangles' 6 x 6 Hessians and gradients; return step and gradient."""
        k = len(self.vertices)
        row = np.concatenate(
            [self._corners, np.where(self._corners < 0, -1, self._corners + k)], axis=1
        )
        i = np.broadcast_to(row[:, :, None], H.shape)
        j = np.broadcast_to(row[:, None, :], H.shape)
        inside = (i >= 0) & (j >= 0)
        A = scipy.sparse.coo_array(
            (H[inside], (i[inside], j[inside])), shape=(2 * k, 2 * k)
        ).tocsc()
        gradient = np.bincount(row[row >= 0], g[row >= 0], 2 * k).astype(np.float64)
        scale = scipy.sparse.diags_array(1 / np.sqrt(A.diagonal()))
        A = scale @ A @ scale + REGULAR * scipy.sparse.eye_array(2 * k)
        step = -(scale @ Cholesky(scipy.sparse.csc_array(A)).solve(scale @ gradient))
        return step[:k] + 1j * step[k:], gradient[:k] + 1j * gradient[k:]

    def line_search(
        self, moving: Complex, step: Complex, slope: Real, eps: Real
    ) -> tuple[Complex, Real]:
        """Halve each patch's step until its energy falls enough; return vertices and energies."""
        before, t = self._energy(moving, eps), np.ones(self.count)
        for _ in range(40):
            there = moving + t[self._label] * step
            energy = self._energy(there, eps)
            enough = energy <= before + 1e-4 * t * slope
            if enough.all():
                return there, energy
            t = np.where(enough, t, t / 2)
        t = np.where(enough, t, 0.0)
        return moving + t[self._label] * step, np.where(enough, energy, before)


def _derivatives(V: Real, T: Indices) -> tuple[Complex, Complex, Real]:
    """Return weights (m, 3) of the corners' images in f_z and f_zbar, and the areas (m,)."""
    dots, double_area = corner_products(V, T)
    length = np.linalg.norm(V[T[:, 1]] - V[T[:, 0]], axis=1)
    flat = np.zeros(T.shape, dtype=np.complex128)
    flat[:, 1], flat[:, 2] = length, (dots[:, 0] + 1j * double_area) / length
    opposite = np.roll(flat, -2, axis=1) - np.roll(flat, -1, axis=1)
    gradient: Complex = 1j * opposite / double_area[:, None]
    to_zbar: Complex = gradient / 2
    area: Real = double_area / 2
    return np.conj(to_zbar), to_zbar, area


def _ratio(f_z: Complex, f_zbar: Complex, eps: Real) -> tuple[Real, Real, Real]:
    """Return N + AREA, chi(D) and the derivative of chi."""
    first, second = np.abs(f_z) ** 2, np.abs(f_zbar) ** 2
    D = first - second
    root = np.hypot(D, eps)
    chi = np.where(D > 0, (D + root) / 2, eps**2 / (2 * (root + np.abs(D))))
    return first + second + AREA, chi, chi / root


def _real_row(c: Complex) -> Real:
    """Return the row of Re(c du) for real and imaginary parts of du."""
    return np.concatenate([c.real, -c.imag], axis=1)


def _hessian_of_square(c: Complex) -> Real:
    """Return the second derivative of |c du|^2 in the real and imaginary parts of du."""
    C = 2 * _outer(np.conj(c), c)
    return np.asarray(np.block([[C.real, -C.imag], [C.imag, C.real]]), dtype=np.float64)


def _outer(a: NDArray[Any], b: NDArray[Any]) -> NDArray[Any]:
    """Return the outer products of the rows of a and b."""
    return a[:, :, None] * b[:, None, :]
