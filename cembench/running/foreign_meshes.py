"""The vertices and polygons of arrays, and of meshes of other libraries."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import MeshError
from cembench.core.notices import NoticeKind, of_kind
from cembench.mesh.defects import array_of, as_arrays
from cembench.mesh.formats.arrays import soup_of_arrays
from cembench.mesh.formats.vtk import soup_of_cells
from cembench.mesh.soup import Soup, damaged
from cembench.mesh.terrain import heights_of, soup_of_heights
from cembench.mesh.triangle_mesh import TriangleMesh

#: What libraries call vertices: trimesh, Open3D; PyVista, SciPy, vedo; nilearn; others.
_POINTS = ("vertices", "points", "coordinates", "verts")
#: What they call faces.
_FACES = ("simplices", "faces", "triangles")
#: Methods that return a mesh: of trimesh's scenes, PyVista's grids, pymeshlab's sets, Open3D's
#: tensors.
_MESH_FROM = ("to_mesh", "extract_surface", "current_mesh", "to_legacy")
#: The arrays of a surface in NiBabel's GIFTI images.
_GIFTI = ("NIFTI_INTENT_POINTSET", "NIFTI_INTENT_TRIANGLE")


def soup_of(surface: Any) -> Soup:
    """Return the polygons of a mesh, of arrays, or of another library's mesh, unchecked.

    Raises
    ------
    MeshError
        It is none of these, or its arrays are not those of polygons; the message has the expression
        that makes a surface of it, where one is known.
    """
    if isinstance(surface, TriangleMesh):
        notices = of_kind(NoticeKind.CUT_OPEN, surface.notices)
        return Soup.of_triangles(surface.V, surface.F, name=surface.name, notices=notices)
    if isinstance(surface, Mapping):
        tables = {str(name): np.asarray(value) for name, value in surface.items()}
        real = {k: v for k, v in tables.items() if v.ndim == 2 and v.dtype.kind in "fiu"}
        return soup_of_arrays(real, None, None, list(tables))
    if hasattr(surface, "vertex_matrix") and hasattr(surface, "face_matrix"):
        return _polygons(surface.vertex_matrix(), surface.face_matrix())
    if hasattr(surface, "get_arrays_from_intent"):
        found = [[one.data for one in surface.get_arrays_from_intent(name)] for name in _GIFTI]
        if [len(one) for one in found] == [1, 1]:
            return _polygons(found[0][0], found[1][0])
    if isinstance(surface, tuple | list) and len(surface) == 2:
        points, faces = surface
        if hasattr(points, "triangles") and hasattr(points, "x"):
            return _of_triangulation(points, faces)
        return _polygons(points, faces)
    if hasattr(surface, "triangles") and hasattr(surface, "x") and hasattr(surface, "y"):
        return _of_triangulation(surface, np.zeros(len(surface.x)))
    heights = heights_of(surface)
    if heights is not None:
        return soup_of_heights(*heights)
    return _of_attributes(surface)


def _of_attributes(surface: Any) -> Soup:
    """Return the polygons of an object that has them under one of the usual names.

    Points in the plane get the height 0.
    """
    points = next((getattr(surface, name) for name in _POINTS if hasattr(surface, name)), None)
    faces = next((getattr(surface, name) for name in _FACES if hasattr(surface, name)), None)
    if points is not None and faces is not None:
        faces = array_of("faces", faces, 3)
        if faces.ndim == 1 and faces.size:
            return Soup.from_arrays(points, *_unpadded(faces))
        points = np.asarray(points)
        if points.ndim == 2 and points.shape[1] == 2:
            points = np.column_stack([points, np.zeros(len(points))])
        return _polygons(points, faces)
    cells = getattr(surface, "cells", None)
    if points is not None and isinstance(cells, list):
        if cells and not hasattr(cells[0], "type"):
            corners = np.concatenate([np.asarray(cell, dtype=np.int64) for cell in cells])
            return Soup.from_arrays(points, corners, [len(cell) for cell in cells])
        return soup_of_cells(points, cells)
    raise MeshError(
        "a surface is a mesh, a path, the name of a registered surface, a pair of arrays (V, F), "
        f"or an object with vertices and faces; got {_described(surface)}"
    )


def _polygons(V: Any, F: Any) -> Soup:
    """Return a soup of triangles, or of quadrilaterals where F has four columns.

    F may hold whole numbers as floating-point ones, as MATLAB's do. A quadrilateral whose last
    corner is that before, or negative, is a triangle.
    """
    points, faces = array_of("vertices", V, 3), array_of("faces", F, 3)
    whole = faces.dtype.kind == "f" and points.dtype.kind == "f" and faces.ndim == 2
    if whole and faces.size and np.isfinite(faces).all() and (faces == np.round(faces)).all():
        faces = faces.astype(np.int64)
    if faces.ndim != 2 or faces.shape[1] != 4 or faces.dtype.kind not in "iu":
        return Soup.of_triangles(*as_arrays(points, faces))
    quads = faces.astype(np.int64)
    corners = np.where(quads[:, 3:] < 0, quads[:, [0, 1, 2, 2]], quads)
    points, _ = as_arrays(points, corners[:, :3])  # which checks and names the vertices
    if corners.min() == 1 and corners.max() == len(points):
        as_arrays(points, np.sort(corners, axis=1)[:, [0, 1, 3]])  # which says that F counts from 1
        raise MeshError("the faces count from 1. Write F - 1.")
    sizes = np.where(corners[:, 3] == corners[:, 2], 3, 4)
    there = np.arange(4) < sizes[:, None]
    return Soup.from_arrays(points, corners[there], sizes)


def _of_triangulation(triangulation: Any, heights: Any) -> Soup:
    """Return the triangles of matplotlib's Triangulation that no mask hides, with these heights."""
    V = np.column_stack([triangulation.x, triangulation.y, np.asarray(heights, dtype=np.float64)])
    mask = getattr(triangulation, "mask", None)
    F = np.asarray(triangulation.triangles)
    return Soup.of_triangles(*as_arrays(V, F if mask is None else F[~np.asarray(mask)]))


