"""Write maps to files for other programs: surfaces, texture coordinates and textures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cembench.api.components import Shells, areas_of
from cembench.api.settings import Placement
from cembench.conformal.atlas import cut_map
from cembench.conformal.planar import orientations
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

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class FileOptions:
    """Options for writing a map.

    Parameters
    ----------
    place : "unit" or "disk"
        Placement of the texture coordinates.
    checker : bool
        Whether to add a checkerboard texture. GLB always has one.
    bake : Path, optional
        A texture for the file's own coordinates, to be repainted for the new ones.
    equal : bool
        Whether several surfaces get equal parts of the unit square, not parts by their areas.

    """

    place: Placement = "unit"
    checker: bool = False
    bake: Path | None = None
    equal: bool = False

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
    raise ParameterError.about(
        "{output_file}: {suffix} files cannot refer to a texture; use {checker} and {bake} with "
        ".glb, .obj or .ply.",
        output_file=output,
        suffix=suffix,
    )


def check_file_options(meshes: Sequence[Path], file_options: FileOptions) -> None:
    """Raise the texture errors of :func:`write_map` before anything is mapped.

    Raises
    ------
    ParameterError
        Both a checkerboard and a texture, or a texture for several surfaces, are requested.
    RenderError
        The texture cannot be read.

    """
    if file_options.bake is None:
        return
    from cembench.drawing.texture import read_texture

    if file_options.checker:
        raise ParameterError.about("{checker} and {bake} each give a texture; choose one.")
    if len(meshes) > 1:
        raise ParameterError.about("{bake} works with one surface; map them one by one.")
    read_texture(file_options.bake)


def write_map(
    output: Path, surface: SurfaceFile, z: Complex, file_options: FileOptions | None = None
) -> tuple[Notice, ...]:
    """Write a surface with its map as texture coordinates.

    An OBJ file that was not repaired keeps its content and gets the coordinates. A surface that was
    cut is written uncut, with coordinates per corner, if the format supports that.

    Parameters
    ----------
    output : Path
        OBJ, PLY, GLB, VTP or NPZ file.
    surface : SurfaceFile
        The surface and the file it was read from.
    z : complex128 (n,)
        The map.
    file_options : FileOptions, optional
        Placement of the coordinates, and the texture.

    Returns
    -------
    tuple of Notice
        A notice if rounding folds triangles in the file.

    Raises
    ------
    MeshError, ParameterError, RenderError
        A file cannot be written, or the texture cannot be read or does not fit.

    """
    file_options = file_options or FileOptions()
    moved = placed(z, file_options.place)
    textured = _textured(surface, moved)
    texture = _texture(surface, textured, file_options, output)
    original = None
    suffix = output.suffix.lower()
    if suffix == ".obj" == surface.path.suffix.lower() and not surface.repaired:
        text = surface.path.read_text(encoding="latin-1")  # any bytes, as they are
        corners = (surface.uncut.F, surface.cut.mesh.F) if surface.uncut and surface.cut else ()
        original = obj.with_uv(text, moved, *corners)
    _write(output, textured, texture, file_options, original)
    return _folded_by_rounding(output, z, moved, surface.mesh.F)


def write_shells(
    output: Path, shells: Shells, maps: Sequence[Complex], file_options: FileOptions
) -> tuple[Notice, ...]:
    """Write a file of several surfaces, with their maps side by side in the unit square.

    Otherwise like :func:`write_map`: an OBJ file keeps its content.
    """
    uv, corners = shells.together(maps, equal=file_options.equal)
    mesh = shells.whole
    whole = SurfaceFile(shells.path, mesh)
    textured = Soup.of_triangles(mesh.V, mesh.F, uv, corners, name=mesh.name)
    texture = _texture(whole, textured, file_options, output)
    original = None
    if output.suffix.lower() == ".obj" == shells.path.suffix.lower():
        text = shells.path.read_text(encoding="latin-1")  # any bytes, as they are
        original = obj.with_uv(text, uv, *(() if corners is None else (mesh.F, corners)))
    _write(output, textured, texture, file_options, original)
    before = np.zeros(len(uv), dtype=np.complex128)
    F = mesh.F if corners is None else corners
    for part, z, faces in zip(shells.parts, maps, shells.faces, strict=True):
        before[F[faces]] = z[part.mesh.F]
    return _folded_by_rounding(output, before, uv, F)


def write_corner_map(
    output: Path, surface: SurfaceFile, corners: Complex, file_options: FileOptions
) -> tuple[Notice, ...]:
    """Write a surface with one UV per corner (3 m,), as an atlas has.

    Raises
    ------
    MeshError, ParameterError, RenderError
        As for :func:`write_map`; a texture cannot be baked for an atlas.

    """
    if file_options.bake is not None:
        raise ParameterError.about("{bake} needs a map with one UV per vertex; this is an atlas.")
    mesh = surface.mesh
    found = cut_map(mesh, corners.reshape(-1, 3))
    moved = placed(found.uv, file_options.place)
    textured = Soup.of_triangles(mesh.V, mesh.F, moved, found.surface.F, name=mesh.name)
    _write(output, textured, _checker(file_options, output), file_options, None)
    return _folded_by_rounding(output, found.uv, moved, found.surface.F)


def save_map(
    output: Path, mesh: TriangleMesh, z: Complex, file_options: FileOptions | None = None
) -> tuple[Notice, ...]:
    """Write a surface that was not read from a file; like :func:`write_map`."""
    file_options = file_options or FileOptions()
    if file_options.bake is not None:
        raise ParameterError.about("{bake} needs a surface read from an OBJ file.")
    moved = placed(z, file_options.place)
    surface = Soup.of_triangles(mesh.V, mesh.F, moved, name=mesh.name)
    _write(output, surface, _checker(file_options, output), file_options, None)
    return _folded_by_rounding(output, z, moved, mesh.F)


def write_atlas(
    output: Path,
    surfaces: Sequence[SurfaceFile],
    maps: Sequence[Complex],
    file_options: FileOptions,
) -> tuple[Notice, ...]:
    """Write several surfaces to one file, with their maps side by side in the unit square.

    A GLB file gets a node for each surface; other formats get one mesh.
    """
    moved = packed(maps, areas_of(surfaces), equal=file_options.equal)
    parts = [_textured(file, z) for file, z in zip(surfaces, moved, strict=True)]
    texture = _checker(file_options, output)
    if output.suffix.lower() == ".glb":
        whole = gltf.write(*parts, texture=Texture(texture) if texture else None)
        write_bytes(output, whole, error=MeshError, parents=False)
    else:
        _write(output, _joined(parts), texture, file_options, None)
    told = [
        _folded_by_rounding(output, z, after, file.mesh.F)
        for file, z, after in zip(surfaces, maps, moved, strict=True)
    ]
    return tuple(notice for notices in told for notice in notices)


def placed(z: Complex, place: Placement) -> Complex:
    """Return a map moved to the placement of its texture coordinates."""
    return to_unit_square(z) if place == "unit" else z


def _textured(surface: SurfaceFile, moved: Complex) -> Soup:
    mesh, corners = surface.mesh, None
    if surface.uncut and surface.cut:
        mesh, corners = surface.uncut, surface.cut.mesh.F
    return Soup.of_triangles(mesh.V, mesh.F, moved, corners, name=surface.mesh.name)


def _texture(
    surface: SurfaceFile, textured: Soup, file_options: FileOptions, output: Path
) -> bytes | None:
    if file_options.bake is None:
        return _checker(file_options, output)
    from cembench.drawing.texture import baked_png, read_texture

    if surface.repaired:
        raise ParameterError.about(
            "{bake} needs the faces of the original file, but the surface was repaired; run "
            "`cembench repair` to see what it changes, and fix the file so that it keeps its UVs."
        )
    old = uv_of_faces(surface.path, textured.triangles)
    assert textured.uv is not None
    new = columns(textured.uv)[textured.uv_triangles]
    return baked_png(read_texture(file_options.bake), old, new)


def _checker(file_options: FileOptions, output: Path) -> bytes | None:
    if not file_options.checker and output.suffix.lower() != ".glb":
        return None
    from cembench.drawing.texture import checker_png

    return checker_png()


def _write(
    output: Path,
    surface: Soup,
    texture: bytes | None,
    file_options: FileOptions,
    original: str | None,
) -> None:
    """Write the files of a surface, the texture first, so that no file names a missing one."""
    image = Texture(texture) if texture else None
    for path in beside(output, file_options):
        if path.suffix == ".png":
            assert texture is not None
            write_bytes(path, texture, error=RenderError, parents=False)
            image = Texture(texture, path.name)
        else:
            assert image is not None
            write_bytes(path, obj.mtl_bytes(image.file), error=MeshError, parents=False)
    if output.suffix.lower() != ".obj":
        write_soup(output, surface, image)
        return
    text = original or obj.write(surface).decode()
    if file_options.textured:
        library = output.with_suffix(".mtl").name.encode("utf-8", "surrogateescape")
        text = obj.with_material(text, library.decode("latin-1"))
    write_bytes(output, text.encode("latin-1"), error=MeshError, parents=False)


def _joined(parts: Sequence[Soup]) -> Soup:
    """Return several surfaces joined into one mesh."""
    starts = np.cumsum([0, *(len(part.V) for part in parts)])
    coordinates = [part.uv for part in parts if part.uv is not None]
    uv_starts = np.cumsum([0, *(len(uv) for uv in coordinates)])
    indices = zip(parts, uv_starts, strict=False)
    return Soup.of_triangles(
        np.concatenate([part.V for part in parts]),
        np.concatenate([part.triangles + k for part, k in zip(parts, starts, strict=False)]),
        np.concatenate(coordinates),
        np.concatenate([part.uv_triangles + k for part, k in indices]),
    )


def _folded_by_rounding(
    output: Path, z: Complex, moved: Complex, F: NDArray[np.int64]
) -> tuple[Notice, ...]:
    """Return a notice of how many triangles rounding folds in the file."""
    single = output.suffix.lower() in SINGLE
    written = moved.astype(np.complex64).astype(np.complex128) if single else moved
    after = orientations(written, F)
    count = int(((orientations(z, F) > 0) & (after <= 0)).sum())
    if not count:
        return ()
    precision = "single precision" if single else "the unit square"
    remedy = "write OBJ, VTP or NPZ" if single else "uv='disk' (--uv disk) keeps the map as it is"
    told = (
        f"{count} of {len(F)} triangles are so small in the map that rounding to {precision} folds "
        f"or flattens them; {remedy}"
    )
    return (Notice(NoticeKind.FOLDED_BY_ROUNDING, told),)
