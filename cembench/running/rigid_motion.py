"""Move and renumber a surface, so that results kept from earlier calls do not fit it.

Every timed call gets the surface in a different motion: a rotation, a shift, a tiny scale, and a
stretch by a millionth. A rigid motion does not change the conformal map, so a kept map would still
be right. A stretch changes it by about as much as the stretch itself: far more than rounding, and
far less than any table shows.

It is renumbered too: vertices, triangles and the corners within triangles are rotated cyclically,
by random numbers. A matrix or factor that was kept for other numbers is useless, even as a
preconditioner, and what was kept by the triangles is not found. What was near in memory stays near,
and so the work stays the same.
"""

from __future__ import annotations

import hashlib
import re
from os import urandom

import numpy as np
from numpy.typing import NDArray

from cembench.mesh.triangle_mesh import TriangleMesh

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Name of the identity motion.
UNMOVED = ""
#: How the name of a motion ends that keeps the numbers of vertices and triangles.
NUMBERS_KEPT = " (numbers kept)"
#: What stands for the name of a motion that is drawn when its call begins.
DRAWN_LATER = "?"
#: Relative stretch, largest against smallest length; it reveals kept results.
STRETCH = 1e-6
#: Largest angle in radians, shift as a share of the surface's size, and relative change of scale;
#: all are small, so that a method that depends on the axes does the same work.
ANGLE, SHIFT, SCALE = 0.01, 0.01, 1e-3


def motion(name: str) -> tuple[Real, Real]:
    """Return the matrix (3, 3) and the shift (3,), in sizes of the surface, of a named motion.

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


def drawn(name: str) -> str:
    """Return the name of a motion, drawn now if it is open: nobody knows it before the call."""
    return name.replace(DRAWN_LATER, urandom(6).hex())


def may_be(name: str, asked: str) -> bool:
    """Whether this name of a motion can have been drawn for the one that was asked for."""
    pattern = re.escape(asked).replace(re.escape(DRAWN_LATER), "[0-9a-f]{12}")
    return re.fullmatch(pattern, name) is not None


def numbering(name: str, n: int, m: int) -> tuple[int, int, int]:
    """Return how far a named motion rotates the numbers of vertices, triangles and corners."""
    if name == UNMOVED or name.endswith(NUMBERS_KEPT):
        return 0, 0, 0
    seed = int.from_bytes(hashlib.sha256(f"numbers {name}".encode()).digest()[:8], "little")
    vertices, triangles, corners = np.random.default_rng(seed).integers(0, (n, m, 3))
    return int(vertices), int(triangles), int(corners)


def moved(mesh: TriangleMesh, name: str) -> TriangleMesh:
    """Return a moved and renumbered copy of the surface; for :data:`UNMOVED`, a plain copy."""
    vertices, triangles, corners = numbering(name, mesh.n, mesh.m)
    F = np.roll((mesh.F + vertices) % mesh.n, (triangles, corners), axis=(0, 1))
    if name == UNMOVED:
        V = mesh.V.copy()
    else:
        matrix, shift = motion(name)
        low, high = mesh.V.min(axis=0), mesh.V.max(axis=0)
        centre = low + (high - low) / 2
        V = (mesh.V - centre) @ matrix.T + (centre + float((high - low).max()) * shift)
    V = np.roll(V, vertices, axis=0)
    V.setflags(write=False)
    F.setflags(write=False)
    return type(mesh).trusted(V, F, mesh.name, mesh.notices)


def in_first_order(uv: Complex, mesh: TriangleMesh, name: str) -> Complex:
    """Return the map of a moved surface in the surface's own order of vertices.

    The surface of an atlas, which has a point for each corner, is never renumbered.
    """
    vertices, _, _ = numbering(name, mesh.n, mesh.m)
    return np.roll(uv, -vertices)