def _described(surface: Any) -> str:
    """Return what was given instead of a surface, and how to make one of it if that is known."""
    name = type(surface).__name__
    if isinstance(surface, tuple | list):
        few = " igl.readOBJ returns F as the fourth: write (found[0], found[3])."
        more = " Name the vertices and the faces: write (found[0], found[1])."
        return f"{name} of {len(surface)} items.{few if len(surface) == 6 else more}"
    for method in _MESH_FROM:
        if hasattr(surface, method):
            return f"{name}, which holds one: write {method}() of it."
    shape: tuple[int, ...] = getattr(surface, "shape", ())
    if len(shape) == 2 and shape[1] != 3:
        return f"{name} of shape {shape}: if these are heights, write cembench.terrain(z, x, y)."
    if len(shape) == 3 and shape[1:] == (3, 3):
        corners = "write (T.reshape(-1, 3), np.arange(T.size // 3).reshape(-1, 3))"
        return f"{name} of shape {shape}: if these are the corners T of triangles, {corners}."
    if hasattr(surface, "get_arrays_from_intent"):
        return f"{name} without points and triangles: name the image of the surface, .surf.gii."
    arrays = " without its faces: write (V, F)." if isinstance(surface, np.ndarray) else "."
    return f"{name}{arrays}"


def _unpadded(faces: NDArray[Any]) -> tuple[Any, Any]:
    """Return corners and sizes of polygons from PyVista's one array: size, corners, size, ..."""
    starts, at = [], 0
    while at < len(faces):
        starts.append(at)
        if faces[at] < 3 or at + faces[at] >= len(faces):
            raise damaged(f"faces[{at}] is {faces[at]}, which is not the size of a polygon")
        at += 1 + int(faces[at])
    return np.delete(faces, starts), faces[starts]
