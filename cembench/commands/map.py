"""The command `map`: map surfaces and write them with their UVs."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cembench.commands.console import (
    Json,
    assignments,
    complain,
    err,
    note,
    out,
    print_json,
    print_notices,
    print_pair,
    registry_with,
)
from cembench.commands.external import Command, Settings, declared_command
from cembench.commands.fetch import fetched
from cembench.commands.options import (
    Backend,
    BackendOption,
    Memory,
    Parameters,
    Plugins,
    Repair,
    Solves,
    SolvesOption,
    Threads,
    Timeout,
    installed_backend,
    memory_bytes,
)
from cembench.core.errors import ParameterError
from cembench.linear_algebra.backends import default_backend
from cembench.workflows.places import Place

if TYPE_CHECKING:
    from cembench.workflows.map_surfaces import Mapped

#: Default algorithms, in order of preference; the first that takes the surface is used.
USUAL = ("direct-cem", "direct-cem-holes")
EXAMPLES = (
    "Examples:  cembench map face.obj -o face_uv.obj --preview  ·  "
    "cembench map face.ply -a cem -p max_iterations=13 --json  ·  cembench map left-hand  ·  "
    "cembench map scan.obj --repair -o scan_uv.obj  ·  cembench map head.obj --cut -o uv.obj  ·  "
    "cembench map a.obj b.obj -o maps/"
)


def map_(
    meshes: Annotated[
        list[Path],
        typer.Argument(
            metavar="MESH...", help="Mesh files (OBJ, OFF, PLY, STL, MAT), or names from `fetch`."
        ),
    ],
    *,
    algorithm: Annotated[
        str | None,
        typer.Option(
            "-a",
            "--algorithm",
            help="See `list` (default: direct-cem; direct-cem-holes for surfaces with holes).",
        ),
    ] = None,
    parameter: Parameters = [],  # noqa: B006
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Surface with UVs: OBJ, PLY, GLB, VTP, NPZ. For several surfaces: a folder, or "
            "a file with all of them.",
        ),
    ] = None,
    place: Annotated[
        Place,
        typer.Option(
            "--uv", help="Move the UVs into the unit square, or keep the map as it is (a disk)."
        ),
    ] = Place.unit,
    checker: Annotated[
        bool, typer.Option("--checker", help="Add a checkerboard texture; GLB always has one.")
    ] = False,
    bake: Annotated[
        Path | None,
        typer.Option(help="A texture for the OBJ's own UVs, to be repainted for the new ones."),
    ] = None,
    samples: Annotated[
        Path | None,
        typer.Option("--geometry-image", help="Sample the surface on a grid: NPY, EXR or PNG."),
    ] = None,
    remeshed: Annotated[
        Path | None,
        typer.Option(
            "--remesh", help="Remesh the surface through the map, and write it to this file."
        ),
    ] = None,
    side: Annotated[
        int,
        typer.Option(
            min=4, max=8192, help="Samples along a side, for --geometry-image and --remesh."
        ),
    ] = 129,
    page: Annotated[
        Path | None,
        typer.Option(
            "--html", help="Write a page with a 3-D view of surface and map; works offline."
        ),
    ] = None,
    preview: Annotated[
        bool,
        typer.Option("--preview", help="Draw a PNG beside the output; folded triangles are red."),
    ] = False,
    keep_invalid: Annotated[
        bool,
        typer.Option("--keep-invalid", help="Write invalid maps too; the exit code stays 1."),
    ] = False,
    force: Annotated[
        bool,
        typer.Option(
            "--force", help="Overwrite the input, a picture not made by `map`, or files in FOLDER."
        ),
    ] = False,
    mend: Repair = False,
    cut: Annotated[
        bool,
        typer.Option("--cut", help="Cut the surface into a disk first, like `cembench cut`."),
    ] = False,
    plugin: Plugins = [],  # noqa: B006
    command: Command = None,
    program: Settings = [],  # noqa: B006
    solves: SolvesOption = Solves.reuse,
    backend: BackendOption = Backend(default_backend()),  # noqa: B008
    threads: Threads = 1,
    timeout: Timeout = 600.0,
    memory: Memory = None,
    as_json: Json = False,
) -> None:
    """Map surfaces, check the maps, and write them.

    The UVs are the map, moved into the unit square: (z + 1 + i) / 2 for a disk.
    OBJ, VTP and NPZ hold all digits; PLY and GLB single precision. An OBJ file
    keeps its groups, materials, normals, colours and polygons. With --cut, the
    uncut surface is written, with one UV per corner. Several surfaces written to
    one file share the unit square, each in its own part; larger surfaces get
    larger parts.
    """
    from cembench.core.outputs import refuse_inputs, refuse_present
    from cembench.drawing.own_pictures import check_replaceable
    from cembench.results.record_rows import row
    from cembench.running.options import Options
    from cembench.running.plan import MeasurementSettings
    from cembench.workflows import map_files
    from cembench.workflows.map_extras import Extras, check_extras, check_shells
    from cembench.workflows.map_places import check_takes_disks, output_files, picture_files
    from cembench.workflows.map_surfaces import (
        FileJobs,
        incomplete,
        jobs_of,
        map_surfaces,
        write_together,
    )
    from cembench.workflows.shells import read_shells

    options = Options(timeout=timeout, memory_bytes=memory_bytes(memory))
    declared, named = declared_command(command, program)
    if named and algorithm:
        raise ParameterError("-a and --command both name an algorithm; give only one of them.")
    plugin = [*plugin, *declared]
    registry = registry_with(plugin)
    asked_for = named or ([algorithm] if algorithm else USUAL)
    candidates = [registry.algorithm(name) for name in asked_for]
    if cut:
        check_takes_disks(candidates)
    outputs = output_files(meshes, output)
    file_options = map_files.FileOptions(place, checker, bake)
    extras = Extras(samples, remeshed, side, place, page)
    check_extras(meshes, outputs, file_options, extras)
    is_atlas = any(a.target == "atlas" for a in candidates)
    if is_atlas and (extras.files or bake or len(meshes) > 1):
        raise ParameterError(
            f"{candidates[0].name} makes an atlas: map one surface at a time, without "
            "--geometry-image, --remesh, --html and --bake, which need one UV per vertex."
        )
    known = [path for path in meshes if not path.exists() and str(path) in registry.datasets]
    fetched_files = {path: fetched(registry.dataset(str(path))) for path in known}
    sources = [fetched_files.get(path, path) for path in meshes]
    targets = list(dict.fromkeys(target for target in outputs if target is not None))
    others = [path for target in targets for path in map_files.beside(target, file_options)]
    for target in (*targets, *others, *extras.files):
        refuse_inputs(target, [*sources, *([bake] if bake else [])], force=force)
    refuse_present(others if output in outputs else [*targets, *others], force=force)
    together = len(meshes) > 1 and output in outputs
    how = MeasurementSettings(solves.value, installed_backend(backend), threads, repeats=1)
    files = []
    for source, place_of in zip(sources, outputs, strict=True):
        with err.status(f"reading {source}", spinner="line"):
            shells = read_shells(source, candidates, mend=mend, cut=cut)
        check_shells(len(shells.parts), source, file_options, extras)
        jobs = jobs_of(shells, registry, candidates, assignments(parameter), how, plugin)
        files.append(FileJobs(shells, jobs, None if together else place_of))
    if preview and is_atlas:
        note("no picture was drawn: the islands of an atlas have no fixed positions in the plane")
    elif preview:
        chosen = [file.jobs[0].task.algorithm for file in files]
        drawn_files = picture_files(sources, chosen, [file.output for file in files])
        for picture in drawn_files if not force else ():
            check_replaceable(picture)
        files = [
            replace(file, picture=drawn) for file, drawn in zip(files, drawn_files, strict=True)
        ]
    for folder in {target.parent for target in targets}:
        folder.mkdir(exist_ok=True)
    count = sum(len(file.jobs) for file in files)
    found: list[Mapped] = []
    busy = partial(err.status, spinner="line")
    for mapped in map_surfaces(
        files, options, file_options, extras, busy, keep_invalid=keep_invalid
    ):
        found.append(mapped)
        for path, notice in mapped.told:
            note(f"{path}: {notice}")
        if not as_json:
            print_notices([mapped.surface.mesh])
            if count > 1:
                _show_line(mapped, len(found), count)
            else:
                _show_all(mapped, keep_invalid=keep_invalid)
    missing = incomplete(files, found, keep_invalid=keep_invalid)
    if together and output is not None:
        if all(m.uv is not None and (m.ok or keep_invalid) for m in found):
            for notice in write_together(output, found, file_options):
                note(f"{output}: {notice}")
        else:
            missing.append(output)
    if as_json:
        more = {"output": str(output)} if together and not missing else {}
        rows = [row(m.record) | _repair_of(m) | more | dict(m.written) for m in found]
        print_json(rows if len(rows) > 1 else rows[0])
    elif together and not missing:
        print_pair("output", output)
    for mapped in found:
        if not mapped.ok:
            complain(_failure(mapped, named=count > 1))
    for path in missing:
        complain(f"{path} was not written, because one of its surfaces has no map")
    if missing or not all(mapped.ok for mapped in found):
        raise typer.Exit(1)


def _failure(mapped: Mapped, *, named: bool) -> str:
    outcome = mapped.record.outcome
    kept = " (written anyway, because of --keep-invalid)" if mapped.written else ""
    which = f"{mapped.record.cell.mesh}: " if named else ""
    return f"{which}{outcome.status}: {outcome.cause}{kept}"


def _repair_of(mapped: Mapped) -> dict[str, Any]:
    repaired = mapped.surface.repaired
    return {"repair": repaired.counts} if repaired else {}


def _show_all(mapped: Mapped, *, keep_invalid: bool) -> None:
    """Print all figures of a single mapped surface, and the files written."""
    from cembench.report.run_tables import figures_table

    out.print(figures_table(mapped.record))
    for what, where in mapped.written.items():
        print_pair(what, where)
    if mapped.uv is not None and not mapped.written:
        more = "" if mapped.ok or keep_invalid else " --keep-invalid"
        out.print(f"Nothing was written; add{more} -o FILE.obj to keep the map.", style="dim")


def _show_line(mapped: Mapped, number: int, count: int) -> None:
    """Print one of several mapped surfaces on a line: status, figures and files."""
    record = mapped.record
    metrics = record.outcome.metrics
    parts = [f"{number:>{len(str(count))}} of {count}  {record.cell.mesh}: {record.outcome.status}"]
    parts.append(f"{record.mesh.faces:,} triangles")
    if metrics.get("angle_error_mean_deg") is not None:
        parts.append(f"{metrics['angle_error_mean_deg']:.2f} degrees")
        parts.append(f"{metrics.get('flipped_triangles', 0)} folds")
    where = [mapped.written[what] for what in ("output", "preview") if what in mapped.written]
    parts += where[:1]
    out.print("  ".join(parts), soft_wrap=True)
