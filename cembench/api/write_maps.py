"""Write maps to files for other programs: surfaces, texture coordinates and textures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cembench.api.components import Shells, areas_of
from cembench.api.settings import Placement
from cembench.conformal.atlas import cut_map
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
from cembench.mesh.unit_square import packed, to_unit_square
from cembench.mesh.uvs import uv_of_faces
from cembench.running.surfaces import SurfaceFile


@dataclass(frozen=True)
class FileOptions:
    """How a map is written, and what else is."""

    #: Placement of the texture coordinates.
    place: Placement = "unit"
    #: Whether to add a checkerboard texture. GLB always has one.
    checker: bool = False
    #: A texture for the file's own coordinates, to be repainted for the new ones.
    bake: Path | None = None
    #: Whether several surfaces get equal parts of the unit square, not parts by their areas.
    equal: bool = False
    #: Samples along a side, for `extras`.
    side: int = 129
    #: The files besides the surfaces with their maps, by kind
    #: (:data:`cembench.api.map_outputs.EXTRAS`).
    extras: Mapping[str, Path] = field(default_factory=dict)

    @property
    def textured(self) -> bool:
        """Whether a texture file is written beside formats that cannot hold one."""
        return self.checker or self.bake is not None


def beside(output: Path, file_options: FileOptions) -> list[Path]:
    """Return the additional files that are written beside an output.

    Raises
    ------
    ParameterError
        A texture is requested for a format that cannot refer to one.

    """
    suffix = output.suffix.lower()
    if not file_options.textured or suffix == ".glb":
        return []
    texture = output.with_name(f"{output.stem}_texture.png")
    if suffix == ".obj":
        return [texture, output.with_suffix(".mtl")]
    if suffix == ".ply":
        return [texture]
    raise ParameterError(
        f"{output}: {suffix} files cannot refer to a texture; use `checker` and `bake` with .glb, "
        ".obj or .ply."
    )


def save_map(
    output: Path, mesh: TriangleMesh, z: Complex, file_options: FileOptions | None = None
) -> tuple[Notice, ...]:
    """Write a surface with its map z (n,) as texture coordinates to OBJ, PLY, GLB, VTP or NPZ.

    Returns a notice if rounding folds triangles in the file.
    """
    options = file_options or FileOptions()
    uv = placed(z, options.place, mesh, mesh.F)
    soup = Soup.of_triangles(mesh.V, mesh.F, uv, name=mesh.name)
    return _save(output, [soup], z, options)


def write_shells(
    output: Path,
    shells: Shells,
    maps: Sequence[Complex],
    options: FileOptions,
    *,
    atlas: bool = False,
) -> tuple[Notice, ...]:
    """Write the surfaces of a file with their maps, as :func:`save_map` does.

    The maps of several surfaces lie side by side in the unit square. An OBJ file that was not
    repaired keeps its content and gets the coordinates. A surface that was cut is written uncut,
    with coordinates per corner; an `atlas` has an image for each corner anyway.
    """
    if len(maps) > 1:
        moved = packed(maps, areas_of(shells.parts), equal=options.equal)
    elif atlas:
        mesh = shells.parts[0].mesh
        cut = cut_map(mesh, maps[0].reshape(-1, 3))
        uv = placed(cut.uv, options.place, mesh, cut.surface.F)
        soup = Soup.of_triangles(mesh.V, mesh.F, uv, cut.surface.F, name=mesh.name)
        return _save(output, [soup], cut.uv, options)
    else:
        mesh = shells.parts[0].mesh
        moved = [placed(maps[0], options.place, mesh, mesh.F)]
    uv, corners = shells.joined(moved)
    name = shells.parts[0].mesh.name if len(maps) == 1 else shells.path.stem
    soup = Soup.of_triangles(shells.V, shells.F, uv, corners, name=name)
    return _save(output, [soup], shells.joined(maps)[0], options, shells)


def write_together(
    output: Path, files: Sequence[SurfaceFile], maps: Sequence[Complex], options: FileOptions
) -> tuple[Notice, ...]:
    """Write the surfaces of several files to one, as :func:`write_shells` does those of a file.

    A GLB file gets a node for each surface; other formats get one mesh.
    """
    moved = packed(maps, areas_of(files), equal=options.equal)
    soups = []
    for file, z in zip(files, moved, strict=True):
        mesh, corners = file.uncut or file.mesh, file.mesh.F if file.uncut else None
        soups.append(Soup.of_triangles(mesh.V, mesh.F, z, corners, name=file.mesh.name))
    if output.suffix.lower() != ".glb":
        soups = [_joined(soups)]
    return _save(output, soups, np.concatenate(maps), options)


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


def _save(
    output: Path,
    soups: Sequence[Soup],
    maps: Complex,
    options: FileOptions,
    source: Shells | None = None,
) -> tuple[Notice, ...]:
    """Write surfaces with their coordinates; return a notice if rounding folds triangles.

    `maps` are the images before they were moved, one for each coordinate. `source` is the file
    whose content an OBJ keeps, and whose own texture is baked. The texture is written first, so
    that no file names a missing one.
    """
    texture, image = _texture(output, soups[0], options, source), None
    if texture is not None:
        image = Texture(texture)
    suffix = output.suffix.lower()
    for path in beside(output, options):
        if path.suffix == ".png":
            assert texture is not None
            write_bytes(path, texture, error=RenderError, parents=False)
            image = Texture(texture, path.name)
        else:
            assert image is not None
            write_bytes(path, obj.mtl_bytes(image.file), error=MeshError, parents=False)
    if suffix == ".glb":
        content = gltf.write(*soups, texture=image)
        write_bytes(output, content, error=MeshError, parents=False)
    elif suffix == ".obj":
        text = _obj_text(soups[0], source)
        if options.textured:
            library = output.with_suffix(".mtl").name.encode("utf-8", "surrogateescape")
            text = obj.with_material(text, library.decode("latin-1"))
        write_bytes(output, text.encode("latin-1"), error=MeshError, parents=False)
    else:
        write_soup(output, soups[0], image)
    return _folded_in_file(output, maps, _joined(soups), options.place)


def _obj_text(soup: Soup, source: Shells | None) -> str:
    """Return an OBJ file: that of the source with other coordinates, or a new one."""
    if source is None or source.path.suffix.lower() != ".obj" or not source.as_read:
        return obj.write(soup).decode()
    text = source.path.read_text(encoding="latin-1")  # any bytes, as they are
    per_corner = any(part.cut for part in source.parts)
    assert soup.uv is not None
    return obj.with_uv(text, soup.uv, *((soup.triangles, soup.uv_triangles) if per_corner else ()))


def _texture(output: Path, soup: Soup, options: FileOptions, source: Shells | None) -> bytes | None:
    """Return the texture as PNG; None if there is none."""
    if options.bake is None:
        if not options.checker and output.suffix.lower() != ".glb":
            return None
        from cembench.drawing.texture import checker_png

        return checker_png()
    from cembench.drawing.texture import baked_png, read_texture

    if source is None or not source.as_read:
        raise ParameterError(
            "`bake` needs the faces of the original file, but the surface was repaired, or is not "
            "of a file; `cembench repair` shows what it changes. Fix the file so that it keeps "
            "its UVs."
        )
    old = uv_of_faces(source.path, soup.triangles)
    assert soup.uv is not None
    return baked_png(read_texture(options.bake), old, columns(soup.uv)[soup.uv_triangles])


def _joined(parts: Sequence[Soup]) -> Soup:
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
