"""Numerics of the claims: functions that `claims.toml` calls."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.conformal.boundary_iteration import pole
from cembench.conformal.laplacian import cotangent_laplacian
from cembench.conformal.metrics import angle_errors
from cembench.core.arrays import Complex
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.topology import vertex_graph
from cembench.mesh.triangle_mesh import TriangleMesh, definition_1_notices
from cembench.results.columns import significant
from cembench.results.papers import Row

from .boundary_operator import BoundaryOperator

if TYPE_CHECKING:
    import pandas as pd

#: A rise of the energy below this share of it is rounding.
ROUNDING = 1e-12


# The initial map (Section 3.1)


class Solved:
    """Solves symmetric systems, and counts factorisations and columns."""

    def __init__(self) -> None:
        self.factorisations = 0
        self.columns = 0

    def __call__(self, A: sparse.sparray, rhs: NDArray[Any]) -> NDArray[Any]:
        """Return A^-1 rhs, for rhs (k,) or (k, columns); a complex column counts as two."""
        self.factorisations += 1
        width = 1 if rhs.ndim == 1 else rhs.shape[1]
        self.columns += width * (2 if np.iscomplexobj(rhs) else 1)
        return np.asarray(Cholesky(sparse.csc_array(A)).solve(rhs))


def pinned(solve: Solved, L: sparse.csr_array, rhs: Complex, k: int) -> Complex:
    """Return the solution of L f = rhs that is 0 at k (Eq. 18 with any index, Theorem 1)."""
    u = np.delete(np.arange(L.shape[0]), k)
    f = np.zeros(L.shape[0], dtype=np.complex128)
    f[u] = solve(L[u][:, u], rhs[u])
    return f


def condensed(
    solve: Solved, L: sparse.csr_array, rhs: Complex, w: NDArray[np.int64], zero: int
) -> Complex:
    """Return the solution of the same system, 0 at `zero`, by the Schur complement (Eq. 21).

    Woodbury's formula is used: L_vv is solved for the three columns of L_vw, which leaves a system
    of order 3. It is singular, as L is; its least-norm solution is taken.
    """
    v = np.setdiff1d(np.arange(L.shape[0]), w)
    L_vw = L[v][:, w].toarray()
    inverse = solve(L[v][:, v], L_vw)
    capacity = L[w][:, w].toarray() - L_vw.T @ inverse
    f = np.empty(L.shape[0], dtype=np.complex128)
    f[w] = np.linalg.pinv(capacity, rcond=1e-10, hermitian=True) @ rhs[w]
    f[v] = -(inverse @ f[w])
    return f - f[zero]


def start_system(mesh: TriangleMesh) -> tuple[sparse.csr_array, Complex, NDArray[np.int64]]:
    """Return L, b (Eqs. 6, 14) and the corners of the triangle with the pole."""
    corners, values = pole(mesh.V, mesh.F)
    rhs = np.zeros(mesh.n, dtype=np.complex128)
    rhs[corners] = values
    return sparse.csr_array(cotangent_laplacian(mesh.V, mesh.F)), rhs, corners


def apart(f: Complex, g: Complex) -> float:
    """Return the difference of two solutions up to a constant, relative to their size."""
    difference = f - g
    difference = difference - difference.mean()
    return float(np.abs(difference).max() / np.abs(f - f.mean()).max())


def apart_by_index(mesh: TriangleMesh) -> float:
    """Return how far solutions with another vertex pinned are apart (Theorem 1)."""
    L, rhs, corners = start_system(mesh)
    indices = (mesh.n - 1, 0, int(corners[0]), int(mesh.loops[0][0]), mesh.n // 2)
    first, *others = (pinned(Solved(), L, rhs, k) for k in indices)
    return max(apart(first, f) for f in others)


def both_solved(mesh: TriangleMesh) -> tuple[float, tuple[int, int], tuple[int, int]]:
    """Return how far the solutions of (18) and (21) are apart, and what each took.

    That is factorisations and real columns solved.
    """
    L, rhs, corners = start_system(mesh)
    one, other = Solved(), Solved()
    f = pinned(one, L, rhs, mesh.n - 1)
    off = apart(f, condensed(other, L, rhs, corners, mesh.n - 1))
    return off, (one.factorisations, one.columns), (other.factorisations, other.columns)


def distortion_near_pole_and_boundary(
    mesh: TriangleMesh, share: float, least: int
) -> tuple[float, float]:
    """Return the mean angular distortion of map (12) in degrees, near p and at the boundary.

    Near p is this share of the triangles, and at least so many.
    """
    L, rhs, corners = start_system(mesh)
    f = pinned(Solved(), L, rhs, mesh.n - 1)
    errors = angle_errors(mesh, f).mean(axis=1)
    middle = mesh.V[corners].mean(axis=0)
    away = np.linalg.norm(mesh.V[mesh.F].mean(axis=1) - middle, axis=1)
    near = np.argsort(away)[: max(least, round(share * mesh.m))]
    rim = np.isin(mesh.F, mesh.loops[0]).any(axis=1)
    return float(errors[near].mean()), float(errors[rim].mean())


# The iteration matrix (Section 4)


def iteration_matrix(mesh: TriangleMesh, L: sparse.sparray | None = None) -> NDArray[np.float64]:
    """Return K (Eq. 27), dense (B, B), for a Laplacian on the edges; default: of cotangents."""
    return BoundaryOperator(mesh, L).dense


def spectrum(K: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the smallest entry of a matrix and the moduli of its two largest eigenvalues."""
    moduli = np.sort(np.abs(np.linalg.eigvals(K)))
    return float(K.min()), float(moduli[-1]), float(moduli[-2])


