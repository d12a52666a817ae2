"""Triangulate polygons, including concave ones and ones with collinear corners.

A fan from the first corner is kept where all its triangles lie in the polygon, and so for every
convex one: the triangles then do not depend on where the vertices lie. A quadrilateral whose fan is
wrong is cut along its other diagonal. Larger polygons that are not convex are triangulated in their
best-fitting plane by a constrained Delaunay triangulation (GEOS through shapely), which uses every
corner, makes no unnecessary flat triangles, and does not depend on which corner comes first.
"""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Indices, Mask, Points
from cembench.core.blocks import blocks

#: A triangle is flat if its area is below this share of its polygon's; single precision leaves less
#: of a corner on a straight side.
_FLAT = 1e-6


def triangulate(V: Points, corners: Indices, sizes: Indices) -> Indices:
    """Cut polygons into triangles without adding vertices.

    Parameters
    ----------
    V : float64 (n, 3)
        Vertices.
    corners : int64 (sum of sizes,)
        The vertices around each polygon, one polygon after the other.
    sizes : int64 (k,)
        Number of corners of each polygon, at least 3.

    Returns
    -------
    int64 (m, 3)
        Triangles in the order of the polygons and with their orientation, as places in `corners`. A
        polygon that crosses itself in its plane, or is not finite, has no triangulation and is cut
        into a fan.
    """
    if (sizes == 3).all():
        return np.arange(3 * len(sizes)).reshape(-1, 3)
    start, counts = np.cumsum(sizes) - sizes, sizes - 2
    first = np.cumsum(counts) - counts
    triangles = np.empty((counts.sum(), 3), dtype=np.int64)
    for c in np.unique(sizes).tolist():
        alike = np.flatnonzero(sizes == c)
        for block in blocks(len(alike)):
            begin = start[alike[block], None]
            within = _of_one_size(V, corners[begin + np.arange(c)])
            triangles[first[alike[block], None] + np.arange(c - 2)] = begin[:, None] + within
    return triangles


def _of_one_size(V: Points, polygons: Indices) -> Indices:
    """Return the triangles (k, c - 2, 3) of polygons (k, c), as numbers of their corners."""
    c = polygons.shape[1]
    fan = np.stack([np.zeros(c - 2, int), np.arange(1, c - 1), np.arange(2, c)], axis=1)
    triangles = np.tile(fan, (len(polygons), 1, 1))
    if c == 3:
        return triangles
    good = _all_inside(V, polygons, fan)
    if c == 4:
        other = (fan + 1) % 4
        rest = np.flatnonzero(~good)
        triangles[rest[_all_inside(V, polygons[rest], other)]] = other
        return triangles
    turns = (np.arange(c)[:, None] + np.arange(3)) % c
    for k in np.flatnonzero(~(good & _all_inside(V, polygons, turns))).tolist():
        triangles[k] = _delaunay(V, polygons[k], fan)
    return triangles


def _all_inside(V: Points, polygons: Indices, triangles: Indices) -> Mask:
    """Whether each of these triangles of a polygon has an area and the polygon's orientation."""
    P = np.ascontiguousarray(V.take(polygons.T, axis=0).transpose(2, 0, 1))
    with np.errstate(all="ignore"):  # of vertices that no surface can have
        u, v = (P[:, triangles[:, k]] - P[:, triangles[:, 0]] for k in (1, 2))
        rays = P[:, 1:] - P[:, :1]
        whole = np.cross(rays[:, :-1], rays[:, 1:], axis=0).sum(axis=1)  # Newell: twice the area
        shares = np.einsum("xtk,xk->tk", np.cross(u, v, axis=0), whole)
        return np.asarray((shares > _FLAT * (whole**2).sum(axis=0)).all(axis=0))


def _delaunay(V: Points, polygon: Indices, fan: Indices) -> Indices:
    """Return triangles (c - 2, 3) of a polygon's corners; the fan if it crosses itself."""
    import shapely  # slow to load, and rarely needed

    start, c = int(polygon.argmin()), len(polygon)
    P = V[np.roll(polygon, -start)]  # so that rounding is the same whichever corner comes first
    if not np.isfinite(P).all():
        return fan
    P = P / (np.abs(P).max() or 1.0)  # squares of lengths must not overflow
    P = P - P.mean(axis=0)
    normal = np.cross(P, np.roll(P, -1, axis=0)).sum(axis=0)
    if not normal.any():
        return fan
    across = np.linalg.svd(normal[None])[2][1:]
    if np.linalg.det(np.vstack([across, normal])) < 0:
        across = across[::-1]
    flat = P @ across.T
    place = {tuple(point): k for k, point in enumerate(flat.tolist())}
    outline = shapely.Polygon(flat)
    if len(place) < c or not outline.is_valid:
        return fan
    pieces = shapely.constrained_delaunay_triangles(outline).geoms
    triangles = np.array(
        [[place[point] for point in piece.exterior.coords[:3]] for piece in pieces], dtype=np.int64
    )
    if triangles.shape != fan.shape:
        return fan
    u, v = (flat[triangles[:, k]] - flat[triangles[:, 0]] for k in (1, 2))
    clockwise = u[:, 0] * v[:, 1] < u[:, 1] * v[:, 0]
    triangles[clockwise] = triangles[clockwise, ::-1]
    return (triangles + start) % c
