"""Claims about meshes, the theory, and surfaces with holes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.conformal.laplacian import cotangent_laplacian
from cembench.core.notices import Notice, NoticeKind, of_kind
from cembench.mesh.topology import vertex_graph
from cembench.mesh.triangle_mesh import TriangleMesh, definition_1_notices
from cembench.report.content.claims import Found, Inspections
from cembench.report.content.evidence import Evidence, MeasuredSurface

#: Rounding tolerance for points outside a convex hull of size 1.
ROUNDING = 1e-12
#: Maximum number of vertices for the dense eigenvalues of K.
DENSE = 3_000
NO_SURFACE = f"This run stores no surface of at most {DENSE:,} vertices."


def delaunay(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the premise that the meshes are Delaunay."""
    surfaces = evidence.surfaces
    good = [s for s in surfaces if s.non_delaunay_share == 0]
    odd = [f"{s.title}: {s.non_delaunay_share:.1%}" for s in surfaces if s.non_delaunay_share]
    figures = f"{len(good)} of {len(surfaces)} surfaces of the run"
    figures += f"; edges that are not Delaunay: {'; '.join(odd)}" if odd else ""
    return Found(len(good), len(surfaces), figures, surfaces)


def well_conditioned(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that meshes satisfy Definition 1."""
    notices: dict[str, tuple[Notice, ...]] = {}
    for record in evidence.records:
        notices[record.cell.mesh_hash] = record.mesh.notices
    bad = {
        s.title: of_kind(NoticeKind.DEFINITION_1, notices[s.mesh_hash]) for s in evidence.surfaces
    }
    broken = {title: found for title, found in bad.items() if found}
    n = len(evidence.surfaces)
    figures = f"{n - len(broken)} of {n} surfaces of the run" + "".join(
        f"; {title}: {', '.join(map(str, found))}" for title, found in broken.items()
    )
    return Found(n - len(broken), n, figures, evidence.surfaces)


def iteration_matrix(evidence: Evidence, inspections: Inspections) -> Found:
    """Test that K is positive and 1 is its simple, largest eigenvalue (Corollary 1)."""
    held, tested = 0, []
    parts = []
    for surface in evidence.surfaces:
        mesh = evidence.mesh(surface) if surface.vertices <= DENSE else None
        if mesh is None or len(mesh.loops) != 1:
            continue
        tested.append(surface)
        smallest, first, second = spectrum_of_iteration(mesh)
        good = smallest > 0 and abs(first - 1) < 1e-9 and second < 1
        held += good
        parts.append(
            f"{surface.title}: rho = {first:.12f}, next {second:.6f}, least entry {smallest:.1e}"
        )
    return Found(held, len(tested), "; ".join(parts) or NO_SURFACE, tested)


def spectrum_of_iteration(mesh: TriangleMesh) -> tuple[float, float, float]:
    """Return the smallest entry of K (Eq. 27) and the moduli of its two largest eigenvalues."""
    return _spectrum(iteration_matrix_of(mesh, cotangent_laplacian(mesh.V, mesh.F)))


def iteration_matrix_of(mesh: TriangleMesh, L: sparse.sparray) -> NDArray[np.float64]:
    """Return K (Eq. 27), dense (B, B), for any Laplacian on the edges of the mesh."""
    dense = L.toarray()
    i, b = mesh.interior, mesh.loops[0]
    inner = np.linalg.solve(dense[np.ix_(i, i)], dense[np.ix_(i, b)])
    return np.linalg.solve(dense[np.ix_(b, b)], dense[np.ix_(i, b)].T @ inner)


def _spectrum(K: NDArray[np.float64]) -> tuple[float, float, float]:
    moduli = np.sort(np.abs(np.linalg.eigvals(K)))
    return float(K.min()), float(moduli[-1]), float(moduli[-2])


def _small_disks(evidence: Evidence) -> Iterator[tuple[MeasuredSurface, TriangleMesh]]:
    for surface in evidence.surfaces:
        mesh = evidence.mesh(surface) if surface.vertices <= DENSE else None
        if mesh is not None and len(mesh.loops) == 1 and len(mesh.interior):
            yield surface, mesh


def convex_hull(evidence: Evidence, inspections: Inspections) -> Found:
    """Test that K maps boundary points into their convex hull (Remark 4)."""
    out: dict[MeasuredSurface, float] = {}
    for surface, mesh in _small_disks(evidence):
        K = iteration_matrix_of(mesh, cotangent_laplacian(mesh.V, mesh.F))
        out[surface] = largest_escape(K)
    held = sum(escape <= ROUNDING for escape in out.values())
    listed = "; ".join(f"{s.title}: {escape:.1e}" for s, escape in out.items())
    return Found(held, len(out), listed or NO_SURFACE, list(out))


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
    found = ((turn * images).real.max(axis=0) - (turn * points).real.max(axis=0) for turn in turns)
    return float(max(escape.max() for escape in found))


def other_weights(evidence: Evidence, inspections: Inspections) -> Found:
    """Test that Corollary 1 holds for any positive weights (Remark 5)."""
    held, tested, parts = 0, [], []
    for surface, mesh in _small_disks(evidence):
        if definition_1_notices(mesh.F, mesh.n, mesh.loops):
            continue
        tested.append(surface)
        found = [_spectrum(iteration_matrix_of(mesh, L)) for L in _positive_laplacians(mesh)]
        good = all(
            least > 0 and abs(first - 1) < 1e-9 and second < 1 for least, first, second in found
        )
        held += good
        parts.append(
            f"{surface.title}: next eigenvalue {', '.join(f'{second:.4f}' for *_, second in found)}"
        )
    none = f"This run stores no such surface of at most {DENSE:,} vertices."
    return Found(held, len(tested), "; ".join(parts) or none, tested)


def _positive_laplacians(mesh: TriangleMesh) -> Iterator[sparse.csc_array]:
    """Yield Laplacians on the edges of the mesh with weights 1 and with random weights."""
    edges = sparse.triu(sparse.csr_array(vertex_graph(mesh.F, mesh.n)), k=1)
    rng = np.random.default_rng(0)
    for weights in (np.ones(edges.nnz), 10 ** rng.uniform(-2, 2, edges.nnz)):
        upper = sparse.coo_array((weights, (edges.row, edges.col)), shape=edges.shape)
        W = upper + upper.T
        yield sparse.csc_array(sparse.diags_array(W.sum(axis=0)) - W)


def circular_holes(evidence: Evidence, inspections: Inspections) -> Found:
    """Test that the generalized CEM maps surfaces with holes to a disk with circular holes."""
    found = [
        (r, float(off))
        for r in evidence.records
        if r.target == "circular holes" and r.outcome.status == "ok"
        if (off := r.outcome.metrics.get("boundary_circularity")) is not None
    ]
    round_ = sum(off < 1e-2 for _, off in found)
    exhibits = [e.title for e in evidence.exhibits if e.figure in ("Figure 1", "Figure 7")]
    shown = f" The exhibits show it: {', '.join(exhibits)}." if exhibits else ""
    listed = "; ".join(f"{r.cell.mesh} / {r.title}: {off:.1e}" for r, off in found)
    figures = (listed or "No algorithm for surfaces with holes in this run.") + shown
    hashes = {r.cell.mesh_hash for r, _ in found}
    surfaces = [s for s in evidence.surfaces if s.mesh_hash in hashes]
    return Found(round_, len(found), figures, surfaces)
