"""The conformal map of a surface with one hole to a concentric annulus, by its logarithm.

Along a tube, a map to the disk shrinks exponentially: details at radius r add r^2 to E_C, and at
radius 1e-8 nothing that doubles hold. The logarithm maps the surface to a cylinder, where each ring
of the tube counts as much as any other. It is -h u + i v: u is harmonic, 0 on the outer boundary
and 1 on the hole; v is its conjugate, a harmonic angle that grows by 2 pi around the hole and is
free on the boundary; h = 2 pi / (u^T L u) makes the two conformal to each other (Gu and Yau 2008,
Computational Conformal Geometry, harmonic 1-forms).
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.conformal.folds import in_order
from cembench.conformal.harmonic import HarmonicExtension
from cembench.conformal.laplacian import laplacian
from cembench.core.clock import phase
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.cut import Cut, cut_open
from cembench.mesh.triangle_mesh import HoledMesh

Complex = NDArray[np.complex128]
Loop = NDArray[np.int64]


def annulus_map(mesh: HoledMesh, outer: Loop, hole: Loop) -> Complex:
    """Map a surface with one hole to the annulus exp(-h) <= |z| <= 1.

    Parameters
    ----------
    mesh : HoledMesh
        The surface.
    outer, hole : int64 arrays
        Its two boundary loops, with the surface on their left.

    Returns
    -------
    complex (n,)
        The map. Both boundaries are in order on their circles; triangles may be folded.

    Raises
    ------
    AlgorithmFailed
        A boundary does not go around its circle once.

    Examples
    --------
    >>> import cembench
    >>> ring = cembench.surface("catenoid-ring", 400)
    >>> outer, (hole,) = ring.outer_and_holes()
    >>> z = annulus_map(ring, outer, hole)
    >>> bool(np.ptp(np.abs(z[hole])) < 1e-12)
    True

    """
    with phase("boundary"):
        cut = cut_open(mesh)
        jump = 2 * np.pi * _across(cut, outer, hole)
    L_cut = laplacian(cut.mesh, delaunay=True)
    with phase("assembly"):
        copies = np.arange(cut.mesh.n)
        glue = scipy.sparse.csr_array((np.ones(len(copies)), (copies, cut.origin)))
        L = scipy.sparse.csc_array(glue.T @ L_cut @ glue)
        b = np.concatenate([outer, hole])
        on_hole = np.repeat([0.0, 1.0], [len(outer), len(hole)])
        others = np.delete(np.arange(mesh.n), outer[0])
    extension = HarmonicExtension(L, b)
    u = extension(on_hole)
    v = np.zeros(mesh.n)
    v[others] = Cholesky(L[others][:, others]).solve(-(glue.T @ (L_cut @ jump))[others])
    circles = np.exp(1j * v)
    ordered = np.concatenate([in_order(circles[outer]), in_order(circles[hole].conj()).conj()])
    moved = np.angle(ordered / circles[b])
    if np.abs(moved).max() > 0:
        v += extension(moved)
    modulus = 2 * np.pi / (u @ (L @ u))
    image: Complex = np.exp(-modulus * u + 1j * v)
    return image


def _across(cut: Cut, outer: Loop, hole: Loop) -> NDArray[np.float64]:
    """Return 1 for the vertices of a cut annulus on the bank after a turn, 0 for all others."""
    b = cut.mesh.boundary
    along = cut.origin[b]
    on_outer, on_hole = np.isin(along, outer), np.isin(along, hole)
    begins = int(np.flatnonzero(on_outer & ~np.roll(on_outer, 1))[0])
    b, on_outer, on_hole = (np.roll(part, -begins) for part in (b, on_outer, on_hole))
    bank = b[np.flatnonzero(on_outer)[-1] : np.flatnonzero(on_hole)[0] + 1]
    after = np.zeros(cut.mesh.n)
    after[bank] = 1
    return after
