"""Claims about CEM's initial linear map (Section 3.1)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.conformal.boundary_iteration import pole
from cembench.conformal.laplacian import cotangent_laplacian
from cembench.conformal.metrics import angle_errors
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.report.content.claims import Found, Inspections
from cembench.report.content.evidence import Evidence, MeasuredSurface

Complex = NDArray[np.complex128]
#: Maximum number of vertices of surfaces on which the initial map is recomputed.
MOST_VERTICES = 20_000
NO_DISK = f"This run stores no disk of at most {MOST_VERTICES:,} vertices."
#: Solutions are equal if they differ by less, relative to their size.
SAME = 1e-8
#: Share of the triangles that count as near p, and their minimum number.
NEAR, LEAST_NEAR = 0.01, 10


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


def _disks(evidence: Evidence) -> Iterator[tuple[MeasuredSurface, TriangleMesh]]:
    for surface in evidence.surfaces:
        mesh = evidence.mesh(surface) if surface.vertices <= MOST_VERTICES else None
        if mesh is not None and len(mesh.loops) == 1:
            yield surface, mesh


def any_index(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that any vertex can be pinned (Theorem 1)."""
    off: dict[MeasuredSurface, float] = {}
    for surface, mesh in _disks(evidence):
        L, rhs, corners = start_system(mesh)
        indices = (mesh.n - 1, 0, int(corners[0]), int(mesh.loops[0][0]), mesh.n // 2)
        first, *others = (pinned(Solved(), L, rhs, k) for k in indices)
        off[surface] = max(apart(first, f) for f in others)
    held = sum(value <= SAME for value in off.values())
    figures = (
        f"true on {held} of {len(off)} surfaces; the largest difference is {max(off.values()):.1e}"
        if off
        else NO_DISK
    )
    return Found(held, len(off), figures, list(off))


def schur_complement(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that (21) gives the same as (18) with more work."""
    off: dict[MeasuredSurface, float] = {}
    less, work = 0, ""
    for surface, mesh in _disks(evidence):
        L, rhs, corners = start_system(mesh)
        one, other = Solved(), Solved()
        f = pinned(one, L, rhs, mesh.n - 1)
        off[surface] = apart(f, condensed(other, L, rhs, corners, mesh.n - 1))
        less += one.factorisations <= other.factorisations and one.columns < other.columns
        work = (
            f"; (18) takes {one.factorisations} factorisation and {one.columns} real columns "
            f"solved, (21) {other.factorisations} and {other.columns}"
        )
    same = sum(value <= SAME for value in off.values())
    figures = (
        f"the same on {same} of {len(off)} surfaces, at most {max(off.values()):.1e} apart{work}"
        if off
        else NO_DISK
    )
    return Found(min(same, less), len(off), figures, list(off))


def distortion_near_pole(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that the distortion of map (12) is large near p and small at the boundary."""
    ratios: dict[MeasuredSurface, tuple[float, float]] = {}
    for surface, mesh in _disks(evidence):
        ratios[surface] = distortion_near_pole_and_boundary(mesh)
    held = sum(near > rim for near, rim in ratios.values())
    listed = "; ".join(
        f"{s.title}: {near:.1f} near p, {rim:.2f} at the boundary"
        for s, (near, rim) in ratios.items()
    )
    return Found(held, len(ratios), listed or NO_DISK, list(ratios))


def distortion_near_pole_and_boundary(mesh: TriangleMesh) -> tuple[float, float]:
    """Return the mean angular distortion of map (12) in degrees, near p and at the boundary."""
    L, rhs, corners = start_system(mesh)
    f = pinned(Solved(), L, rhs, mesh.n - 1)
    errors = angle_errors(mesh, f).mean(axis=1)
    middle = mesh.V[corners].mean(axis=0)
    away = np.linalg.norm(mesh.V[mesh.F].mean(axis=1) - middle, axis=1)
    near = np.argsort(away)[: max(LEAST_NEAR, round(NEAR * mesh.m))]
    rim = np.isin(mesh.F, mesh.loops[0]).any(axis=1)
    return float(errors[near].mean()), float(errors[rim].mean())
