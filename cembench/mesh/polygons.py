"""Triangulate polygons, including concave ones and ones with collinear corners.

A fan from the first corner is kept if all its triangles lie in the polygon, which always holds for
convex polygons. The others are triangulated in their best-fitting plane by a constrained Delaunay
triangulation (GEOS through shapely), which uses every corner and makes no unnecessary flat
triangles.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]

#: A triangle of a fan is flat if its area is below this share of the fan's area.
_FLAT = 1e-9


def triangulate(V: NDArray[np.float64], polygons: Iterable[Indices]) -> Indices:
    """Cut polygons into triangles without adding vertices.

    Parameters
    ----------
    V : float64 (n, 3)
        Vertices, all finite.
    polygons : iterable of int64 (k, c)
        Blocks of k polygons with c corners each, in order around the polygon; c is at least 3.

    Returns
    -------
    int64 (m, 3)
        Triangles in the order of the polygons and with their orientation. A polygon that crosses
        itself in its plane has no triangulation and is cut into a fan.

    """
    triangles = [np.empty((0, 3), dtype=np.int64)]
    for block in polygons:
        fans = _fans(block)
        for k in np.flatnonzero(~_good(V, fans)):
            within = _delaunay(V[block[k]])
            if within is not None:
                fans[k] = block[k][within]
        triangles.append(fans.reshape(-1, 3))
    return np.concatenate(triangles)


def _fans(block: Indices) -> Indices:
    """Return the fan of each polygon, (k, c) -> (k, c - 2, 3)."""
    c = block.shape[1]
    corners = np.stack([np.zeros(c - 2, int), np.arange(1, c - 1), np.arange(2, c)], axis=1)
    return block[:, corners]


def _good(V: NDArray[np.float64], fans: Indices) -> NDArray[np.bool_]:
    """Whether every triangle of a fan has an area and the orientation of its polygon."""
    if fans.shape[1] == 1:
        return np.ones(len(fans), dtype=bool)
    P = V[fans]
    normals = np.cross(P[:, :, 1] - P[:, :, 0], P[:, :, 2] - P[:, :, 0])
    whole = normals.sum(axis=1)
    along: NDArray[np.float64] = np.einsum("ktd,kd->kt", normals, whole)
    return (along > _FLAT * (whole**2).sum(axis=1)[:, None]).all(axis=1)


def _delaunay(P: NDArray[np.float64]) -> Indices | None:
    """Return triangles (c - 2, 3) of one polygon's corners (c, 3); None if it crosses itself."""
    import shapely  # slow to load, and rarely needed

    P = P - P.mean(axis=0)
    normal = np.cross(P, np.roll(P, -1, axis=0)).sum(axis=0)  # Newell: twice the vector area
    if not normal.any():
        return None
    across = np.linalg.svd(normal[None])[2][1:]
    if np.linalg.det(np.vstack([across, normal])) < 0:
        across = across[::-1]
    flat = P @ across.T
    place = {tuple(point): k for k, point in enumerate(flat.tolist())}
    polygon = shapely.Polygon(flat)
    if len(place) < len(P) or not polygon.is_valid:
        return None
    pieces = shapely.constrained_delaunay_triangles(polygon).geoms
    triangles = np.array(
        [[place[point] for point in piece.exterior.coords[:3]] for piece in pieces], dtype=np.int64
    )
    if triangles.shape != (len(P) - 2, 3):
        return None
    a, b, c = (flat[triangles[:, k]] for k in range(3))
    u, v = b - a, c - a
    clockwise = u[:, 0] * v[:, 1] < u[:, 1] * v[:, 0]
    triangles[clockwise] = triangles[clockwise, ::-1]
    return triangles
