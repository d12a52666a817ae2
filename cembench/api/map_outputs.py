"""Outputs of `map_files`: their paths, the pictures, and what is written besides the maps."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cembench.api.components import Shells, areas_of
from cembench.api.settings import ON_THE_CIRCLE, Placement
from cembench.api.write_maps import FileOptions, flattened, save_map
from cembench.conformal.atlas import laid_out
from cembench.conformal.metrics import caption
from cembench.core.errors import MeshError, ParameterError
from cembench.core.names import file_name
from cembench.core.notices import Notice
from cembench.core.overwriting import refuse_twice
from cembench.mesh.defects import repair_advice
from cembench.mesh.files import check_writable_format, write_mesh
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh
from cembench.mesh.unit_square import packed
from cembench.registry import Algorithm
from cembench.results.records import Record
from cembench.running.measure import refinement_of


def write_extras(
    options: FileOptions, mesh: TriangleMesh, z: NDArray[np.complex128], record: Record
) -> tuple[Notice, ...]:
    """Write the extra files; return notices of triangles that rounding folds in the new mesh."""
    notices: tuple[Notice, ...] = ()
    for what, path in options.extras.items():
        if what == "geometry_image":
            from cembench.api.geometry_images import write_geometry_image

            write_geometry_image(path, mesh, z, options.side)
        elif what == "flat":
            write_mesh(path, flattened(mesh, z))
        elif what == "remeshed":
            from cembench.conformal.resample import regular_remesh

            notices = save_map(
                path, *regular_remesh(mesh, z, options.side), FileOptions(options.place)
            )
        else:
            from cembench.api.view import map_page
            from cembench.report.render.view_page import write_view_page

            write_view_page(path, map_page(mesh, z, record.outcome, record.title))
    return notices


def check_options(
    meshes: Sequence[Path], outputs: Sequence[Path | None], options: FileOptions
) -> None:
    """Raise the errors of textures and extra files before anything is mapped."""
    if options.checker and options.bake:
        raise ParameterError("`checker` and `bake` each give a texture; choose one.")
    if options.bake and len(meshes) > 1:
        raise ParameterError("`bake` works with one surface; map them one by one.")
    if options.bake:
        from cembench.drawing.texture import read_texture

        read_texture(options.bake)
    if options.textured and None in outputs:
        raise ParameterError(
            "`checker` and `bake` need a file that uses the texture: add `output`."
        )
    if len(set(outputs)) < len(outputs) and outputs[0] and options.place != "unit":
        raise ParameterError("surfaces in one file share the unit square: leave out `uv`.")
    if options.extras and len(meshes) > 1:
        raise ParameterError(
            "`geometry_image`, `remesh`, `flat` and `html` take one surface; map them one by one."
        )
    for what, path in options.extras.items():
        if what == "geometry_image":
            from cembench.api.geometry_images import check_image_format

            check_image_format(path)
        elif what in ("remeshed", "flat"):
            check_writable_format(path, with_uv=what == "remeshed")
        elif path.suffix.lower() not in (".html", ".htm"):
            raise ParameterError(f"{path}: `html` writes a web page; use the suffix .html.")
        elif not path.parent.is_dir():
            raise MeshError(f"{path}: there is no folder {path.parent}. Make it first.")


def check_shells(surfaces: int, path: Path, options: FileOptions) -> None:
    """Raise :class:`ParameterError` for options that a file of several surfaces cannot have."""
    holds = f"{path} holds {surfaces} surfaces"
    if surfaces > 1 and options.extras:
        raise ParameterError(
            f"{holds}; `geometry_image`, `remesh`, `flat` and `html` take one. "
            f"{repair_advice(path, {'components': 'all'})} gives each alone."
        )
    if surfaces > 1 and options.place != "unit":
        raise ParameterError(f"{holds}, which share the unit square: leave out `uv`.")


def check_square(candidates: Sequence[Algorithm], place: Placement) -> None:
    """Raise :class:`ParameterError` if a map that is no disk should fill the square."""
    other = next((a for a in candidates if a.target not in ON_THE_CIRCLE), None)
    if place == "square" and other is not None:
        raise ParameterError(
            f"uv='square' needs a map onto the disk, and {other.name} maps to another target "
            f"({other.target}): take algorithm='direct-cem'."
        )


def check_takes_disks(candidates: Sequence[Algorithm]) -> None:
    """Raise :class:`ParameterError` if no algorithm takes the disk that a cut makes."""
    if not any(issubclass(DiskMesh, algorithm.mesh_type) for algorithm in candidates):
        raise ParameterError(
            f"`cut` makes a disk, which {candidates[0].name} does not take; name an algorithm for "
            "disks (see `cembench list algorithms`)."
        )


def check_overlay_options(
    candidates: Sequence[Algorithm], *, cut: bool, bake: bool, apart: bool, threads: int
) -> None:
    """Raise :class:`ParameterError` for what a map on a refined mesh does not go with."""
    refinement_of(candidates[0])
    if cut:
        raise ParameterError(
            "`overlay` refines both banks of a cut in different places, so the surface cannot be "
            "written uncut: leave out `cut`, and map what `cembench cut MESH -o CUT.obj` writes."
        )
    if bake:
        raise ParameterError(
            "`overlay` makes triangles that the texture's own UVs do not know: leave out `bake`, "
            "and use `checker`."
        )
    if apart or threads > 1:
        raise ParameterError(
            "`overlay` maps in this process, with one thread and no limits: leave out `timeout`, "
            "`memory_bytes` and `threads`."
        )


def picture_files(
    sources: Sequence[Path],
    chosen: Sequence[Algorithm],
    outputs: Sequence[Path | None],
    *,
    overwrite: bool,
) -> list[Path]:
    """Return the path of each file's picture: beside its output, or in the current folder.

    Raises
    ------
    ParameterError
        Two pictures would have the same path.
    RenderError
        A file that is not one of our pictures would be overwritten.

    """
    pictures = [
        Path(f"{file_name(f'{source.stem}_{algorithm.name}')}.png")
        if target is None
        else target.with_suffix(".png")
        for source, algorithm, target in zip(sources, chosen, outputs, strict=True)
    ]
    refuse_twice(pictures, "pictures", "Draw them one at a time.")
    if not overwrite:
        from cembench.drawing.replaceable_pictures import check_replaceable

        for picture in pictures:
            check_replaceable(picture)
    return pictures


def output_files(meshes: Sequence[Path], output: Path | None) -> list[Path | None]:
    """Return the output path of each surface: a file, or files in a folder for several.

    If several surfaces go to one file, it is returned once for each.

    Raises
    ------
    MeshError
        The format cannot hold UVs, or the folder does not exist.
    ParameterError
        Two surfaces have the same name.

    """
    if output is None:
        return [None] * len(meshes)
    if not output.is_dir() and (len(meshes) == 1 or output.suffix):
        check_writable_format(output, with_uv=True)
        return [output] * len(meshes)
    if output.is_file():
        raise ParameterError(
            f"{output} is a file, but there are {len(meshes)} surfaces; name a folder with "
            "`output`."
        )
    if not output.parent.is_dir():
        raise MeshError(f"{output}: there is no folder {output.parent}. Make it first.")
    files = [
        output / f"{path.stem}{'.ply' if path.suffix.lower() == '.ply' else '.obj'}"
        for path in meshes
    ]
    refuse_twice(files, "surfaces", "Write them to different folders.")
    return list(files)


def draw_maps(
    shells: Shells,
    maps: Sequence[NDArray[np.complex128]],
    picture: Path,
    record: Record,
    *,
    equal: bool,
) -> None:
    """Draw the surfaces of a file and their maps as a PNG: one with its recorded figures."""
    from cembench.drawing.preview import write_preview

    if len(maps) == 1:
        title = f"{record.cell.mesh}: {record.title}"
        words = caption(record.outcome.metrics)
        mesh, z = shells.parts[0].mesh, maps[0]
        if record.target == "atlas":
            mesh, z = laid_out(mesh, z)
        turned = record.target != "atlas"
        write_preview(mesh, z, picture, title=title, caption=words, turned=turned)
        return
    moved = packed(maps, areas_of(shells.parts), equal=equal)
    joined = Shells.of(shells.parts)
    mesh = TriangleMesh.trusted(joined.V, joined.F, shells.path.stem)
    title = f"{shells.path.stem}: {len(maps)} surfaces"
    write_preview(mesh, np.concatenate(moved), picture, title=title, turned=False)
