"""Write a surface to a file with its map as texture coordinates, for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cembench.api.settings import Placement
from cembench.conformal.laplacian import double_areas
from cembench.conformal.planar import orientations, signed_areas
from cembench.conformal.resample import disk_to_square
from cembench.core.arrays import Complex, Indices
from cembench.core.atomic import write_bytes
from cembench.core.errors import MeshError, ParameterError, RenderError
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.files import SINGLE, write_soup
from cembench.mesh.formats import gltf, obj
from cembench.mesh.soup import Soup, Texture, columns
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.mesh.unit_square import to_unit_square


def save_map(
    output: Path,
    mesh: TriangleMesh,
    z: Complex,
    place: Placement = "unit",
    *,
    checker: bool = False,
) -> tuple[Notice, ...]:
    """Write a surface with its map z (n,) as texture coordinates to OBJ, PLY, GLB, VTP or NPZ.

    Returns a notice if rounding folds triangles in the file.
    """
    soup = Soup.of_triangles(mesh.V, mesh.F, placed(z, place, mesh, mesh.F), name=mesh.name)
    return write_with_uv(output, [soup], z, place, checker_texture(output, checker=checker))


def checker_texture(output: Path, *, checker: bool) -> bytes | None:
    """Return a checkerboard as PNG, if one is wanted or the format always has a texture."""
    if not checker and output.suffix.lower() != ".glb":
        return None
    from cembench.drawing.texture import checker_png

    return checker_png()


def texture_files(output: Path) -> list[Path]:
    """Return the files that are written beside an output with a texture.

    Raises
    ------
    ParameterError
        The format cannot refer to a texture.
    """
    suffix = output.suffix.lower()
    texture = output.with_name(f"{output.stem}_texture.png")
    files = {".glb": [], ".obj": [texture, output.with_suffix(".mtl")], ".ply": [texture]}
    if suffix not in files:
        raise ParameterError(
            f"{output}: {suffix} files cannot refer to a texture; use `checker` and `bake` with "
            ".glb, .obj or .ply."
        )
    return files[suffix]


def write_with_uv(
    output: Path,
    soups: Sequence[Soup],
    maps: Complex,
    place: Placement = "unit",
    texture: bytes | None = None,
    text: str = "",
) -> tuple[Notice, ...]:
    """Write surfaces with their coordinates; return a notice if rounding folds triangles.

    A GLB file gets a node for each surface; other formats get one mesh. `maps` are the images
    before they were moved, one for each coordinate, `texture` is a PNG file, and `text` an OBJ file
    with these coordinates. The texture is written first, so that no file names a missing one.
    """
    suffix, whole, image = output.suffix.lower(), joined(soups), None
    files = texture_files(output) if texture else []
    if texture:
        image = Texture(texture, *(path.name for path in files[:1]))
        for path, content in zip(files, (texture, obj.mtl_bytes(image.file)), strict=False):
            write_bytes(path, content, error=RenderError, parents=False)
    if suffix == ".glb":
        content = gltf.write(*soups, texture=image)
        write_bytes(output, content, error=MeshError, parents=False)
    elif suffix == ".obj":
        text = text or obj.write(whole).decode()
        if files:
            library = files[1].name.encode("utf-8", "surrogateescape")
            text = obj.with_material(text, library.decode("latin-1"))
        write_bytes(output, text.encode("latin-1"), error=MeshError, parents=False)
    else:
        write_soup(output, whole, image)
    return _folded_in_file(output, maps, whole, place)


def placed(z: Complex, place: Placement, surface: TriangleMesh, F: Indices) -> Complex:
    """Return a map moved to the placement of its texture coordinates.

    Triangles F (m, 3) are those of the surface, by numbers of the map's points.

    Raises
    ------
    ParameterError
        A map that does not reach the unit circle should be put on a square.
    """
    if place == "unit":
        return to_unit_square(z)
    if place == "world":
        return z * world_scale(z, surface, F)
    if place == "square":
        if np.abs(np.abs(z).max() - 1) > 1e-9:
            raise ParameterError(
                "uv='square' needs a map onto the disk, which then fills the square: take "
                "algorithm='direct-cem'."
            )
        return (disk_to_square(z) + (1 + 1j)) / 2
    return z


def world_scale(z: Complex, surface: TriangleMesh, F: Indices) -> float:
    """Return the factor that gives a map the surface's total area, so that it has its units."""
    area = float(np.abs(signed_areas(z, F)).sum())
    return float(np.sqrt(double_areas(surface.V, surface.F).sum() / 2 / area)) if area else 1.0


def flattened(mesh: TriangleMesh, z: Complex) -> TriangleMesh:
    """Return the image of a map as a mesh in the plane z = 0, in the surface's own units."""
    flat = z * world_scale(z, mesh, mesh.F)
    return mesh.trusted(np.column_stack([columns(flat), np.zeros(len(z))]), mesh.F, mesh.name)


def joined(parts: Sequence[Soup]) -> Soup:
    """Return several surfaces joined into one mesh."""
    if len(parts) == 1:
        return parts[0]
    starts = np.cumsum([0, *(len(part.V) for part in parts)])
    coordinates = [part.uv for part in parts if part.uv is not None]
    uv_starts = np.cumsum([0, *map(len, coordinates)])
    return Soup.of_triangles(
        np.concatenate([part.V for part in parts]),
        np.concatenate([p.triangles + k for p, k in zip(parts, starts, strict=False)]),
        np.concatenate(coordinates),
        np.concatenate([p.uv_triangles + k for p, k in zip(parts, uv_starts, strict=False)]),
    )


def _folded_in_file(output: Path, z: Complex, soup: Soup, place: Placement) -> tuple[Notice, ...]:
    """Return a notice of how many triangles fold in the file, though not in the map."""
    single, F = output.suffix.lower() in SINGLE, soup.uv_triangles
    assert soup.uv is not None
    written = soup.uv.astype(np.complex64).astype(np.complex128) if single else soup.uv
    after = orientations(written, F)
    count = int(((orientations(z, F) > 0) & (after <= 0)).sum())
    if not count:
        return ()
    if place == "square" and not single:
        text = f"{count} of {len(F)} triangles fold in the square, at its corners"
        return (Notice(NoticeKind.FOLDED_BY_ROUNDING, text),)
    precision = "single precision" if single else "the unit square"
    remedy = "write OBJ, VTP or NPZ" if single else "UVs in the disk (uv: disk) stay as they are"
    notices = (
        f"{count} of {len(F)} triangles are so small in the map that rounding to {precision} folds "
        f"or flattens them; {remedy}"
    )
    return (Notice(NoticeKind.FOLDED_BY_ROUNDING, notices),)
