"""Surfaces with UVs that somebody made: from files, arrays, and meshes of other libraries."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cembench.conformal.laplacian import double_areas
from cembench.core.arrays import Complex, Mask
from cembench.core.errors import MeshError
from cembench.mesh.defects import array_of, check_finite, located, representatives
from cembench.mesh.files import read_soup_with_uv
from cembench.mesh.soup import NO_UV, Soup, complex_of
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.running.foreign_meshes import soup_of
from cembench.running.surfaces import load_surface


def surface_and_uv(
    surface: Any, more: Sequence[ArrayLike] = ()
) -> tuple[TriangleMesh, Complex, tuple[str, ...]]:
    """Return a surface, the UV of each corner (m, 3), and what was left out.

    Triangles without UVs, or without area, are left out; nothing else is required of the surface.

    Raises
    ------
    MeshError
        There is no surface, or not one finite UV for each vertex or corner.

    """
    if isinstance(surface, str | os.PathLike) and not more:
        path = Path(surface)
        soup = read_soup_with_uv(path)
        try:
            return _usable(soup, _corners_of(soup))
        except MeshError as error:
            raise located(error, path) from None
    if isinstance(surface, str | os.PathLike):
        mesh = load_surface(surface, (TriangleMesh,))
        soup = Soup.of_triangles(mesh.V, mesh.F, name=mesh.name)
    else:
        soup = soup_of((surface, more[0]) if len(more) == 2 else surface)
    uv = more[-1] if more else _texture_coordinates(surface)
    if uv is None:
        raise MeshError(
            f"{type(surface).__name__} has no texture coordinates. Give them: measure(V, F, uv), "
            "with uv (n, 2) of the vertices or (m, 3, 2) of the corners."
        )
    return _usable(soup, _as_corners(uv, soup))


def _texture_coordinates(surface: Any) -> Any:
    """Return the texture coordinates of a mesh of trimesh or PyVista, or of named arrays."""
    if isinstance(surface, Mapping):
        return surface.get("uv")
    visual = getattr(surface, "visual", None)
    return getattr(visual, "uv", getattr(surface, "active_texture_coordinates", None))


def _as_corners(uv: Any, soup: Soup) -> Complex:
    """Return UVs of vertices or of corners as complex numbers of the corners, (m, 3)."""
    F, z = soup.triangles, array_of("UVs", uv, 2)
    if z.dtype.kind != "c" and z.shape[-1:] == (2,):
        z = complex_of(z).reshape(z.shape[:-1])
    if z.dtype.kind != "c" or z.shape not in ((len(soup.V),), F.shape):
        raise MeshError(
            f"uv is of type {np.asarray(uv).dtype} and shape {np.shape(uv)}; allowed is one for "
            f"each vertex, ({len(soup.V)}, 2) or complex ({len(soup.V)},), or for each corner, "
            f"({len(F)}, 3, 2) or complex {F.shape}."
        )
    check_finite("uv is", z.ravel())
    return z if z.shape == F.shape else z[F]


def _corners_of(soup: Soup) -> Complex:
    """Return the UVs of the corners of a file, (m, 3); NaN where it has none."""
    assert soup.uv is not None
    index = soup.uv_triangles
    bad = np.flatnonzero((index < NO_UV).ravel() | (index >= len(soup.uv)).ravel())
    if len(bad):
        raise MeshError(
            f"corner {bad[0] % 3} of triangle {bad[0] // 3} has the UV number "
            f"{index.flat[bad[0]]}, but there are {len(soup.uv)}. Export the file again."
        )
    return np.append(soup.uv, np.nan)[index]


def _usable(soup: Soup, corners: Complex) -> tuple[TriangleMesh, Complex, tuple[str, ...]]:
    """Return the triangles that have area and UVs, and a remark on each kind of the others.

    Vertices at the same position become one: many formats need copies of them along seams.
    """
    F = representatives(soup.V)[soup.triangles]
    without = np.isnan(corners).any(axis=1, keepdims=True).ravel()
    flat = ~without & ~(double_areas(soup.V, F) > 0)
    if (without | flat).all():
        raise MeshError("no triangle has UVs. Unwrap the surface, and export it with its UVs.")
    reasons: dict[str, Mask] = {"have no UVs": without, "have no area on the surface": flat}
    notices = tuple(
        f"{chosen.sum():,} of {len(chosen):,} triangles {why} and were left out, the first being "
        f"{np.flatnonzero(chosen)[0]} (counted from 0)"
        for why, chosen in reasons.items()
        if chosen.any()
    )
    kept = ~(without | flat)
    mesh = TriangleMesh.trusted(soup.V, F[kept], soup.name, soup.notices)
    return mesh, corners[kept], (*map(str, soup.notices), *notices)
