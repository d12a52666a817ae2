"""Least squares conformal map: the conformal energy minimised with a free boundary."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.folds import interior_without_folds
from cembench.conformal.laplacian import laplacian
from cembench.conformal.planar import polygon_area
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

Complex = NDArray[np.complex128]


@algorithm(
    "lscm",
    title="LSCM",
    target="free boundary",
    source="Levy, Petitjean, Ray & Maillot 2002; Desbrun, Meyer & Alliez 2002",
)
def lscm(mesh: DiskMesh, *, delaunay: bool = False) -> Parameterization:
    """Which free-boundary map has the least conformal energy once two vertices are pinned?

    E_C = E_D - A (Eq. 7) is a quadratic form in (u, v); pinning two vertices makes it positive
    definite, and one Cholesky solve minimises it. Decided here: the pins are the boundary vertex
    farthest from the mean vertex and the boundary vertex farthest from that one, laid at -1 and 1;
    the image is then scaled to area pi, so that its energies stand beside those of a disk, though
    its angles are lower for want of a boundary condition. Where negative cotangent weights fold the
    interior, patches around the folds are laid out anew (`fold_repairs`); where that does not help,
    as with a boundary that crosses itself, folds stay.
    """
    L = laplacian(mesh, delaunay=delaunay)
    n, pins = mesh.n, far_apart(mesh)
    with phase("assembly"):
        Q = sparse.csr_array(_conformal_energy_form(L, mesh.boundary))
        fixed = np.concatenate([pins, pins + n])
        free = np.delete(np.arange(2 * n), fixed)
        x = np.zeros(2 * n)
        x[fixed] = [-1.0, 1.0, 0.0, 0.0]
        rows = Q[free]
        Q_ff, Q_fp = rows[:, free], rows[:, fixed]
    x[free] = Cholesky(Q_ff).solve(-(Q_fp @ x[fixed]))
    uv = x[:n] + 1j * x[n:]
    area = polygon_area(uv[mesh.boundary])
    if not area > 0:
        raise AlgorithmFailed(
            f"the image of the boundary encloses an area of {area:.3g}, which is not positive: "
            "the map has collapsed between its two pins"
        )
    uv *= np.sqrt(np.pi / area)
    uv, repair = accepted_repair(mesh, uv, interior_without_folds(mesh, uv))
    return Parameterization(uv, extras={"pins": pins.tolist(), **repair})


def far_apart(mesh: DiskMesh) -> NDArray[np.int64]:
    """Return two boundary vertices: the farthest from the mean vertex, the farthest from that."""
    loop = mesh.V[mesh.boundary]
    first = int(np.argmax(np.linalg.norm(loop - mesh.V.mean(axis=0), axis=1)))
    second = int(np.argmax(np.linalg.norm(loop - loop[first], axis=1)))
    return mesh.boundary[[first, second]]


def _conformal_energy_form(L: sparse.csc_array, b: NDArray[np.int64]) -> sparse.csc_array:
    """Q with E_C = x^T Q x / 2 for x = (u, v): diag(L, L) less the Hessian of the area (Eq. 8)."""
    after = np.roll(b, -1)
    half = np.full(len(b), 0.5)
    D = sparse.coo_array((np.r_[half, -half], (np.r_[b, after], np.r_[after, b])), shape=L.shape)
    return sparse.block_array([[L, -D], [D, L]], format="csc")
