"""Write the surfaces of files with their maps, their textures, and what else is wished."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cembench.api.parameterize import Result
from cembench.api.save_map import (
    checker_texture,
    joined,
    placed,
    save_map,
    texture_files,
    write_with_uv,
)
from cembench.api.settings import Placement
from cembench.conformal.atlas import cut_map, laid_out
from cembench.conformal.laplacian import double_areas
from cembench.conformal.metrics import caption
from cembench.core.arrays import Complex
from cembench.core.errors import ParameterError
from cembench.core.notices import Notice
from cembench.mesh.files import write_mesh
from cembench.mesh.formats import obj
from cembench.mesh.soup import Soup, columns
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.results.records import Record
from cembench.running.surfaces import SurfaceFile

from .components import Shells
from .packing import packed


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
    #: The files besides the surfaces with their maps, by kind: "geometry_image", "remeshed",
    #: "flat", "html".
    extras: Mapping[str, Path] = field(default_factory=dict)

    @property
    def textured(self) -> bool:
        """Whether a texture file is written beside formats that cannot hold one."""
        return self.checker or self.bake is not None

    def beside(self, output: Path) -> list[Path]:
        """Return the files that are written beside an output."""
        return texture_files(output) if self.textured else []


def write_shells(
    output: Path,
    shells: Shells,
    maps: Sequence[Complex],
    options: FileOptions,
    *,
    atlas: bool = False,
) -> tuple[Notice, ...]:
    """Write the surfaces of a file with their maps; return a notice if rounding folds triangles.

    The maps of several surfaces lie side by side in the unit square. An OBJ file that was not
    repaired keeps its content and gets the coordinates. A surface that was cut is written uncut,
    with coordinates per corner; an `atlas` has an image for each corner anyway.
    """
    mesh, several = shells.parts[0].mesh, len(maps) > 1
    if atlas:
        cut = cut_map(mesh, maps[0].reshape(-1, 3))
        uv = placed(cut.uv, options.place, mesh, cut.surface.F)
        soup = Soup.of_triangles(mesh.V, mesh.F, uv, cut.surface.F, name=mesh.name)
        texture = checker_texture(output, checker=options.checker)
        return write_with_uv(output, [soup], cut.uv, options.place, texture)
    uv, corners = shells.joined(moved(shells.parts, maps, options))
    name = shells.path.stem if several else mesh.name
    soup = Soup.of_triangles(shells.V, shells.F, uv, corners, name=name)
    texture, text = _texture(output, soup, options, shells), _obj_text(output, soup, shells)
    return write_with_uv(output, [soup], shells.joined(maps)[0], options.place, texture, text)


def write_together(
    output: Path, files: Sequence[SurfaceFile], maps: Sequence[Complex], options: FileOptions
) -> tuple[Notice, ...]:
    """Write surfaces to a file that keeps nothing of those they were read from."""
    soups = []
    for file, z in zip(files, moved(files, maps, options), strict=True):
        mesh, corners = file.uncut or file.mesh, file.mesh.F if file.uncut else None
        soups.append(Soup.of_triangles(mesh.V, mesh.F, z, corners, name=file.mesh.name))
    texture = checker_texture(output, checker=options.checker)
    return write_with_uv(output, soups, np.concatenate(maps), options.place, texture)


def moved(
    files: Sequence[SurfaceFile], maps: Sequence[Complex], options: FileOptions
) -> list[Complex]:
    """Return maps where their coordinates lie: several side by side, by their surfaces' areas."""
    meshes = [file.mesh for file in files]
    if len(maps) == 1:
        return [placed(maps[0], options.place, meshes[0], meshes[0].F)]
    areas = [float(double_areas(mesh.V, mesh.F).sum()) for mesh in meshes]
    return packed(maps, areas, equal=options.equal)


def draw_maps(
    files: Sequence[SurfaceFile],
    maps: Sequence[Complex],
    picture: Path,
    record: Record,
    options: FileOptions,
) -> None:
    """Draw the surfaces of a file and their maps as a PNG: one with its recorded figures."""
    from cembench.drawing.preview import write_preview

    mesh, z, name = files[0].mesh, maps[0], files[0].path.stem
    title, about = f"{record.cell.mesh}: {record.title}", caption(record.outcome.metrics)
    if len(maps) > 1:
        together = zip(files, moved(files, maps, options), strict=True)
        whole = joined([Soup.of_triangles(f.mesh.V, f.mesh.F, uv) for f, uv in together])
        assert whole.uv is not None
        mesh, z = TriangleMesh.trusted(whole.V, whole.triangles, name), whole.uv
        title, about = f"{name}: {len(maps)} surfaces", ""
    elif record.target == "atlas":
        mesh, z = laid_out(mesh, z)
    turned = len(maps) == 1 and record.target != "atlas"
    write_preview(mesh, z, picture, title=title, caption=about, turned=turned)


def write_extras(options: FileOptions, result: Result) -> tuple[Notice, ...]:
    """Write the extra files; return notices of triangles that rounding folds in the new mesh."""
    notices: tuple[Notice, ...] = ()
    for what, path in options.extras.items():
        if what == "geometry_image":
            from .geometry_images import write_geometry_image

            write_geometry_image(path, result.mesh, result.geometry_image(options.side))
        elif what == "flat":
            write_mesh(path, result.flat())
        elif what == "remeshed":
            from .resample import regular_remesh

            new = regular_remesh(result.mesh, result.z, options.side)
            notices = save_map(path, *new, options.place)
        else:
            result.show(path)
    return notices


def _obj_text(output: Path, soup: Soup, source: Shells) -> str:
    """Return the source's OBJ file with other coordinates; empty if there is none to keep."""
    if {output.suffix.lower(), source.path.suffix.lower()} != {".obj"} or not source.as_read:
        return ""
    text = source.path.read_text(encoding="latin-1")  # any bytes, as they are
    per_corner = any(part.cut for part in source.parts)
    assert soup.uv is not None
    return obj.with_uv(text, soup.uv, *((soup.triangles, soup.uv_triangles) if per_corner else ()))


def _texture(output: Path, soup: Soup, options: FileOptions, source: Shells) -> bytes | None:
    """Return the texture as PNG; None if there is none."""
    if options.bake is None:
        return checker_texture(output, checker=options.checker)
    from .bake import baked_png, read_texture, uv_of_faces

    if not source.as_read:
        raise ParameterError(
            "`bake` needs the faces of the original file, but the surface was repaired, or is not "
            "of a file; `cembench repair` shows what it changes. Fix the file so that it keeps "
            "its UVs."
        )
    old = uv_of_faces(source.path, soup.triangles)
    assert soup.uv is not None
    return baked_png(read_texture(options.bake), old, columns(soup.uv)[soup.uv_triangles])