def like_corollary_1(tested: tuple[float, float, float]) -> bool:
    """Whether a matrix with this spectrum is positive, and 1 its simple, largest eigenvalue."""
    least, first, second = tested
    return least > 0 and abs(first - 1) < 1e-9 and second < 1


def largest_escape(K: NDArray[np.float64], sets: int = 100) -> float:
    """Return the largest distance of K f outside the convex hull of f, over sets f of size 1."""
    n = len(K)
    rng = np.random.default_rng(0)
    points = np.exp(2j * np.pi * np.arange(n) / n)[:, None]
    points = np.hstack(
        [points, rng.standard_normal((n, sets)) + 1j * rng.standard_normal((n, sets))]
    )
    points /= np.abs(points).max(axis=0)
    images = K @ points
    # A point is in the hull if it is not farther out than the points in any direction.
    turns = np.exp(-1j * np.linspace(0, 2 * np.pi, 64, endpoint=False))
    escapes = (
        (turn * images).real.max(axis=0) - (turn * points).real.max(axis=0) for turn in turns
    )
    return float(max(escape.max() for escape in escapes))


def spectra_by_weight(mesh: TriangleMesh) -> tuple[tuple[float, float, float], ...] | None:
    """Return the spectra of K for weights 1 and random ones; None without Definition 1."""
    if definition_1_notices(mesh.F, mesh.n, mesh.loops):
        return None
    return tuple(spectrum(iteration_matrix(mesh, L)) for L in _positive_laplacians(mesh))


def _positive_laplacians(mesh: TriangleMesh) -> Iterator[sparse.csc_array]:
    """Yield Laplacians on the edges of the mesh with weights 1 and with random weights."""
    edges = sparse.triu(sparse.csr_array(vertex_graph(mesh.F, mesh.n)), k=1)
    rng = np.random.default_rng(0)
    for weights in (np.ones(edges.nnz), 10 ** rng.uniform(-2, 2, edges.nnz)):
        upper = sparse.coo_array((weights, (edges.row, edges.col)), shape=edges.shape)
        W = upper + upper.T
        yield sparse.csc_array(sparse.diags_array(W.sum(axis=0)) - W)


def rises(history: Sequence[float]) -> int:
    """Return the number of steps in which the energy rises."""
    return sum(_rising(history))


def becomes_decreasing(history: Sequence[float]) -> bool:
    """Whether the energy, once it falls, falls in every further step, including the last."""
    steps = _rising(history)
    return not steps[-1] and sorted(steps, reverse=True) == steps


def steps_to_the_same(
    history: Sequence[float] | None, other: Sequence[float] | None, percent: float
) -> tuple[int, int, float] | None:
    """Return the iterations of two histories to the higher of their last energies.

    An energy within `percent` above it counts. The third value is the difference of the last ones;
    None unless there are both.
    """
    if history is None or other is None:
        return None
    goal = max(history[-1], other[-1]) * (1 + percent / 100)
    first, second = (
        next(k for k, energy in enumerate(energies) if energy <= goal)
        for energies in (history, other)
    )
    return first, second, history[-1] - other[-1]


def _rising(history: Sequence[float]) -> list[bool]:
    return [b > a * (1 + ROUNDING) for a, b in pairwise(history)]


# The printed tables, and how they were made (Section 5)


