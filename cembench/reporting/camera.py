"""From where should a surface be looked at? The same mesh always gets the same answer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cembench.geometry.mesh import TriangleMesh

Real = NDArray[np.float64]

#: From +z unless another axis shows this many times its area: most scans and models face +z.
HABIT = 1.5
#: Above this share of net to total area a surface is a relief, seen obliquely from above ...
RELIEF = 0.7
#: ... and above this one it is flat, and seen straight on.
FLAT = 0.999
#: Degrees by which the viewer moves to the right and upwards, so that depth can be read.
PORTRAIT, OBLIQUE = (14.0, 8.0), (12.0, -42.0)
#: Cells across in the estimate of what hides what, and the most triangles that it looks at.
CELLS, SAMPLE = 48, 100_000


def view_rotation(mesh: TriangleMesh) -> Real:
    """Which rotation brings the surface before the viewer?

    The viewer stands on a coordinate axis that shows much of the surface, moved a little aside.

    Returns
    -------
    float64 (3, 3)
        Rows: the unit vectors in space that point right, up, and towards the viewer.

    """
    middles, normals, areas = _samples(mesh)
    net = (normals * areas[:, None]).sum(axis=0) / areas.sum()
    strength = float(np.linalg.norm(net))
    if strength > FLAT:
        return _frame(net / strength)
    if strength > RELIEF:
        axis = np.zeros(3)
        axis[np.argmax(np.abs(net))] = np.sign(net[np.argmax(np.abs(net))])
        return _moved(_frame(axis), *OBLIQUE)
    return _moved(_frame(_best_axis(middles, normals, areas)), *PORTRAIT)


def viewpoints(mesh: TriangleMesh) -> dict[str, Real]:
    """How does one look at the surface from the front, from the side and three-quarter?

    Rotations as in :func:`view_rotation`; the front is the coordinate axis that shows most, the
    side a quarter turn to the viewer's right about the vertical.
    """
    front = _frame(_best_axis(*_samples(mesh)))
    angles = {"front": 0.0, "three-quarter": 45.0, "side": 90.0}
    return {name: _moved(front, aside, 0.0) for name, aside in angles.items()}


def _samples(mesh: TriangleMesh) -> tuple[Real, Real, Real]:
    """Middles (k, 3), unit normals (k, 3) and areas (k,) of an even choice of triangles."""
    corners = mesh.V[mesh.F[:: -(-mesh.m // SAMPLE)]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(normals, axis=1)
    return corners.mean(axis=1), normals / doubled[:, None], doubled / 2


def _best_axis(middles: Real, normals: Real, areas: Real) -> Real:
    """Which of the six axis directions shows most, by custom rather +z?"""
    axes = np.concatenate([np.eye(3)[::-1], -np.eye(3)[::-1]])  # +z first
    shown = np.array([_area_shown(_frame(axis), middles, normals, areas) for axis in axes])
    best = int(np.argmax(shown))
    return axes[0] if shown[best] < HABIT * shown[0] else axes[best]


def _area_shown(frame: Real, middles: Real, normals: Real, areas: Real) -> float:
    """How much area faces the viewer with nothing in front, as he sees it (foreshortened)?"""
    seen = middles @ frame.T
    extent = float(np.ptp(seen, axis=0).max())
    cells = ((seen[:, :2] - seen[:, :2].min(axis=0)) / extent * (CELLS - 1e-9)).astype(np.int64)
    cell = cells[:, 0] * CELLS + cells[:, 1]
    nearest = np.full(CELLS * CELLS, -np.inf)
    np.maximum.at(nearest, cell, seen[:, 2])
    facing = normals @ frame[2]
    shown = (facing > 0) & (seen[:, 2] > nearest[cell] - 0.05 * extent)
    return float((areas * facing)[shown].sum())


def _frame(toward: Real) -> Real:
    """Right, up and towards the viewer; up is y, or for a view along y the direction of -z."""
    up = np.array([0.0, 1.0, 0.0])
    if abs(toward @ up) > 0.99:
        up = np.array([0.0, 0.0, -np.sign(toward[1])])
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right), toward])


def _moved(frame: Real, aside: float, upward: float) -> Real:
    """The frame of a viewer who has moved by these angles and still looks at the same place."""
    a, u = np.deg2rad([aside, upward])
    right, up, toward = frame
    horizontal = np.cos(a) * toward + np.sin(a) * right
    new_right = np.cos(a) * right - np.sin(a) * toward
    new_toward = np.cos(u) * horizontal + np.sin(u) * up
    return np.stack([new_right, np.cross(new_toward, new_right), new_toward])
