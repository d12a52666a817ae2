"""Harmonic functions on a surface with holes, and their conjugates.

u_i is 1 on hole i and 0 on all other boundaries. The conjugates v_i are angles that are free on the
boundaries: v_i grows by 2 pi around hole i and by 0 around all other holes (Gu and Yau 2008,
Computational Conformal Geometry, harmonic 1-forms). Both span the same space on a smooth surface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from cembench.conformal.harmonic import HarmonicExtension
from cembench.conformal.laplacian import laplacian
from cembench.core.arrays import Loop, Real
from cembench.core.clock import phase
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.cut import DiskCut, cut_open
from cembench.mesh.triangle_mesh import HoledMesh


@dataclass(frozen=True)
class ConjugateFunctions:
    """Harmonic functions of k holes, their conjugates, and the Dirichlet energies of both.

    Parameters
    ----------
    u, v : float (n, k)
        The functions, and the conjugates: v with `jump` added on the cut surface.
    cut : DiskCut
        The surface cut open along curves that join all boundaries.
    boundary : int64 (b,)
        The boundary of the cut surface, from the start of a piece of the outer boundary.
    jump : float (n', k)
        Multiples of 2 pi on the banks of the cut, else 0.
    extension : HarmonicExtension
        Of values on all boundaries, the outer one first.
    capacity, circulation : float (k, k)
        Products of the gradients of u, and of v, integrated: upper bounds, as quadratic forms, of
        the surface's capacities C, and of 4 pi^2 times their inverse.
    """

    u: Real
    v: Real
    cut: DiskCut
    boundary: Loop
    jump: Real
    extension: HarmonicExtension
    capacity: Real
    circulation: Real


def conjugate_functions(mesh: HoledMesh, outer: Loop, holes: Sequence[Loop]) -> ConjugateFunctions:
    """Return the harmonic functions of the holes and their conjugates, by linear elements.

    The elements are those of the intrinsic Delaunay triangulation of the cut surface.

    Parameters
    ----------
    mesh : HoledMesh
        The surface.
    outer, holes : int64 arrays
        Its boundary loops, with the surface on their left.

    Returns
    -------
    ConjugateFunctions
        The functions with their energies.

    Examples
    --------
    >>> import cembench
    >>> ring = cembench.surface("catenoid-ring", 400)
    >>> pair = conjugate_functions(ring, *ring.outer_and_holes())
    >>> bool(pair.capacity[0, 0] * pair.circulation[0, 0] > 4 * np.pi**2)
    True
    """
    with phase("boundary"):
        cut = cut_open(mesh)
        boundary, jump = _jumps(cut, outer, holes)
        jump = 2 * np.pi * jump
    L_cut = laplacian(cut.mesh, delaunay=True)
    with phase("assembly"):
        copies = np.arange(cut.mesh.n)
        glue = scipy.sparse.csr_array((np.ones(len(copies)), (copies, cut.origin)))
        L = scipy.sparse.csc_array(glue.T @ L_cut @ glue)
        on_loop = np.repeat(np.arange(-1, len(holes)), [len(outer), *map(len, holes)])
        others = np.delete(np.arange(mesh.n), outer[0])
    extension = HarmonicExtension(L, np.concatenate([outer, *holes]))
    u, v = np.empty((mesh.n, len(holes))), np.zeros((mesh.n, len(holes)))
    free = Cholesky(L[others][:, others])
    for k in range(len(holes)):
        u[:, k] = extension((on_loop == k).astype(float))
        v[others, k] = free.solve(-(glue.T @ (L_cut @ jump[:, k]))[others])
    lifted = v[cut.origin] + jump
    energies = u.T @ (L @ u), lifted.T @ (L_cut @ lifted)
    return ConjugateFunctions(u, v, cut, boundary, jump, extension, *energies)


def _jumps(cut: DiskCut, outer: Loop, holes: Sequence[Loop]) -> tuple[Loop, Real]:
    """Return the boundary of a cut surface, and functions on the cut surface (n', k).

    Function i is constant along each bank and each boundary but for two steps: up by 1 on an edge
    of the outer boundary, and down on an edge of hole i. Across a cut it jumps by a constant, so
    its gradient, on the surface, is a closed form of period 1 around both.
    """
    b = cut.mesh.boundary
    loop = np.full(int(cut.origin.max()) + 1, -1)
    after = np.full(len(loop), -1)
    for k, one in enumerate((outer, *holes)):
        loop[one], after[one] = k, np.roll(one, -1)
    on_outer = loop[cut.origin[b]] == 0
    b = np.roll(b, -int(np.flatnonzero(on_outer & ~np.roll(on_outer, 1))[0]))
    start = cut.origin[b]
    along = np.flatnonzero(after[start] == np.roll(start, -1))  # edges that were not cut
    steps = np.zeros((len(b), len(holes)))
    own = along[loop[start[along]] == 0]
    # The end of the first piece of the outer boundary: where an edge is a cut one, or of a hole.
    steps[own[np.argmax(np.diff(own, append=len(b) + 1) > 1)]] = 1
    for k in range(len(holes)):
        steps[along[loop[start[along]] == k + 1][0], k] -= 1
    jump = np.zeros((cut.mesh.n, len(holes)))
    jump[np.roll(b, -1)] = np.cumsum(steps, axis=0)
    return b, jump