def disagreeing_rates(
    seconds: Mapping[str, Row], rates: Mapping[str, Row], algorithms: Sequence[str]
) -> tuple[int, list[str]]:
    """Return how many printed rates there are, and those that do not follow from the seconds."""
    tested, odd = 0, []
    for model, times in seconds.items():
        for algorithm in algorithms:
            other, ours, printed = times[algorithm], times["cem"], rates[model][algorithm]
            if other is None or ours is None or printed is None:
                continue
            tested += 1
            low, high = (other - 0.005) / (ours + 0.005), (other + 0.005) / (ours - 0.005)
            if not low - 1.005 <= printed <= high - 0.995:
                cases = f"{printed}, by Table 1 {other / ours - 1:.2f}"
                odd.append(f"{model} / {algorithm.upper()}: {cases}")
    return tested, odd


#: What CEM does besides reusing factorisations.
_OWN_ORDER = (
    "own order of work (solves that pass a part of the factor, and the boundary's neighbours "
    "eliminated last)"
)


def order_of_work(
    place: pd.Series, solves: pd.Series, figures: Sequence[pd.Series], chosen: pd.Series
) -> str:
    """Return a sentence on how much of CEM's lead is its order of work beside factorisations.

    Under "backslash" CEM is Algorithm 1 as printed, with whole solves. So records of both policies
    tell; those of one do not. `figures` are factorisations, right-hand sides and seconds.
    """
    import pandas as pd

    table = pd.DataFrame({one.name: one for one in figures}).astype(float)[chosen]
    under = {policy: own.set_index(place[own.index]) for policy, own in table.groupby(solves)}
    ratios = under["reuse"] / under["backslash"] if len(under) > 1 else table.iloc[:0]
    means = np.exp(np.log(ratios.dropna()).mean())
    if means.isna().any():
        return (
            f"How much of CEM's lead is its {_OWN_ORDER} only a run with both policies tells: "
            "--solves reuse,backslash"
        )
    factored, solved, seconds = (f"{100 * mean:.0f} %" for mean in means)
    return (
        f"CEM's {_OWN_ORDER} leaves it {solved} of the right-hand sides of Algorithm 1 "
        f"as printed, which 'backslash' runs, and reuse {factored} of the "
        f"factorisations; together they take {seconds} of the seconds; by that factor "
        f"its lead is not the printed algorithm's (geometric means, n = {len(ratios.dropna())})"
    )


def qiem_is_decided_here(cells: int) -> str:
    """Return a note on the steps of QIEM, if it has cells."""
    if not cells:
        return ""
    return (
        "QIEM's steps, and with them its factorisations, follow from rules for the time step and "
        "the stop that the paper leaves open and this suite decides (docs/algorithms.md)"
    )


def mean_printed(rates: Mapping[str, Row], algorithm: str) -> float:
    """Return the mean of the printed rates over an algorithm."""
    return float(np.mean([row[algorithm] for row in rates.values() if row[algorithm]]))


def rounds_lacking(lacks: int, known: int) -> str:
    """Return how many times have too few rounds, beside those known, as the end of a phrase."""
    return f"; too few rounds on {lacks}{' more' * (known > 0)}" if lacks else ""


def average_words(rates: pd.Series, printed: float, between: str) -> str:
    """Return the averages of rates beside that of the printed ones, with the interval or ""."""
    if rates.empty:
        return "no average"
    known = rates.to_numpy(float)
    geometric = np.exp(np.log(1 + known).mean()) - 1
    sure = f" ({between})" if between else ""
    return (
        f"mean {known.mean():.1f}{sure}, printed for these {printed:.1f}, geometric {geometric:.1f}"
    )


def below_a_second(faces: pd.Series, seconds: pd.Series, surface: pd.Series, many: int) -> str:
    """Return how many times are below a second, and that of the smallest surface."""
    if seconds.empty:
        return f"No time on a surface of more than {many:,} triangles in this run"
    quick, smallest = faces[seconds < 1], seconds[faces == faces.min()]
    fits = f", the largest {quick.max():,.0f} triangles" if len(quick) else ""
    fits += f" ({surface[quick.idxmax()]})" if len(quick) else ""
    return (
        f"{len(quick)} of {len(seconds)} times below a second{fits}; the smallest of these "
        f"surfaces is {surface[smallest.idxmin()]} with {faces.min():,.0f}: "
        f"{significant(smallest.min())} s"
    )


def reading_of_fdm(public: pd.Series) -> str:
    """Return a remark on how FDM was run: as its authors' public program, or corrected."""
    if public.empty:
        return ""
    where = "" if public.all() else f" on {public.sum()} of {len(public)} surfaces"
    return (
        f"FDM is its authors' public program{where}, which turns the map by a + b/2 where the "
        "middle (a + b)/2 of an edge is meant. One printed figure depends on that slip, E_C of "
        "Nefertiti, and contains it."
        if public.any()
        else "FDM is the corrected reading; fdm.public_program=true has the slip of its authors' "
        "public program, which one printed figure depends on, E_C of Nefertiti."
    )
