"""The command `morph`: morph surfaces into each other."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from time import perf_counter
from typing import Annotated, Any

import typer

from cembench.commands.console import (
    Json,
    assignments,
    complain,
    err,
    note,
    out,
    print_json,
    print_pair,
    registry_with,
    split,
)
from cembench.commands.options import Faces, Parameters, Plugins, Timeout, finite
from cembench.core.errors import AlgorithmFailed, ParameterError


class Pose(StrEnum):
    """How the later surfaces are moved before the path is drawn through them."""

    similarity = "similarity"
    rigid = "rigid"
    keep = "keep"


def morph(
    surfaces: Annotated[
        list[str], typer.Argument(help="Two or more mesh files, or names from `list surfaces`.")
    ],
    *,
    landmarks: Annotated[
        Path | None,
        typer.Option(
            help="CSV file, one row per landmark: name, vertex on each surface, from 0; or `none`."
        ),
    ] = None,
    output: Annotated[
        list[Path],
        typer.Option(
            "-o", "--output", help="FILM.gif or .mp4, MESH.obj or .ply, FOLDER, .npz. Repeatable."
        ),
    ] = [],  # noqa: B006 - typer copies defaults
    algorithm: Annotated[
        str, typer.Option("-a", "--algorithm", help="An algorithm with target disk.")
    ] = "cem",
    parameter: Parameters = [],  # noqa: B006
    lam: Annotated[
        float,
        typer.Option(
            "--lambda",
            min=1e-6,
            max=1e12,
            callback=finite,
            help="Weight of the landmarks in Eq. 34.",
        ),
    ] = 100.0,
    reach: Annotated[
        float,
        typer.Option(
            min=0,
            max=1,
            callback=finite,
            help="Landmark radius, as a share of the distance to the next; 0: the vertex alone.",
        ),
    ] = 0.4,
    frames: Annotated[
        int, typer.Option(min=2, max=100_000, help="Number of frames, played at 24 per second.")
    ] = 48,
    views: Annotated[
        str, typer.Option(help="Views of a film, comma-separated.")
    ] = "front,side,three-quarter",
    size: Annotated[int, typer.Option(min=64, max=2160, help="Side of a view, in pixels.")] = 480,
    pose: Annotated[
        Pose,
        typer.Option(
            help="Fit the later surfaces to the first by rotation, shift and scale, or keep them."
        ),
    ] = Pose.similarity,
    faces: Faces = None,
    run: Annotated[
        Path | None, typer.Option("--run", help="Add the pictures and figures to this run.")
    ] = None,
    plugin: Plugins = [],  # noqa: B006
    timeout: Timeout = 600.0,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the input files.")] = False,
    as_json: Json = False,
) -> None:
    """Morph surfaces into each other through conformal maps (Section 6).

    The first landmark goes to the centre of the disk, the others are registered
    by Eq. 34, and the first surface's vertices are carried onto all others. By
    default, the named landmarks that all surfaces have are used, such as those of
    the generated faces. Without any landmarks, curvature aligns the surfaces.
    """
    from cembench.core.outputs import refuse_inputs
    from cembench.drawing.camera import viewpoints
    from cembench.results import run_folder
    from cembench.workflows.morphing.drawing import check_views
    from cembench.workflows.morphing.exhibit import write_morph_exhibits
    from cembench.workflows.morphing.landmarks import common_landmarks, read_landmarks
    from cembench.workflows.morphing.morph import morph as morphed
    from cembench.workflows.morphing.surfaces_and_films import (
        checked_maps,
        disk_with_landmarks,
        rows_of_paper,
        write_films,
        write_path,
    )
    from cembench.workflows.morphing.writers import FILMS, check_output, files_of

    chosen_views = split([views])
    check_views(chosen_views)
    sources = [Path(name) for name in surfaces] + ([landmarks] if landmarks else [])
    for place in output:
        check_output(place)
        for file in files_of(place, frames):
            refuse_inputs(file, sources, force=force)
    if run is not None:
        run_folder.check(run)
    if len(surfaces) < 2:
        raise ParameterError("a morph needs two surfaces or more; name at least one more.")
    registry = registry_with(plugin)
    meshes, known = [], []
    for name in surfaces:
        with err.status(f"reading {name}", spinner="line"):
            mesh, named = disk_with_landmarks(registry, name, faces)
        for notice in mesh.notices:
            note(f"{mesh.name}: {notice}")
        meshes.append(mesh)
        known.append(named)
    if landmarks is None or str(landmarks) == "none":
        places = common_landmarks(meshes, [{} for _ in known] if landmarks else known)
    else:
        places = read_landmarks(landmarks, meshes, known)
    seconds: dict[str, float] = {}
    first = meshes[0]
    right, up, _ = viewpoints(first)["front"]
    with err.status("mapping", spinner="line") as status:
        try:
            with _timed(seconds, "maps"):
                maps = checked_maps(
                    registry,
                    meshes,
                    algorithm,
                    assignments(parameter),
                    plugin,
                    timeout,
                    status.update,
                )
            with _timed(seconds, "registration"):
                found = morphed(
                    meshes,
                    maps,
                    places,
                    lam=lam,
                    reach=reach,
                    pose=pose.value,
                    upright=first.V @ right + 1j * (first.V @ up),
                    tell=status.update,
                )
        except AlgorithmFailed as error:
            complain(str(error))
            raise typer.Exit(1) from None
        status.update("measuring")
        figures: dict[str, Any] = {
            "surfaces": [mesh.name for mesh in meshes],
            "landmarks": list(places.names),
            "algorithm": algorithm,
            "lambda": lam,
            "reach": reach,
            "frames": frames,
        } | found.metrics(frames)
        films = [path for path in output if path.suffix.lower() in FILMS]
        others = [path for path in output if path not in films]
        if others:
            with _timed(seconds, "frames"):
                write_path(found, others, frames, status.update)
        if films:
            with _timed(seconds, "film"):
                write_films(found, films, frames, chosen_views, size, status.update)
        written = list(output)
        if run is not None:
            given = [*surfaces, *(["--landmarks", str(landmarks)] if landmarks else [])]
            given += [] if faces is None else ["--faces", str(faces)]
            command = f"cembench morph {' '.join(given)} --run {run}"
            standing = rows_of_paper(registry, surfaces)
            written += write_morph_exhibits(run, found, figures, command, standing, status.update)
    if as_json:
        print_json(figures | {"seconds": seconds, "written": [str(path) for path in written]})
        return
    _print(figures, places.names)
    for path in written:
        print_pair("written", path)
    if not written:
        out.print("Nothing was written; add -o FILM.gif to see it.", style="dim")


@contextmanager
def _timed(seconds: dict[str, float], name: str) -> Iterator[None]:
    started = perf_counter()
    yield
    seconds[name] = perf_counter() - started


def _print(figures: dict[str, Any], landmarks: tuple[str, ...]) -> None:
    """Print the figures."""
    from cembench.report.content.exhibits import exhibit_table
    from cembench.workflows.morphing.exhibit import morph_tables

    print_pair("landmarks", ", ".join(landmarks) or "none: aligned by curvature")
    print_pair("lambda", f"{figures['lambda']:g}" if landmarks else "-")
    for table in morph_tables(figures):
        out.print(exhibit_table(table, "", "surface"))


#: The command with the examples in its help.
VERBS = (
    (
        morph,
        "Examples:  cembench morph a.obj b.obj --landmarks ab.csv -o ab.gif  ·  "
        "cembench morph liu-wry-face-stand-in liu-smile-face-stand-in --faces 8000 -o liu.mp4  ·  "
        "cembench morph a.ply b.ply -o frames/ab.obj -o ab.npz --json",
    ),
)
