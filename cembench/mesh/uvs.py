"""UVs that programs write, at vertices or at corners, matched with the surface they belong to.

The file may also hold that surface. :func:`uv_of_corners` checks that it is the surface that the
program was given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from cembench.core.arrays import Complex, Indices, Points
from cembench.core.errors import MeshError, describe_error
from cembench.mesh.files import READ_WITH_UV, READERS, read_soup
from cembench.mesh.soup import NO_UV, Soup, complex_of, damaged, shown

#: Allowed distance of a vertex from its original position, relative to the surface's extent: single
#: precision and six decimals are accepted.
SAME_PLACE = 1e-5


class OtherSurfaceError(MeshError):
    """A file holds UVs of a different surface than expected."""


def read_uv(path: Path) -> Soup:
    """Read the UVs of a file, with its surface if it holds one, in the format of its suffix.

    Raises
    ------
    MeshError
        The file is damaged, cut short or holds no UVs.
    """
    try:
        file = _READERS[path.suffix.lower()](path, uv=True)
    except (MemoryError, OSError, ValueError, OverflowError, IndexError, KeyError) as error:
        raise MeshError(f"{path.name} cannot be read: {describe_error(error)}") from error
    if file.uv is None or not len(file.uv):
        obj_words = (
            ": no line that begins with vt. If it has two numbers a line, declare that with "
            "`--program output=txt`"
        )
        raise damaged(f"it holds no UVs{obj_words if path.suffix.lower() == '.obj' else ''}")
    return file


def read_with_uv(path: Path) -> Soup:
    """Read a surface with its UVs, of vertices or of corners.

    Raises
    ------
    MeshError
        The file cannot be read as a surface, or holds no UVs.
    """
    suffix = path.suffix.lower()
    soup = read_soup(path, uv=suffix in READ_WITH_UV)
    if suffix in (".mat", ".npz"):
        held = read_uv(path)
        soup = replace(soup, uv=held.uv, uv_index=held.uv_index if len(held.sizes) else None)
    if soup.uv is None or not len(soup.uv):
        formats = ", ".join((*READ_WITH_UV, ".mat", ".npz"))
        raise MeshError(
            f"{path}: it holds no UVs. Unwrap the surface and export it with them, as {formats}; "
            "or map it with cembench."
        )
    return soup


def read_flat(path: Path) -> Soup:
    """Read a flattened surface from a mesh file, with x and y as its UVs.

    Raises
    ------
    MeshError
        The file is damaged, or its vertices do not lie in the plane z = 0.
    """
    soup = read_soup(path)
    V = soup.V
    if np.abs(V[:, 2]).max() > SAME_PLACE * np.ptp(V[:, :2], axis=0).max():
        raise MeshError("its vertices do not lie in the plane z = 0: it is not a flat map")
    return Soup.of_triangles(V[:0], soup.triangles, complex_of(V[:, :2]), name=soup.name)


def uv_of_corners(file: Soup, V: Points, F: Indices) -> Complex:
    """Return the UV of each corner (m, 3) of a surface from a file that should hold that surface.

    Programs that cut a surface may write vertices in another order or several times, and triangles
    in another order; they are matched by position.

    Raises
    ------
    OtherSurfaceError
        The file holds other vertices or triangles.
    MeshError
        There is not one UV for each vertex or corner.
    """
    assert file.uv is not None
    if not len(file.sizes):
        if len(file.uv) == len(V):
            return file.uv[F]
        if len(file.uv) == F.size:
            return file.uv.reshape(F.shape)
        raise OtherSurfaceError(
            f"it holds {len(file.uv)} UVs; required is one for each of the {len(V)} vertices, or "
            f"for each of the {F.size} corners"
        )
    corners = uv_numbers(file)
    if (corners == NO_UV).any():
        raise damaged("a triangle has a corner without a UV; write f vertex/uv vertex/uv ...")
    if len(corners) != len(F):
        raise OtherSurfaceError(f"it holds {len(corners)} triangles; the surface has {len(F)}")
    uv = file.uv[corners]
    if not len(file.corners):
        return uv
    G = _vertex_numbers(file.V, V)[file.triangles] if len(file.V) else file.triangles
    at, turn = _places(G, F)
    return np.take_along_axis(uv[at], (np.arange(3) + turn[:, None]) % 3, axis=1)


def uv_numbers(file: Soup) -> Indices:
    """Return the number of the UV of each corner (m, 3); :data:`NO_UV` for none.

    Where no corner has one, and there are as many as vertices, it is that of the vertex.

    Raises
    ------
    MeshError
        There is no UV of this number.
    """
    assert file.uv is not None
    corners = file.uv_triangles
    if (corners == NO_UV).all() and len(file.uv) == len(file.V):
        corners = file.triangles
    unknown = corners[(corners < NO_UV) | (corners >= len(file.uv))]
    if len(unknown):
        raise MeshError(f"a corner has UV number {unknown[0]}, but there are {len(file.uv)} UVs")
    return corners


def _vertex_numbers(points: Points, V: Points) -> Indices:
    """Return the vertex of V that each vertex of a file is."""
    from scipy.spatial import cKDTree

    extent = float(np.ptp(V, axis=0).max())
    if not np.isfinite(points).all():
        raise OtherSurfaceError("a vertex in it is NaN or infinite")
    if points.shape == V.shape and np.abs(points - V).max() <= SAME_PLACE * extent:
        return np.arange(len(V), dtype=np.int64)
    away, number = cKDTree(V).query(points)
    if away.max() > SAME_PLACE * extent:
        far = int(np.argmax(away))
        raise OtherSurfaceError(
            f"it holds other vertices: {len(points)} of them, the surface has {len(V)}, and vertex "
            f"{far} (counted from 0) lies {away[far]:.3g} from the nearest of these"
        )
    return number.astype(np.int64)


def _places(G: Indices, F: Indices) -> tuple[Indices, Indices]:
    """Return for each triangle of F its index in G, and which corner comes first there."""
    (g, turn_g), (f, turn_f) = _turned(G), _turned(F)
    order_g, order_f = (np.lexsort(A.T[::-1]) for A in (g, f))
    if not (g[order_g] == f[order_f]).all():
        wrong = int((g[order_g] != f[order_f]).any(axis=1).sum())
        raise OtherSurfaceError(
            f"it holds other triangles: {wrong} of {len(F)} differ from those of the surface, or "
            "have the opposite orientation"
        )
    at = np.empty(len(F), dtype=np.int64)
    at[order_f] = order_g
    return at, (turn_g[at] - turn_f) % 3


def _turned(F: Indices) -> tuple[Indices, Indices]:
    """Rotate triangles so that their smallest vertex comes first; also return that corner."""
    first = F.argmin(axis=1)
    turned = np.take_along_axis(F, (np.arange(3) + first[:, None]) % 3, axis=1)
    return turned, first.astype(np.int64)


def _read_text(path: Path, *, uv: bool) -> Soup:
    """Read two numbers per line, for each vertex or for each corner."""
    lines = path.read_text(encoding="latin-1").splitlines()
    rows = [line.replace(",", " ").split() for line in lines]
    rows = [row for row in rows if row and not row[0].startswith("#")]
    bad = next((row for row in rows if len(row) != 2), None)
    if bad is not None or not rows:
        line = shown(" ".join(bad)) if bad else "nothing"
        raise damaged(f"two numbers per line are required; it holds {line}")
    nothing = np.empty(0, dtype=np.int64)
    return Soup(np.empty((0, 3)), nothing, nothing, uv=complex_of(np.array(rows, np.float64)))


_READERS: dict[str, Callable[..., Soup]] = {
    **{suffix: READERS[suffix] for suffix in (".obj", ".off", ".ply", ".mat", ".npz")},
    ".txt": _read_text,
}
