"""Move a surface so little that nothing about it matters, and so that no kept result fits it.

Every timed call gets another motion of the surface: a rotation, a shift, a tiny scale, and a
stretch by a millionth. Of a rigid motion the conformal map is the same one, so whoever kept it,
under whatever key, would be right; of a stretch it is another one, by about as much as the stretch,
far more than rounding and far less than any table shows. Vertices, triangles and their order stay,
so the work is the same.
"""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.typing import NDArray

from cembench.mesh.triangle_mesh import TriangleMesh

Real = NDArray[np.float64]

#: The name of the motion that leaves all as it is.
UNMOVED = ""
#: Relative change of lengths, largest against smallest: what kept results are told by.
STRETCH = 1e-6
#: Largest angle, in radians, shift as a share of the surface's size, and relative change of scale:
#: small, so that a method that looks at axes does the same work.
ANGLE, SHIFT, SCALE = 0.01, 0.01, 1e-3


def motion(name: str) -> tuple[Real, Real]:
    """Return the matrix (3, 3) and the shift (3,), in sizes of the surface, of the motion so named.

    Examples
    --------
    >>> matrix, shift = motion("round 1, call 2")
    >>> bool(np.allclose(matrix @ matrix.T, np.eye(3), atol=0.01))
    True

    """
    if name == UNMOVED:
        return np.eye(3), np.zeros(3)
    seed = int.from_bytes(hashlib.sha256(name.encode()).digest()[:8], "little")
    rng = np.random.default_rng(seed)
    axis = rng.standard_normal(3)
    axis /= np.linalg.norm(axis)
    angle = rng.uniform(0.1, 1.0) * ANGLE
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    rotation = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)
    Q, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    stretch = Q @ np.diag([0.0, rng.uniform(0.4, 0.6), 1.0]) @ Q.T
    scale = 1 + SCALE * rng.uniform(-1, 1)
    return scale * rotation @ (np.eye(3) + STRETCH * stretch), SHIFT * rng.uniform(-1, 1, 3)


def moved(mesh: TriangleMesh, name: str) -> TriangleMesh:
    """Return the surface moved, in arrays of its own; under :data:`UNMOVED` a copy of it."""
    F = mesh.F.copy()
    if name == UNMOVED:
        V = mesh.V.copy()
    else:
        matrix, shift = motion(name)
        low, high = mesh.V.min(axis=0), mesh.V.max(axis=0)
        centre = low + (high - low) / 2
        V = (mesh.V - centre) @ matrix.T + (centre + float((high - low).max()) * shift)
    V.setflags(write=False)
    F.setflags(write=False)
    return type(mesh).trusted(V, F, mesh.name, mesh.notices)
