"""Map the surfaces of mesh files, each in a process of its own, and write them with their UVs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cembench.api.settings import (
    AnyPath,
    Backend,
    MapTarget,
    Placement,
    Solves,
    Threads,
    Timeout,
    algorithms_named,
    bytes_of,
    installed_backend,
    registry_with,
)
from cembench.core.arguments import Range, checked
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from .maps import Maps

__all__ = ["map_files"]


@checked
def map_files(
    meshes: AnyPath | Sequence[AnyPath],
    algorithm: str | None = None,
    *,
    target: MapTarget | None = None,
    parameters: Mapping[str, Any] | None = None,
    output: AnyPath | None = None,
    uv: Placement = "unit",
    equal_parts: bool = False,
    checker: bool = False,
    bake: AnyPath | None = None,
    geometry_image: AnyPath | None = None,
    remesh: AnyPath | None = None,
    flat: AnyPath | None = None,
    side: Annotated[int, Range(4, 8192)] = 129,
    html: AnyPath | None = None,
    preview: bool = False,
    certificate: bool = False,
    overlay: bool = False,
    keep_invalid: bool = False,
    overwrite: bool = False,
    repair: bool = False,
    cut: bool = False,
    plugins: Sequence[str] = (),
    solves: Solves = "reuse",
    backend: Backend | None = None,
    threads: Threads = 1,
    timeout: Timeout = 600.0,
    memory_bytes: int | str | None = None,
    reporter: Reporter = SILENT,
) -> Maps:
    """Map the surfaces of files, check the maps, and write them.

    The UVs are the map, moved into the unit square: (z + 1 + i) / 2 for a disk. OBJ, VTP and NPZ
    hold all digits; PLY and GLB single precision. An OBJ file keeps its groups, materials, normals,
    colours and polygons. With `cut`, the uncut surface is written, with one UV per corner. Several
    surfaces written to one file share the unit square, each in its own part; larger surfaces get
    larger parts.

    Parameters
    ----------
    meshes : path or name, or sequence of them
        Mesh files (OBJ, OFF, PLY, STL, MAT), or names of surfaces; public ones are fetched.
    algorithm : str, optional
        Name of an algorithm, see :func:`cembench.list_algorithms`, instead of a `target`. best
        tries several and keeps the best map to the disk.
    target : {"plane", "disk", "circular holes"}, optional
        Take the recommended map to the plane, with a free boundary and the least angle errors, to
        the disk, with round holes if there are any, or to the disk with round holes alone (default:
        plane; disk with `certificate`, `geometry_image`, `remesh` or `uv="square"`, which need
        one).
    parameters : mapping, optional
        Parameters of the algorithm.
    output : path, optional
        Surface with UVs: OBJ, PLY, GLB, VTP, NPZ. For several surfaces: a folder, or a file with
        all of them.
    uv : {"unit", "square", "world", "disk"}
        Move the UVs into the unit square, let a map of the disk fill that square (conformally but
        for the corners), give them the surface's own units (equal total area), or keep the map as
        it is (a disk).
    equal_parts : bool
        Give several surfaces in one file equal parts of the unit square.
    checker : bool
        Add a checkerboard texture; GLB always has one.
    bake : path, optional
        A texture for the OBJ's own UVs, to be repainted for the new ones.
    geometry_image : path, optional
        Sample the surface on a grid: NPY, EXR or PNG.
    remesh : path, optional
        Remesh the surface through the map, and write it to this file.
    flat : path, optional
        Write the flattened mesh, the image of the map with z = 0, in the surface's own units: OBJ,
        OFF, PLY, STL, GLB, VTP, NPZ.
    side : int
        Samples along a side, for `geometry_image` and `remesh`.
    html : path, optional
        Write a page with a 3-D view of surface and map; works offline.
    preview : bool
        Draw a PNG beside the output; folded triangles are red.
    certificate : bool
        Enclose the conformal modulus of each disk between four boundary points, or the capacities
        of the holes, which a conformal map keeps, and compare the map's. Takes two solves, or two
        for each hole.
    overlay : bool
        Map with cetm-flips, and write the mesh cut along the edges of its flipped triangulation: a
        refinement of the surface, with more triangles, on which the map has no folds.
    keep_invalid : bool
        Write invalid maps too.
    overwrite : bool
        Overwrite the input, a picture not made by cembench, or files in a folder.
    repair : bool
        Repair the mesh files first, like :func:`cembench.repair`.
    cut : bool
        Cut the surface into a disk first, like :func:`cembench.cut`.
    plugins : sequence of str
        Python files or ``module:name`` with more algorithms.
    solves : {"reuse", "backslash"}
        Reuse factorisations, or factor at every solve.
    backend : str, optional
        The library that factors matrices (default: cvxopt if it is installed, else superlu).
        cvxopt-metis makes smaller factors of large meshes, in more time.
    threads : int
        Threads of the numerical libraries.
    timeout : float
        Time limit of a call, in seconds. The default applies to calls that have their own process:
        those of plug-ins and programs, with several threads, or where memory may be short.
    memory_bytes : int or str, optional
        Memory limit per process, e.g. 4GiB; at least 256MiB (default: 90 % of free memory).
    reporter : Reporter
        Receives what is being done.

    Returns
    -------
    Maps
        An iterable: each surface is mapped and written when it is asked for.

    Raises
    ------
    MeshError
        A file cannot be read, or its surface is not of a kind that the algorithm takes.
    ParameterError
        Options exclude each other, a file would be overwritten, or there is no `overlay` of the
        algorithm.
    RegistryError
        The algorithm is unknown.

    Examples
    --------
    >>> import cembench
    >>> cembench.write_mesh("flat.obj", cembench.surface("flat-disk", 200))
    >>> (mapped,) = cembench.map_files(["flat.obj"], output="flat_uv.obj")
    >>> mapped.ok, mapped.written["output"]
    (True, 'flat_uv.obj')
    """
    from os import PathLike
    from pathlib import Path

    from cembench.api.fetch import local_files
    from cembench.core.overwriting import refuse_inputs, refuse_present, refuse_twice
    from cembench.running.options import Options
    from cembench.running.plan import MeasurementSettings, Task, plan_cells, provenance_of

    from .components import read_shells
    from .maps import FileJobs, Maps
    from .outputs import (
        check_algorithms,
        check_options,
        check_shells,
        output_files,
        picture_file,
    )
    from .writing import FileOptions

    def path_of(path: AnyPath | None) -> Path | None:
        return None if path is None else Path(path)

    options = Options(timeout=timeout, memory_bytes=bytes_of(memory_bytes))
    settings = MeasurementSettings(solves, installed_backend(backend), threads, repeats=1)
    registry = registry_with(plugins, reporter)
    needs_disk = certificate or geometry_image or remesh or uv == "square"
    if algorithm is None and target is None and needs_disk:
        target = "disk"
    candidates = [registry.algorithm(name) for name in algorithms_named(algorithm, target)]
    own_process = timeout != Options.timeout or memory_bytes is not None
    if isinstance(meshes, str | PathLike):
        meshes = [meshes]
    paths, named_output = [Path(mesh) for mesh in meshes], path_of(output)
    outputs = output_files(paths, named_output)
    named = {"geometry_image": geometry_image, "remeshed": remesh, "flat": flat, "html": html}
    extras = {what: Path(path) for what, path in named.items() if path is not None}
    file_options = FileOptions(uv, checker, path_of(bake), equal_parts, side, extras)
    check_algorithms(
        *(candidates, file_options),
        surfaces=len(paths),
        cut=cut,
        overlay=overlay,
        limited=own_process or threads > 1,
    )
    check_options(paths, outputs, file_options)
    sources = local_files(paths, registry, reporter)
    written = list(dict.fromkeys(path for path in outputs if path is not None))
    others = [path for file in written for path in file_options.beside(file)]
    inputs = [*sources, *([file_options.bake] if file_options.bake else [])]
    all_files = [*written, *others, *file_options.extras.values()]
    refuse_twice(all_files, "files", "Name another path for one of them.")
    for path in all_files:
        refuse_inputs(path, inputs, force=overwrite)
    refuse_present(others if named_output in outputs else [*written, *others], force=overwrite)
    together = named_output if len(paths) > 1 and named_output in outputs else None
    files = []
    for source, place in zip(sources, outputs, strict=True):
        with reporter.busy(f"reading {source}"):
            shells = read_shells(source, registry, candidates, mend=repair, cut=cut)
        check_shells(len(shells.parts), source, file_options)
        tasks: list[Task] = []
        for mesh in (part.mesh for part in shells.parts):
            taken = next(a for a in candidates if isinstance(mesh, a.mesh_type))
            role = {mesh.name: provenance_of(registry, mesh)}
            tasks += plan_cells([taken], [mesh], parameters or {}, settings, plugins, role)
        to = None if together else place
        picture = picture_file(source, tasks[0].algorithm, to) if preview else None
        files.append(FileJobs(shells, tuple(tasks), to, picture))
    pictures = [file.picture for file in files if file.picture is not None]
    refuse_twice(pictures, "pictures", "Draw them one at a time.")
    refuse_twice([*all_files, *pictures], "files", "Name another path for one of them.")
    for picture in pictures if not overwrite else ():
        from cembench.drawing.replaceable_pictures import check_replaceable

        check_replaceable(picture)
    for folder in {path.parent for path in written}:
        folder.mkdir(exist_ok=True)
    return Maps(
        *(files, options, file_options, together, reporter),
        keep_invalid=keep_invalid,
        certificate=certificate,
        overlay=overlay,
        own_process=own_process,
    )


def add_command() -> None:
    """Add the command of this verb."""
    from . import map_command  # noqa: F401 - it registers itself
