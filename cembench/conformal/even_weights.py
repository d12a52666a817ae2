"""Lower the angle errors of a disk map with a weight that counts all triangles alike.

The conformal energy is the integral of 2 |f_zbar|^2, which weighs a triangle by the area of its
image: those that shrink do not count, and on meshes graded over decades nearly all do. The mean of
|mu| = |f_zbar / f_z| over the triangles weighs all alike. It is lowered by Gauss-Newton steps on
the sum of w_t |f_zbar|^2 with w_t = 1 / (|f_z|^2 |mu|) of the last map (iteratively reweighted
least squares), over the interior vertices and the angles of the boundary's. The quadratic form is
that of least-squares conformal maps (Levy et al. 2002), with weights.
"""

from __future__ import annotations

import numpy as np
import scipy

from cembench.conformal.metrics import angle_errors, flipped_triangles
from cembench.conformal.planar import turns
from cembench.core.arrays import Complex, Indices, Real
from cembench.core.clock import phase
from cembench.core.errors import NotPositiveDefinite
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.triangle_mesh import DiskMesh

#: A step counts if it lowers the mean angle error by this share.
MIN_GAIN = 1e-3
#: |mu| below this share of its median weighs as much as that.
FLOOR = 0.1
#: Multiple of the matrix's diagonal that is added: Moebius maps cost next to nothing.
DAMPING = 1e-6
#: A step is halved so often at most.
HALVINGS = 6


def evened(mesh: DiskMesh, uv: Complex, steps: int) -> tuple[Complex, int]:
    """Return a map to the disk with a smaller mean angle error, and the number of steps taken.

    Each step lowers the mean angle error, by a share of :data:`MIN_GAIN` at least, and has no more
    folds or backward arcs than before; the boundary stays on the circle.

    Parameters
    ----------
    mesh : DiskMesh
        The surface.
    uv : complex (n,)
        Its map, boundary on the unit circle.
    steps : int
        The most steps; each factors a matrix of order 2 n once.

    Returns
    -------
    uv : complex (n,)
        The map.
    taken : int
        The number of steps.

    Examples
    --------
    >>> import cembench
    >>> mesh = cembench.surface("hemi-ellipsoid", 600)
    >>> before = cembench.parameterize(mesh, "direct-cem").z
    >>> after, taken = evened(mesh, before, 2)
    >>> bool(angle_errors(mesh, after).mean() <= angle_errors(mesh, before).mean())
    True
    """
    with phase("assembly"):
        gradient = _gradients(mesh)
        rows, columns = np.repeat(np.arange(mesh.m), 3), mesh.F.ravel()
        f_z, f_zbar = (
            scipy.sparse.csr_array(((one / 2).ravel(), (rows, columns)), shape=(mesh.m, mesh.n))
            for one in (np.conj(gradient), gradient)
        )
        faults, error = _faults(mesh, uv), float(angle_errors(mesh, uv).mean())
    for taken in range(steps):
        with phase("assembly"), np.errstate(divide="ignore", invalid="ignore"):
            growth = np.abs(f_z @ uv)
            mu = np.abs(f_zbar @ uv) / growth
            weight = 1 / (growth**2 * np.maximum(mu, FLOOR * np.median(mu)))
            if not np.isfinite(weight).all():  # conformal, or a triangle has collapsed
                return uv, taken
            root = scipy.sparse.diags_array(np.sqrt(weight / weight.max()))
        try:
            step = _step(mesh, uv, scipy.sparse.csr_array(root @ f_zbar))
        except NotPositiveDefinite:
            return uv, taken
        for halved in range(HALVINGS):
            tried = _moved(mesh, uv, step / 2**halved)
            new = float(angle_errors(mesh, tried).mean())
            if new < (1 - MIN_GAIN) * error and (_faults(mesh, tried) <= faults).all():
                break
        else:
            return uv, taken
        uv, error = tried, new
    return uv, steps


def _faults(mesh: DiskMesh, uv: Complex) -> Indices:
    """Return the number of folds, and of arcs of the boundary that go backward."""
    return np.array([flipped_triangles(mesh, uv), turns(uv[mesh.boundary])[2]])


def _gradients(mesh: DiskMesh) -> Complex:
    """Return the gradients of the hat functions of each triangle's corners (m, 3).

    Gradients are complex numbers in a plane of the triangle: i times the opposite edge over twice
    the area.
    """
    a, b, c = (mesh.V[mesh.F[:, k]] for k in range(3))
    along = np.linalg.norm(b - a, axis=1)
    x = (b - a) / along[:, None]
    foot = np.einsum("td,td->t", c - a, x)
    height = np.linalg.norm(c - a - foot[:, None] * x, axis=1)
    w = np.stack([0 * along, along, foot + 1j * height], axis=1)
    return 1j * (np.roll(w, -2, axis=1) - np.roll(w, -1, axis=1)) / (along * height)[:, None]


def _step(mesh: DiskMesh, uv: Complex, D: scipy.sparse.csr_array) -> Real:
    """Return the step (2 n - b,) that lowers |D uv|^2 most: of the interior, and of angles."""
    with phase("assembly"):
        turned = scipy.sparse.csr_array(D[:, mesh.boundary] * (1j * uv[mesh.boundary]))
        inside = D[:, mesh.interior]
        J = scipy.sparse.csr_array(
            scipy.sparse.block_array(
                [
                    [inside.real, -inside.imag, turned.real],
                    [inside.imag, inside.real, turned.imag],
                ]
            )
        )
        residual = D @ uv
        right = -(J.T @ np.concatenate([residual.real, residual.imag]))
        normal = scipy.sparse.csc_array(J.T @ J)
        normal += DAMPING * scipy.sparse.diags_array(normal.diagonal())
    return np.asarray(Cholesky(scipy.sparse.csc_array(normal)).solve(right))


def _moved(mesh: DiskMesh, uv: Complex, step: Real) -> Complex:
    """Return a map after a step of :func:`_step`."""
    k, moved = len(mesh.interior), uv.copy()
    moved[mesh.interior] += step[:k] + 1j * step[k : 2 * k]
    moved[mesh.boundary] *= np.exp(1j * step[2 * k :])
    return moved
