"""Move and renumber a surface, so that results kept from earlier calls do not fit it.

Every timed call gets the surface in a different motion: a rotation, a shift, a tiny scale, and a
stretch by a millionth. A rigid motion does not change the conformal map, so a kept map would still
be right. A stretch changes it by about as much as the stretch itself: far more than rounding, and
far less than any table shows.

It is renumbered too: the rows of vertices and of triangles are cut into blocks of random lengths,
each of which is moved by another number of places, and the corners of the triangles of a block are
rotated. A matrix or factor that was kept for other numbers is useless, even as a preconditioner,
and what was kept by the triangles is not found. What was near in memory stays near, and so the work
stays the same.
"""

from __future__ import annotations

import hashlib
import re
from os import urandom

import numpy as np

from cembench.core.arrays import Complex, Indices, Real
from cembench.mesh.triangle_mesh import TriangleMesh

#: Name of the identity motion.
UNMOVED = ""
#: How the name of a motion ends that keeps the numbers of vertices and triangles.
NUMBERS_KEPT = " (numbers kept)"
#: What stands for the name of a motion that is drawn when its call begins.
DRAWN_LATER = "?"
#: What ends the name of a numbering where a motion's name begins with one.
THEN = "/"
#: Number of blocks that are permuted, a prime, and how far their ends are moved, in lengths of one.
#: With five no shift puts a third of the numbers in place; with more, orderings of well-numbered
#: meshes take longer (`python -m benchmarks renumbering`).
BLOCKS, JITTER = 5, 0.3
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


def numbering(name: str, n: int, m: int) -> tuple[Indices, Indices, Indices]:
    """Return the order of vertices (n,) and triangles (m,) of a named motion, and their turns (m,).

    A row of the order is the place where the surface itself has it; a triangle that comes there is
    turned by so many corners. Motions whose names begin with the same numbering share it.
    """
    if name == UNMOVED or name.endswith(NUMBERS_KEPT):
        return np.arange(n), np.arange(m), np.zeros(m, dtype=np.int64)
    shared = name.partition(THEN)[0]
    seed = int.from_bytes(hashlib.sha256(f"numbers {shared}".encode()).digest()[:8], "little")
    rng = np.random.default_rng(seed)
    vertices, triangles = (np.concatenate(_blocks(rng, count)) for count in (n, m))
    turns = [np.full(len(block), rng.integers(3)) for block in _blocks(rng, m)]
    return vertices, triangles, np.concatenate(turns)


def _blocks(rng: np.random.Generator, count: int) -> list[Indices]:
    """Return the numbers up to `count` in blocks of consecutive ones, in another order."""
    if count < 2 * BLOCKS:
        return [np.array([k]) for k in rng.permutation(count)]
    cuts = (np.arange(1, BLOCKS) + rng.uniform(-JITTER, JITTER, BLOCKS - 1)) * count / BLOCKS
    blocks = np.split(np.arange(count), cuts.astype(np.int64))
    # Each block is moved by another number of places.
    order = (rng.integers(2, BLOCKS) * np.arange(BLOCKS) + rng.integers(BLOCKS)) % BLOCKS
    return [blocks[k] for k in order]


def moved(mesh: TriangleMesh, name: str) -> TriangleMesh:
    """Return a moved and renumbered copy of the surface; for :data:`UNMOVED`, a plain copy."""
    vertices, triangles, turns = numbering(name, mesh.n, mesh.m)
    number = np.empty(mesh.n, dtype=np.int64)
    number[vertices] = np.arange(mesh.n)
    corners = (np.arange(3) + turns[:, None]) % 3
    F = number[np.take_along_axis(mesh.F[triangles], corners, axis=1)]
    V = mesh.V[vertices]
    if name != UNMOVED:
        matrix, shift = motion(name)
        low, high = V.min(axis=0), V.max(axis=0)
        centre = low + (high - low) / 2
        V = (V - centre) @ matrix.T + (centre + float((high - low).max()) * shift)
    V.setflags(write=False)
    F.setflags(write=False)
    return type(mesh).trusted(V, F, mesh.name, mesh.notices)


def in_first_order(uv: Complex, mesh: TriangleMesh, name: str) -> Complex:
    """Return the map of a moved surface in the surface's own order of vertices.

    The surface of an atlas, which has a point for each corner, is never renumbered.
    """
    if name.endswith(NUMBERS_KEPT) or name == UNMOVED:
        return uv
    placed = np.empty_like(uv)
    placed[numbering(name, mesh.n, mesh.m)[0]] = uv
    return placed
