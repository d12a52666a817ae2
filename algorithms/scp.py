"""Spectral conformal parameterization: the free boundary with least energy for its size."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

import numpy as np
import scipy
from numpy.typing import NDArray
from pydantic import Field

from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.curvature import mixed_vertex_areas
from cembench.conformal.free_boundary import conformal_energy_form, is_strip, unrolled, with_area_pi
from cembench.conformal.harmonic import edge_lengths
from cembench.conformal.laplacian import laplacian
from cembench.core.arrays import Complex, Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed, NotPositiveDefinite
from cembench.core.parameterization import Parameterization
from cembench.linear_algebra.cholesky import LARGEST_DENSE, Cholesky
from cembench.linear_algebra.dense_cholesky import DenseCholesky
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

Apply = Callable[[Complex], Complex]
#: The weights of a map's size: boundary vertices equal or by length, or all vertices by area.
Weights = Literal["boundary", "length", "area"]

#: Vectors iterated together; convergence depends on the ratio of the first and last eigenvalue.
BLOCK = 6
#: Share of the mean diagonal that is added for flat surfaces, which have a second null vector.
SHIFT = 1e-11


@algorithm(
    "scp",
    title="SCP",
    target="free boundary",
    source="Mullen, Tong, Alliez & Desbrun, Spectral conformal parameterization, 2008",
    usual=False,
)
def scp(
    mesh: DiskMesh,
    *,
    weights: Weights = "boundary",
    tolerance: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 1e-6,
    max_iterations: Annotated[int, Field(ge=1, le=1_000_000)] = 100,
    delaunay: bool = False,
    repair: bool = True,
) -> Parameterization:
    """Map a disk with a free boundary and least conformal energy for its size, without pins.

    E_C (Eq. 7) is a Hermitian form in the map; the map is the eigenvector of the smallest
    eigenvalue other than that of the constants. The size is the sum of abs(z)^2 over the boundary,
    as in the paper, over the boundary by length, or over the surface by area as in libigl
    (`weights`). With the first two the interior is eliminated: (S - M) z = lambda W z on the
    boundary alone, with S the Schur complement of the Laplacian and M the area.

    It is not the map of least angle error: E_C weighs abs(mu)^2 by the square of the image's scale,
    so it accepts slightly larger errors in many triangles for much smaller ones in a few large
    ones.

    Decided here: inverse iteration with six vectors and one factor, dense up to 5,000 boundary
    vertices, ends when the vector is within about `tolerance` of its limit: its residual over the
    gap to the next eigenvalue (`eigenvalue`, `residual`, `sweeps`). The image is scaled to area pi,
    and folds inside are repaired as in LSCM (`fold_repairs`).
    """
    if is_strip(mesh):
        return unrolled(mesh)
    L = laplacian(mesh, delaunay=delaunay)
    b = mesh.boundary
    if weights == "area" or len(b) > LARGEST_DENSE:
        at = np.arange(mesh.n)
        W = _weights(mesh, weights, at)
        with phase("assembly"):
            H, solve = _sparse_form(L, b, W)
    else:
        bordered = BorderedLaplacian(mesh, L, (b,))
        at = b
        W = _weights(mesh, weights, at)
        with phase("assembly"):
            H, solve = _dense_form(bordered.S, W)
    with phase("eigenvectors"):
        vector, value, residual, iterations = _least(H, solve, W, tolerance, max_iterations)
    uv = vector if len(vector) == mesh.n else bordered.harmonic_extension(vector)
    uv, folds = with_area_pi(mesh, uv, repair=repair)
    extras = {"eigenvalue": value, "residual": residual, "sweeps": iterations}
    return Parameterization(uv, extras={**extras, **folds})


def _weights(mesh: DiskMesh, weights: Weights, at: NDArray[np.int64]) -> Real:
    """Return W (k,) at these vertices, with mean 1 so that eigenvalues can be compared."""
    W = np.zeros(mesh.n)
    if weights == "area":
        W[:] = mixed_vertex_areas(mesh)
    elif weights == "length":
        lengths = edge_lengths(mesh, mesh.boundary)
        W[mesh.boundary] = lengths + np.roll(lengths, 1)
    else:
        W[mesh.boundary] = 1.0
    W *= np.count_nonzero(W) / W.sum()
    return W[at]


def _dense_form(S: Real, W: Real) -> tuple[Apply, Apply]:
    """Return H = S - M with 2 E_C = z^* H z, and a solver for it up to constants."""
    k = np.arange(len(S))
    H = S.astype(np.complex128)
    after = (k + 1) % len(S)
    H[k, after] += 0.5j
    H[after, k] -= 0.5j
    try:
        pinned = DenseCholesky(H[:-1, :-1])
    except NotPositiveDefinite:
        return lambda X: H @ X, DenseCholesky(H + np.diag(_shift(H, W))).solve

    def solve(Y: Complex) -> Complex:
        return np.concatenate([pinned.solve(Y[:-1]), np.zeros((1, Y.shape[1]))])

    return lambda X: H @ X, solve


def _sparse_form(L: scipy.sparse.csc_array, b: NDArray[np.int64], W: Real) -> tuple[Apply, Apply]:
    """Return the same over all vertices in real numbers: (u, v) instead of u + i v."""
    n = L.shape[0]
    Q = conformal_energy_form(L, b)
    kept = np.delete(np.arange(2 * n), [b[-1], b[-1] + n])
    try:
        factor = Cholesky(scipy.sparse.csc_array(scipy.sparse.csr_array(Q)[kept][:, kept]))
    except NotPositiveDefinite:
        kept = np.arange(2 * n)
        factor = Cholesky(Q + scipy.sparse.diags_array(_shift(Q, np.tile(W, 2))))

    def solve(Y: Complex) -> Complex:
        x = np.zeros((2 * n, Y.shape[1]))
        x[kept] = factor.solve(np.concatenate([Y.real, Y.imag])[kept])
        return x[:n] + 1j * x[n:]

    def times(X: Complex) -> Complex:
        x = Q @ np.concatenate([X.real, X.imag])
        return x[:n] + 1j * x[n:]

    return times, solve


def _shift(H: Any, W: Real) -> Real:
    """Return what is added to the diagonal of H if it has a null vector besides the constants."""
    return np.asarray(SHIFT * float(np.abs(H.diagonal()).mean()) * W)


def _least(
    H: Apply, solve: Apply, W: Real, tolerance: float, most: int
) -> tuple[Complex, float, float, int]:
    """Return the eigenvector of H z = value W z for the least value except that of the constants.

    Subspace iteration with the inverse, and Rayleigh quotients in the subspace.
    """
    share = W / W.sum()
    k = np.flatnonzero(W)
    X = np.zeros((len(W), min(BLOCK, len(k) - 1)), dtype=np.complex128)
    # Rotations around the boundary in both directions: the modes of the disk.
    turns = np.arange(1, X.shape[1] + 1)
    X[k] = np.exp(2j * np.pi * np.outer(np.arange(len(k)) / len(k), turns))
    for iteration in range(1, most + 1):
        X = solve(W[:, None] * (X - share @ X))
        X, _ = np.linalg.qr(X - share @ X)
        X -= share @ X
        HX = H(X)
        values, turn = scipy.linalg.eigh(X.conj().T @ HX, X.conj().T @ (W[:, None] * X))
        X, HX = X @ turn, HX @ turn
        away = (HX[:, 0] - values[0] * W * X[:, 0])[k]
        off = float(np.linalg.norm(away / np.sqrt(W[k])))
        residual = off / float(values[1] - values[0])
        if residual <= tolerance:
            return X[:, 0], float(values[0]), residual, iteration
    raise AlgorithmFailed(
        f"the eigenvector has not converged after {most} sweeps: residual {residual:.2g}, "
        f"tolerance {tolerance:g}. Allow more with max_iterations"
    )
