"""Numerical tests of the statements of Section 4 of the paper on a surface.

K = L_bb^-1 L_ib^T L_ii^-1 L_ib (Eq. 27) maps boundary values to those after one step (23). It is
similar to a symmetric matrix: G v = lambda L_bb v with G = L_ib^T L_ii^-1 L_ib has the same
eigenvalues, and G and L_bb are symmetric. A symmetric eigensolver finds them without forming K.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.sparse import csgraph
from scipy.sparse.linalg import LinearOperator, eigsh

from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.boundary_iteration import inverted, on_circle, pole_start
from cembench.conformal.laplacian import laplacian
from cembench.conformal.planar import backward_arcs
from cembench.core.arrays import Complex, Real
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.topology import boundary_half_edges, vertex_graph
from cembench.mesh.triangle_mesh import TriangleMesh

#: Tolerance within which an equation counts as satisfied.
TOLERANCE = 1e-8
#: Number of eigenvalues computed by the matrix-free solver.
LEADING = 8
#: A weight in L counts as positive, and its edge as not Delaunay, above this share of the largest.
SIGNIFICANT = 1e-12


@dataclass(frozen=True)
class Check:
    """A premise or a statement, and the result of testing it.

    Parameters
    ----------
    name : str
        Its name in tables.
    source : str
        Its place in the paper.
    holds : bool
        Whether it holds; for an equation, within `TOLERANCE`.
    figure : float
        The deciding number.
    meaning : str
        Meaning of that number.
    """

    name: str
    source: str
    holds: bool
    figure: float
    meaning: str


@dataclass(frozen=True)
class Trajectory:
    """The course of CEM's boundary iteration without a stopping rule or safeguards.

    Parameters
    ----------
    energies : float64 (k + 1,)
        E_C at the start and after each iteration.
    steps : float64 (k,)
        Root-mean-square movement of the boundary vertices in each iteration, up to a rotation.
    largest_gap : float
        The largest arc without a vertex in any iterate, in radians; pi or more means a collapse.
    off_circle : float
        Largest distance of an iterate from the unit circle.
    out_of_order : int
        The largest number of backward arcs in any iterate.
    boundary : complex128 (B,)
        The last iterate.
    """

    energies: Real
    steps: Real
    largest_gap: float
    off_circle: float
    out_of_order: int
    boundary: Complex

    @property
    def rises(self) -> Real:
        """Increase of E_C in each iteration; negative if it falls."""
        return np.diff(self.energies)

    @property
    def rate(self) -> float:
        """Factor by which the steps shrink at the end: the median over the last tenth."""
        ratios = self.steps[1:] / np.maximum(self.steps[:-1], 1e-300)
        tail = self.steps[1:] > 1e-12
        ratios = ratios[tail]
        return float(np.median(ratios[-max(len(ratios) // 10, 1) :])) if len(ratios) else 0.0


class BoundaryOperator(BorderedLaplacian):
    """The operator K of a surface, applied without forming the matrix; default: of cotangents."""

    def __init__(self, mesh: TriangleMesh, L: sparse.sparray | None = None) -> None:
        self.mesh = mesh
        self.L = laplacian(mesh) if L is None else L
        super().__init__(mesh, self.L, (mesh.loops[0],))
        self._own_rows = Cholesky(self.L_bb)

    @property
    def size(self) -> int:
        """Number of boundary vertices."""
        return len(self.boundary)

    def ring(self, f_i: NDArray[Any]) -> NDArray[Any]:
        """Return the next boundary values (Eq. 23)."""
        return self._own_rows.solve(-(self.L_bi @ f_i))

    def __call__(self, f_b: NDArray[Any]) -> NDArray[Any]:
        """Return K f_b."""
        return self.ring(self.dirichlet(f_b))

    def leading_eigenpairs(self, count: int = LEADING) -> tuple[Real, Real]:
        """Return the largest eigenvalues of K, descending (k,), and eigenvectors (n_b, k)."""
        n = self.size
        count = min(count, n - 1)

        def operator(apply: Callable[[Any], Real]) -> LinearOperator:
            return LinearOperator((n, n), matvec=apply, dtype=np.float64)

        values, vectors = eigsh(
            operator(lambda v: -(self.L_bi @ self.dirichlet(v))),
            k=count,
            M=operator(lambda v: self.L_bb @ v),
            Minv=operator(self._own_rows.solve),
            which="LA",
            v0=np.cos(np.arange(n)) + 1.0,
            ncv=min(n, max(4 * count, 40)),
            tol=1e-13,
        )
        order = np.argsort(values)[::-1]
        return values[order], vectors[:, order]

    @cached_property
    def dense(self) -> Real:
        """The dense matrix K = I - L_bb^-1 S."""
        return np.eye(self.size) - self._own_rows.solve(self.S)

    def spectrum(self) -> Real:
        """All eigenvalues in descending order, from a dense symmetric solver."""
        L_bb = self.L_bb.toarray()
        return 1 - linalg.eigh(self.S, L_bb, eigvals_only=True)

    def start(self) -> Complex:
        """CEM's initial boundary on the circle (Eqs. 13 to 18)."""
        mesh = self.mesh
        return on_circle(pole_start(mesh.V, mesh.F, self.solved_boundary))


