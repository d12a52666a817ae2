"""The Moebius gauge of a disk map in which its angle errors are smallest.

A conformal map to the disk is determined up to a Moebius map of the disk, and none of these changes
an angle. The piecewise linear map through the same vertices does change: triangles that are large
in the disk are bent more. So the gauge decides angle errors, and what an algorithm ends in need not
be the best.
"""

from __future__ import annotations

import numpy as np

from cembench.conformal.metrics import (
    SampledAngleError,
    angle_errors,
    flipped_triangles,
    surface_areas,
)
from cembench.conformal.planar import signed_areas
from cembench.conformal.texel_density import texel_density_ratio
from cembench.core.arrays import Complex, Real
from cembench.mesh.triangle_mesh import DiskMesh

#: The search begins with moves of the disk's centre by this hyperbolic length ...
FIRST_MOVE = 0.3
#: ... ends with moves by this, or where the error changes by this share of itself ...
LAST_MOVE, MIN_CHANGE = 0.01, 1e-4
#: ... and asks for the error of so many maps at most.
MAX_MAPS = 100
#: Mean angle errors within this share of the least count as equal.
EQUAL = 0.01


def angle_gauge(mesh: DiskMesh, uv: Complex) -> Complex:
    """Return a disk map in the Moebius gauge in which its mean angle error is smallest.

    The search (Nelder & Mead 1965) measures a sample of the triangles. Of the gauges on its way
    whose errors are within 1 % of the least, the one with the most even texel density is taken if
    its error over all triangles is at most 1 % above that of `uv`, and it folds no more of them.

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
    >>> bool(angle_errors(mesh, after).mean() <= 1.01 * angle_errors(mesh, before).mean())
    True
    """
    from scipy.optimize import minimize  # a tenth of a second

    sampled, tried = SampledAngleError(mesh), list[tuple[float, tuple[float, ...]]]()

    def error_at(move: Real) -> float:
        tried.append((sampled(_moved(mesh, uv, move)), tuple(move.tolist())))
        return tried[-1][0]

    ends = {"xatol": LAST_MOVE, "fatol": MIN_CHANGE * sampled(uv), "maxfev": MAX_MAPS}
    options = {"initial_simplex": FIRST_MOVE * np.eye(3)[:, 1:], **ends}
    minimize(error_at, np.zeros(2), method="Nelder-Mead", options=options)
    areas, most = surface_areas(mesh), (1 + EQUAL) * min(tried)[0]
    moved = min(
        (_moved(mesh, uv, np.array(move)) for error, move in tried if error <= most),
        key=lambda z: texel_density_ratio(areas, signed_areas(z, mesh.F)),
    )
    enough = angle_errors(mesh, moved).mean() <= (1 + EQUAL) * angle_errors(mesh, uv).mean()
    if enough and flipped_triangles(mesh, moved) <= flipped_triangles(mesh, uv):
        return moved
    return uv


def _moved(mesh: DiskMesh, uv: Complex, move: Real) -> Complex:
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
