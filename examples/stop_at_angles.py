"""CEM that stops when the angles no longer improve, a complete solver in one file.

The paper's iteration, from the circle by arc length, with another stopping rule:

    cembench validate examples/stop_at_angles.py
"""

from typing import Annotated

import numpy as np
from pydantic import Field
from scipy import sparse

from cembench import AlgorithmFailed, DiskMesh, Parameterization, algorithm
from cembench.conformal.harmonic import arc_length_circle
from cembench.conformal.laplacian import laplacian
from cembench.conformal.metrics import corner_angles
from cembench.linear_algebra.cholesky import Cholesky


@algorithm("stop-at-angles", title="CEM by angles", target="disk")
def stop_at_angles(
    mesh: DiskMesh,
    *,
    least_gain: Annotated[float, Field(gt=0)] = 1e-3,
    max_iterations: Annotated[int, Field(ge=1)] = 200,
) -> Parameterization:
    """Stop CEM when the angle errors no longer fall.

    The iteration (30), (24), (25), (22) ends after the first step that lowers the mean angle error
    by less than a relative `least_gain`.
    """
    i, b = mesh.interior, mesh.boundary
    if not len(i):
        raise AlgorithmFailed("the mesh has no interior vertex")
    L = sparse.csr_array(laplacian(mesh))
    L_ib, L_bi = L[i][:, b], L[b][:, i]
    inside, ring = Cholesky(L[i][:, i]), Cholesky(L[b][:, b])
    angles = corner_angles(mesh.V, mesh.F)

    uv = np.empty(mesh.n, dtype=np.complex128)
    uv[b] = arc_length_circle(mesh)
    uv[i] = inside.solve(-(L_ib @ uv[b]))  # Eq. 22
    error = np.abs(corner_angles(uv, mesh.F) - angles).mean()
    iterations = 0
    while iterations < max_iterations:
        following = np.empty_like(uv)
        following[b] = on_circle(ring.solve(-(L_bi @ inverted(uv[i]))))
        following[i] = inside.solve(-(L_ib @ following[b]))
        before, error = error, np.abs(corner_angles(following, mesh.F) - angles).mean()
        if error > before:
            break
        uv, iterations = following, iterations + 1
        if before - error < least_gain * before:
            break
    return Parameterization(uv, iterations)


def inverted(f: np.ndarray) -> np.ndarray:
    """Each value over its modulus squared (Eq. 30)."""
    return f / np.maximum(np.abs(f) ** 2, np.finfo(float).tiny)


def on_circle(f: np.ndarray) -> np.ndarray:
    """Centralise and normalise (Eqs. 24, 25)."""
    f = f - f.mean()
    if not np.abs(f).min() > 0:
        raise AlgorithmFailed("a boundary vertex lies at the centre")
    return f / np.abs(f)
