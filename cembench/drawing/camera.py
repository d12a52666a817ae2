"""The default view of a surface; it depends on the mesh alone."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Real
from cembench.mesh.triangle_mesh import TriangleMesh

X, Y, Z = np.eye(3)
#: Viewing directions if y is up, and if z is up: faces look along +z, and along -y.
Y_UP, Z_UP = np.stack([Z, X, -Z, -X]), np.stack([-Y, X, Y, -X])
#: ... and if the up direction is unknown.
ANY = np.stack([Z, Y, X, -Z, -Y, -X])
#: The first of these is taken unless another shows this many times its area.
HABIT = 1.5
#: Below this ratio of net to total area a surface is nearly closed: it stands on its cut, or hangs
#: from it, if the centre of the cut is this far (share of the size) from its own ...
CLOSED, APART = 0.25, 0.08
#: ... and does so along y or z if the distance there is this many times that along the other.
LEANING = 1.5
#: Above this ratio of net to total area a surface is a relief, seen obliquely from above ...
RELIEF = 0.7
#: ... and above this one it is flat, and seen face on.
FLAT = 0.999
#: Degrees by which the viewer moves right and up, to make depth visible.
PORTRAIT, OBLIQUE = (14.0, 8.0), (12.0, -42.0)
#: Grid cells across in the estimate of hidden area, and the most triangles that it samples.
CELLS, SAMPLE = 48, 100_000


def view_rotation(mesh: TriangleMesh) -> Real:
    """Return the rotation that turns a surface towards the viewer.

    The viewer looks along a coordinate axis that shows much of the surface, moved slightly aside.
    Up is y, or z for a surface cut along z: a bust that stands on its cut, a foot cut at the ankle.

    Returns
    -------
    float64 (3, 3)
        Rows: the unit vectors in space that point right, up, and towards the viewer.
    """
    _, normals, areas = _samples(mesh)
    net = areas @ normals / areas.sum()
    strength = float(np.linalg.norm(net))
    if strength > FLAT:
        return _frame(net / strength)
    if strength > RELIEF:
        axis = np.zeros(3)
        axis[np.argmax(np.abs(net))] = np.sign(net[np.argmax(np.abs(net))])
        return _moved(_frame(axis), *OBLIQUE)
    return _moved(_front(mesh), *PORTRAIT)


def viewpoints(mesh: TriangleMesh) -> dict[str, Real]:
    """Return the rotations for the front, side and three-quarter views of a surface.

    Rotations as in :func:`view_rotation`. The front is along the coordinate axis that shows most;
    the side view is a quarter turn to the viewer's right about the vertical.
    """
    front = _front(mesh)
    angles = {"front": 0.0, "three-quarter": 45.0, "side": 90.0}
    return {name: _moved(front, aside, 0.0) for name, aside in angles.items()}


def _front(mesh: TriangleMesh) -> Real:
    """Return the view along the coordinate axis that shows most, with up pointing up."""
    middles, normals, areas = _samples(mesh)
    nearly_closed = np.linalg.norm(areas @ normals) < CLOSED * areas.sum()
    axes, up = _views(mesh, middles, areas) if nearly_closed else (ANY, Y)
    return _best_view(axes, up, middles, normals, areas)


def _samples(mesh: TriangleMesh) -> tuple[Real, Real, Real]:
    """Return centres (k, 3), unit normals (k, 3) and areas (k,) of evenly chosen triangles."""
    corners = mesh.V[mesh.F[:: -(-mesh.m // SAMPLE)]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(normals, axis=1)
    return corners.mean(axis=1), normals / doubled[:, None], doubled / 2


def _views(mesh: TriangleMesh, middles: Real, areas: Real) -> tuple[Real, Real]:
    """Return candidate viewing axes and the up direction, judged by where the surface is cut."""
    if mesh.loops:
        cut = mesh.V[np.concatenate(mesh.loops)].mean(axis=0)
        way = np.abs(areas @ middles / areas.sum() - cut) / np.ptp(middles, axis=0).max()
        if way[2] > max(LEANING * way[1], APART):
            return Z_UP, Z
        if way[1] > max(LEANING * way[2], APART):
            return Y_UP, Y
    return ANY, Y


def _best_view(axes: Real, up: Real, middles: Real, normals: Real, areas: Real) -> Real:
    """Return the axis direction that shows most, with a preference for the first."""
    frames = [_frame(axis, up) for axis in axes]
    shown = np.array([_area_shown(frame, middles, normals, areas) for frame in frames])
    best = int(np.argmax(shown))
    return frames[0] if shown[best] < HABIT * shown[0] else frames[best]


def _area_shown(frame: Real, middles: Real, normals: Real, areas: Real) -> float:
    """Return the visible area that faces the viewer, foreshortened."""
    seen = middles @ frame.T
    extent = float(np.ptp(seen, axis=0).max())
    cells = ((seen[:, :2] - seen[:, :2].min(axis=0)) / extent * (CELLS - 1e-9)).astype(np.int64)
    cell = cells[:, 0] * CELLS + cells[:, 1]
    nearest = np.full(CELLS * CELLS, -np.inf)
    np.maximum.at(nearest, cell, seen[:, 2])
    facing = normals @ frame[2]
    shown = (facing > 0) & (seen[:, 2] > nearest[cell] - 0.05 * extent)
    return float((areas * facing)[shown].sum())


def _frame(toward: Real, up: Real = Y) -> Real:
    """Return right, up and towards the viewer; for a view along y, up is -z or z."""
    if abs(toward @ up) > 0.99:
        up = np.array([0.0, 0.0, -np.sign(toward[1])])
    right = np.cross(up, toward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(toward, right), toward])


def _moved(frame: Real, aside: float, upward: float) -> Real:
    """Return the frame of a viewer who moved by these angles and still looks at the same point."""
    a, u = np.deg2rad([aside, upward])
    right, up, toward = frame
    horizontal = np.cos(a) * toward + np.sin(a) * right
    new_right = np.cos(a) * right - np.sin(a) * toward
    new_toward = np.cos(u) * horizontal + np.sin(u) * up
    return np.stack([new_right, np.cross(new_toward, new_right), new_toward])
