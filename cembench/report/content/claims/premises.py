"""Claims about the meshes, the theory, and surfaces with holes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cembench.conformal.laplacian import cotangent_laplacian
from cembench.core.notices import Notice, NoticeKind, of_kind
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.report.content.claims.verdicts import tested_on, verdict_of
from cembench.report.content.evidence import Evidence
from cembench.report.content.inspection import Inspection
from cembench.report.document import Claim

Inspections = Mapping[str, Inspection]
#: The eigenvalues of K are computed densely, on surfaces up to so many vertices.
DENSE = 3_000


def delaunay(evidence: Evidence, inspections: Inspections) -> Claim:
    """Are the meshes Delaunay, as the paper supposes?"""
    surfaces = evidence.surfaces
    good = [s for s in surfaces if s.non_delaunay_share == 0]
    odd = [f"{s.title}: {s.non_delaunay_share:.1%}" for s in surfaces if s.non_delaunay_share]
    return Claim(
        "delaunay",
        "Hereafter, we suppose that M is a well-conditioned Delaunay triangulation mesh",
        "Section 2",
        "No interior edge has opposite angles that sum to more than 180 degrees: all off-diagonal "
        "entries of L are negative or zero.",
        f"{len(good)} of {len(surfaces)} surfaces of the run"
        + (f"; edges that are not Delaunay: {'; '.join(odd)}" if odd else ""),
        verdict_of(len(good), len(surfaces)),
        f"{tested_on(surfaces)} Stand-ins are made Delaunay on purpose. On the paper's own models "
        "Nefertiti, Chinese Lion and Human Brain about 4 to 5 % of the edges are not.",
    )


def well_conditioned(evidence: Evidence, inspections: Inspections) -> Claim:
    """Do the meshes satisfy Definition 1?"""
    notices: dict[str, tuple[Notice, ...]] = {}
    for record in evidence.records:
        notices[record.cell.mesh_hash] = record.mesh.notices
    bad = {
        s.title: of_kind(NoticeKind.DEFINITION_1, notices[s.mesh_hash]) for s in evidence.surfaces
    }
    broken = {title: found for title, found in bad.items() if found}
    n = len(evidence.surfaces)
    return Claim(
        "well-conditioned",
        "In practical applications, the triangular meshes of the simply-connected open surfaces "
        "are usually well-conditioned as in Definition 1",
        "Section 4, before Corollary 1",
        "Each surface satisfies (i) to (iv) of Definition 1.",
        f"{n - len(broken)} of {n} surfaces of the run"
        + "".join(f"; {title}: {', '.join(map(str, found))}" for title, found in broken.items()),
        verdict_of(n - len(broken), n),
        tested_on(evidence.surfaces),
    )


def iteration_matrix(evidence: Evidence, inspections: Inspections) -> Claim:
    """Is K positive, with spectral radius 1 attained once (Corollary 1)?"""
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
    return Claim(
        "iteration-matrix",
        "rho(K) = 1 is the largest eigenvalue of K with algebraic multiplicity one, and all the "
        "other eigenvalues are strictly smaller than 1 in modulus",
        "Corollary 1; K is positive by Theorem 2",
        f"All eigenvalues of K (Eq. 27) on every surface of the run with at most {DENSE:,} "
        "vertices, and the sign of its entries.",
        "; ".join(parts) or f"No surface of at most {DENSE:,} vertices is kept in this run.",
        verdict_of(held, len(tested)),
        tested_on(tested),
    )


def spectrum_of_iteration(mesh: TriangleMesh) -> tuple[float, float, float]:
    """The smallest entry of K (Eq. 27), and the moduli of its two largest eigenvalues."""
    L = cotangent_laplacian(mesh.V, mesh.F).toarray()
    i, b = mesh.interior, mesh.loops[0]
    inner = np.linalg.solve(L[np.ix_(i, i)], L[np.ix_(i, b)])
    K = np.linalg.solve(L[np.ix_(b, b)], L[np.ix_(i, b)].T @ inner)
    moduli = np.sort(np.abs(np.linalg.eigvals(K)))
    return float(K.min()), float(moduli[-1]), float(moduli[-2])


def circular_holes(evidence: Evidence, inspections: Inspections) -> Claim:
    """Does the generalized CEM map a surface with holes to a disk with circular holes?"""
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
    return Claim(
        "circular-holes",
        "the generalized CEM algorithm is aimed to find a conformal map f that maps M to a unit "
        "disk with circular holes",
        "Section 3.3",
        "Every boundary's image lies within 1 % of its radius from a circle.",
        (listed or "No algorithm for surfaces with holes in this run.") + shown,
        verdict_of(round_, len(found)),
        tested_on(
            [s for s in evidence.surfaces if s.mesh_hash in {r.cell.mesh_hash for r, _ in found}]
        ),
    )