def trajectory(K: BoundaryOperator, iterations: int, *, inversion: bool) -> Trajectory:
    """Run the bare iteration (22), (23) or (30), (24), (25) from CEM's start."""
    f_b = K.start()
    f_i = K.dirichlet(f_b)
    energies, steps = [K.conformal_energy(f_i, f_b)], []
    gap, off, backward = _largest_gap(f_b), 0.0, backward_arcs(f_b)
    for _ in range(iterations):
        after = on_circle(K.ring(inverted(f_i) if inversion else f_i))
        turn = np.vdot(f_b, after)
        steps.append(float(np.sqrt(np.mean(np.abs(after * np.conj(turn) / abs(turn) - f_b) ** 2))))
        f_b, f_i = after, K.dirichlet(after)
        energies.append(K.conformal_energy(f_i, f_b))
        gap, backward = max(gap, _largest_gap(f_b)), max(backward, backward_arcs(f_b))
        off = max(off, float(np.abs(np.abs(f_b) - 1).max()))
    return Trajectory(np.array(energies), np.array(steps), gap, off, backward, f_b)


def _largest_gap(f_b: Complex) -> float:
    angles = np.sort(np.angle(f_b))
    return float(np.diff(np.append(angles, angles[0] + 2 * np.pi)).max())


def premises(K: BoundaryOperator) -> list[Check]:
    """Return the checks of Definition 1 (well-conditioned surface) and Lemma 2 (M-matrix).

    The signs of boundary edges count as well as those of interior ones: Lemma 2 needs both.
    """
    mesh = K.mesh
    graph = vertex_graph(mesh.F, mesh.n)
    i, b = K.interior, K.boundary

    def pieces(part: NDArray[np.int64]) -> int:
        return int(csgraph.connected_components(graph[part][:, part], directed=False)[0])

    ears = int((graph[b][:, i].sum(axis=1) == 0).sum())
    inner, rim = positive_weights(K)
    return [
        *(
            Check(f"({number}) {what} connected", "Definition 1", count == 1, count, "pieces")
            for number, what, count in (
                ("i", "the mesh is", pieces(np.arange(mesh.n))),
                ("ii", "interior vertices are", pieces(i)),
                ("iii", "boundary vertices are", pieces(b)),
            )
        ),
        Check(
            "(iv) each boundary vertex has an interior neighbour",
            "Definition 1",
            ears == 0,
            ears,
            "boundary vertices without one",
        ),
        Check(
            "interior edges are Delaunay: L_ij < 0", "Lemma 2", inner == 0, inner, "edges not so"
        ),
        Check("boundary edges have L_ij < 0", "Lemma 2", rim == 0, rim, "edges not so"),
    ]


def positive_weights(K: BoundaryOperator) -> tuple[int, int]:
    """Return the numbers of interior and boundary edges with a non-negative weight L_ij."""
    mesh = K.mesh
    L = sparse.coo_array(K.L)
    bad = (L.row < L.col) & (L.data > -SIGNIFICANT * float(np.abs(L.data).max()))
    directed = boundary_half_edges(mesh.F, mesh.n)
    on_rim = set(map(tuple, np.sort(directed, axis=1).tolist()))
    edges = list(zip(L.row[bad].tolist(), L.col[bad].tolist(), strict=True))
    rim = sum(edge in on_rim for edge in edges)
    return len(edges) - rim, rim


