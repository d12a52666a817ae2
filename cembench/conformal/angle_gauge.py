"""The Moebius gauge of a disk map in which its angle errors are smallest.

A conformal map to the disk is determined up to a Moebius map of the disk, and none of these changes
an angle. The piecewise linear map through the same vertices does change: triangles that are large
in the disk are bent more. So the gauge decides angle errors, and what an algorithm ends in need not
be the best.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.metrics import SampledAngleError, angle_errors, flipped_triangles
from cembench.mesh.triangle_mesh import DiskMesh

Complex = NDArray[np.complex128]

#: The search begins with moves of the disk's centre by this hyperbolic length ...
FIRST_MOVE = 0.3
#: ... ends with moves by this, or where the error changes by this share of itself ...
LAST_MOVE, LEAST_CHANGE = 0.01, 1e-4
#: ... and asks for the error of so many maps at most.
MOST_MAPS = 100


def angle_gauge(mesh: DiskMesh, uv: Complex) -> Complex:
    """Return a disk map in the Moebius gauge in which its mean angle error is smallest.

    The search (Nelder & Mead 1965) measures a sample of the triangles. The gauge that it ends in is
    taken if it lowers the error over all triangles and folds no more of them.

    Parameters
    ----------
    mesh : DiskMesh
        The surface.
    uv : complex (n,)
        Its map, boundary on the unit circle.

    Returns
    -------
    complex (n,)
        The map after a Moebius map of the disk, or `uv` itself.

    Examples
    --------
    >>> import cembench
    >>> mesh = cembench.surface("hemi-ellipsoid", 600)
    >>> before = cembench.parameterize(mesh, "direct-cem").z
    >>> after = angle_gauge(mesh, before)
    >>> bool(angle_errors(mesh, after).mean() <= angle_errors(mesh, before).mean())
    True

    """
    from scipy.optimize import minimize  # a tenth of a second

    sampled = SampledAngleError(mesh)
    own = sampled(uv)
    minimum = minimize(
        lambda move: sampled(_moved(mesh, uv, move)),
        np.zeros(2),
        method="Nelder-Mead",
        options={
            "initial_simplex": FIRST_MOVE * np.eye(3)[:, 1:],
            "xatol": LAST_MOVE,
            "fatol": LEAST_CHANGE * own,
            "maxfev": MOST_MAPS,
        },
    )
    moved = _moved(mesh, uv, minimum.x)
    better = angle_errors(mesh, moved).mean() < angle_errors(mesh, uv).mean()
    if better and flipped_triangles(mesh, moved) <= flipped_triangles(mesh, uv):
        return moved
    return uv


def _moved(mesh: DiskMesh, uv: Complex, move: NDArray[np.float64]) -> Complex:
    """Return a map after the Moebius map that takes the point at `move` to the disk's centre.

    `move` has the point's hyperbolic coordinates: half its distance along its direction.
    """
    length = float(np.hypot(*move))
    if not length:
        return uv
    a = complex(*move) * np.tanh(length) / length
    moved = (uv - a) / (1 - np.conj(a) * uv)
    moved[mesh.boundary] /= np.abs(moved[mesh.boundary])
    return np.asarray(moved)
