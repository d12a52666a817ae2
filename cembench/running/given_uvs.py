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
from cembench.mesh.defects import located, representatives
from cembench.mesh.files import complex_images
from cembench.mesh.soup import Soup
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.mesh.uvs import read_with_uv, uv_numbers
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
    named = isinstance(surface, str | os.PathLike)
    if named and not more:
        soup = read_with_uv(Path(surface))
        assert soup.uv is not None
        with located(Path(surface)):
            return _usable(soup, np.append(soup.uv, np.nan)[uv_numbers(soup)])  # NO_UV is the last
    whole = load_surface(surface, (TriangleMesh,)) if named else surface
    soup = soup_of((whole, more[0]) if len(more) == 2 else whole)
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
    F, n = soup.triangles, len(soup.V)
    allowed = (
        f"one for each vertex, ({n}, 2) or complex ({n},), or for each corner, ({len(F)}, 3, 2) or "
        f"complex {F.shape}"
    )
    z = complex_images(uv, [(n,), F.shape], allowed)
    return z if z.shape == F.shape else z[F]


def _usable(soup: Soup, corners: Complex) -> tuple[TriangleMesh, Complex, tuple[str, ...]]:
    """Return the triangles that have area and UVs, and a remark on each kind of the others.

    Vertices at the same position become one: many formats need copies of them along seams.
    """
    F = representatives(soup.V)[soup.triangles]
    without: Mask = np.asarray(np.isnan(corners).any(axis=1))
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