def statements(
    K: BoundaryOperator, plain: Trajectory, inverse: Trajectory, *, dense: bool
) -> list[Check]:
    """Return the checks of Section 4 for this K and the trajectories (23) and (30).

    With `dense`, K is formed to check the statements on its entries and its whole spectrum.
    """
    values, vectors = K.leading_eigenpairs()
    ones = np.ones(K.size)
    tested = [
        _within("K 1 = 1", "Theorem 2", np.abs(K(ones) - 1).max(), "largest error of a row sum"),
        _within("spectral radius is 1", "Theorem 2, Eq. 31", abs(values[0] - 1), "its error"),
        Check(
            "1 is simple, the next one is smaller",
            "Corollary 1",
            bool(1 - values[1] > TOLERANCE),
            float(1 - values[1]),
            "the gap 1 - lambda_2",
        ),
        Check(
            "K has rank 3 at least",
            "Theorem 3",
            bool(values[min(2, len(values) - 1)] > TOLERANCE),
            float(values[min(2, len(values) - 1)]),
            "lambda_3",
        ),
        _within(
            "centralisation: C K 1 = 0", "Remark 2", np.abs(_centred(K(ones))).max(), "its largest"
        ),
        _within(
            "centralisation keeps eigenpairs: C K C v = lambda C v",
            "Remark 2",
            _deflation_error(K, values[1:], vectors[:, 1:]),
            "largest residual of a unit vector",
        ),
    ]
    if dense:
        tested += _dense_statements(K, values)
    for which, path in (("23", plain), ("30", inverse)):
        tested += _trajectory_statements(which, path)
    return tested


def _within(name: str, source: str, error: float, meaning: str) -> Check:
    return Check(name, source, bool(error <= TOLERANCE), float(error), meaning)


def _centred(f: Real) -> Real:
    return f - f.mean(axis=0)


def _deflation_error(K: BoundaryOperator, values: Real, vectors: Real) -> float:
    V = _centred(vectors)
    V = V / np.linalg.norm(V, axis=0)
    return float(np.linalg.norm(_centred(K(V)) - V * values, axis=0).max())


def _dense_statements(K: BoundaryOperator, leading: Real) -> list[Check]:
    spectrum = K.spectrum()
    smallest = float(K.dense.min())
    C = np.eye(K.size) - 1 / K.size
    deflated = np.sort(np.linalg.eigvals(C @ K.dense).real)[::-1]
    kept = np.sort(np.append(spectrum[1:], 0.0))[::-1]
    inside = float(np.abs(spectrum[1:]).max())
    return [
        Check("K > 0", "Theorem 2", smallest > 0, smallest, "its smallest entry"),
        Check("all other eigenvalues inside", "Corollary 1", inside < 1, inside, "largest modulus"),
        _within(
            "centralisation replaces 1 by 0 and keeps the others",
            "Remark 2",
            float(np.abs(deflated - kept).max()),
            "largest change of another eigenvalue",
        ),
        _within(
            "matrix-free and dense eigenvalues agree",
            "check of this program",
            float(np.abs(leading - spectrum[: len(leading)]).max()),
            "largest difference",
        ),
    ]


def _trajectory_statements(which: str, path: Trajectory) -> list[Check]:
    rise = float(path.rises.max(initial=-np.inf))
    return [
        _within(f"({which}) stays on the circle", "Theorem 3", path.off_circle, "largest distance"),
        Check(
            f"({which}) does not collapse",
            "Theorem 3, Eq. 32",
            path.largest_gap < np.pi,
            path.largest_gap,
            "largest arc without a vertex",
        ),
        Check(
            f"({which}) lowers E_C in each iteration",
            "Remark 3" if which == "30" else "not claimed",
            rise <= TOLERANCE,
            rise,
            "largest rise of E_C",
        ),
    ]


def predicted_rate(values: Real) -> float:
    """Return the factor by which steps of (23) should shrink, from the eigenvalues of K.

    On a surface of revolution K acts on Fourier modes, with eigenvalue kappa_m on mode m: kappa_1 =
    lambda_2 = lambda_3, kappa_3 = lambda_6 = lambda_7. A displacement of the angles in mode m is
    multiplied by (kappa_(m-1) + kappa_(m+1)) / (2 kappa_1); centralisation damps m = 1, so m = 2 is
    the slowest: (1 + lambda_6 / lambda_2) / 2. On other surfaces it is an estimate.
    """
    return 0.5 * (1 + float(values[5] / values[1])) if len(values) > 5 else float("nan")
