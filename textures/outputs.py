"""The files that `map_files` writes: their paths, the pictures, and what excludes each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from cembench.api.settings import ON_THE_CIRCLE
from cembench.core.errors import MeshError, ParameterError
from cembench.core.names import file_name
from cembench.core.overwriting import refuse_twice
from cembench.mesh.defects import repair_advice
from cembench.mesh.files import check_writable_format
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import Algorithm
from cembench.running.measure import refinement_of

from .writing import FileOptions


def check_algorithms(
    candidates: Sequence[Algorithm],
    options: FileOptions,
    *,
    surfaces: int,
    cut: bool,
    overlay: bool,
    limited: bool,
) -> None:
    """Raise :class:`ParameterError` for what an algorithm does not go with.

    `limited` says whether a call has limits or several threads, and so a process of its own.
    """
    first, bake = candidates[0], options.bake
    other = next((a for a in candidates if a.target not in ON_THE_CIRCLE), first)
    atlas = next((a for a in candidates if a.target == "atlas"), None)
    if overlay:
        refinement_of(first)
    exclusions: dict[str, object] = {
        "`overlay` refines both banks of a cut in different places, so the surface cannot be "
        "written uncut: leave out `cut`, and map what `cembench cut` writes.": overlay and cut,
        "`overlay` makes triangles that the texture's own UVs do not know: leave out `bake`, and "
        "use `checker`.": overlay and bake,
        "`overlay` maps in this process, with one thread and no limits: leave out `timeout`, "
        "`memory_bytes` and `threads`.": overlay and limited,
        f"`cut` makes a disk, which {first.name} does not take; name an algorithm for disks (see "
        "`cembench list algorithms`).": cut
        and not any(issubclass(DiskMesh, a.mesh_type) for a in candidates),
        f"uv='square' needs a map onto the disk, and {other.name} maps to another target "
        f"({other.target}): take algorithm='direct-cem'.": options.place == "square"
        and other.target not in ON_THE_CIRCLE,
        f"{first.name} makes an atlas: map one surface at a time, without `geometry_image`, "
        "`remesh`, `flat` and `bake`, which need one UV per vertex.": atlas
        and (options.extras.keys() - {"html"} or bake or surfaces > 1),
    }
    _refuse(exclusions)


def _refuse(exclusions: Mapping[str, object]) -> None:
    """Raise :class:`ParameterError` with the first message that is true of the call."""
    for message, excluded in exclusions.items():
        if excluded:
            raise ParameterError(message)


def check_options(
    meshes: Sequence[Path], outputs: Sequence[Path | None], options: FileOptions
) -> None:
    """Raise the errors of textures and extra files before anything is mapped."""
    several, shared = len(meshes) > 1, len(set(outputs)) < len(outputs) and outputs[0]
    exclusions: dict[str, object] = {
        "`checker` and `bake` each give a texture; choose one.": options.checker and options.bake,
        "`bake` works with one surface; map them one by one.": options.bake and several,
        "`checker` and `bake` need a file that uses the texture: add `output`.": options.textured
        and None in outputs,
        "surfaces in one file share the unit square: leave out `uv`.": shared
        and options.place != "unit",
        "`geometry_image`, `remesh`, `flat` and `html` take one surface; map them one by "
        "one.": options.extras and several,
    }
    _refuse(exclusions)
    if options.bake:
        from .bake import read_texture

        read_texture(options.bake)
    for what, path in options.extras.items():
        if what == "geometry_image":
            from .geometry_images import check_image_format

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
    exclusions: dict[str, object] = {
        f"{holds}; `geometry_image`, `remesh`, `flat` and `html` take one. "
        f"{repair_advice(path, {'components': 'all'})} gives each alone.": options.extras,
        f"{holds}, which share the unit square: leave out `uv`.": options.place != "unit",
    }
    if surfaces > 1:
        _refuse(exclusions)


def picture_file(source: Path, algorithm: Algorithm, output: Path | None) -> Path:
    """Return the path of a file's picture: beside its output, or in the current folder."""
    name = file_name(f"{source.stem}_{algorithm.name}")
    return Path(f"{name}.png") if output is None else output.with_suffix(".png")


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
