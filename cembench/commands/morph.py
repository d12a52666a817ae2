"""The verb that morphs surfaces into each other."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from time import perf_counter
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
    print_pair,
    registry_with,
    split,
)
from cembench.commands.options import Faces, Parameters, Plugins, Timeout, finite
from cembench.core.errors import AlgorithmFailed, MeshError, ParameterError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.registry import Registry
    from cembench.workflows.morphing.morph import Morph


class Pose(StrEnum):
    """What is done to the later surfaces before the path is drawn through them."""

    similarity = "similarity"
    rigid = "rigid"
    keep = "keep"


def morph(
    surfaces: Annotated[
        list[str], typer.Argument(help="Two or more: mesh files, or names of `list surfaces`.")
    ],
    *,
    landmarks: Annotated[
        Path | None,
        typer.Option(
            help="CSV, a row each: name, vertex on the first surface, on the second, ...; or none."
        ),
    ] = None,
    output: Annotated[
        list[Path],
        typer.Option(
            "-o", "--output", help="FILM.gif or .mp4, MESH.obj or .ply, FOLDER, .npz. Repeatable."
        ),
    ] = [],  # noqa: B006 - typer copies defaults
    algorithm: Annotated[
        str, typer.Option("-a", "--algorithm", help="Any with target disk.")
    ] = "cem",
    parameter: Parameters = [],  # noqa: B006
    lam: Annotated[
        float,
        typer.Option(
            "--lambda",
            min=1e-6,
            max=1e12,
            callback=finite,
            help="Weight of the landmarks in (34).",
        ),
    ] = 100.0,
    reach: Annotated[
        float,
        typer.Option(
            min=0,
            max=1,
            callback=finite,
            help="Radius of a landmark, in its distance to the next; 0: a vertex.",
        ),
    ] = 0.4,
    frames: Annotated[
        int, typer.Option(min=2, max=100_000, help="Of the whole path; 24 a second.")
    ] = 48,
    views: Annotated[
        str, typer.Option(help="Of a film, with commas.")
    ] = "front,side,three-quarter",
    size: Annotated[int, typer.Option(min=64, max=2160, help="Pixels of a view's side.")] = 480,
    pose: Annotated[
        Pose, typer.Option(help="Turn, move and scale the later surfaces to the first; or not.")
    ] = Pose.similarity,
    faces: Faces = None,
    run: Annotated[
        Path | None, typer.Option("--run", help="Lay pictures and figures into this run's folder.")
    ] = None,
    plugin: Plugins = [],  # noqa: B006
    timeout: Timeout = 600.0,
    force: Annotated[bool, typer.Option("--force", help="Write over the surfaces read.")] = False,
    as_json: Json = False,
) -> None:
    """Morph surfaces into each other through conformal maps (Section 6).

    The first landmark goes to the centre of the disk, the others are registered by (34), and the
    first surface's vertices are carried onto all others. Without --landmarks those are taken that
    the surfaces have by name, as the generated faces do; with none at all, curvature aligns them.
    """
    from cembench.core.outputs import refuse_inputs
    from cembench.drawing.camera import viewpoints
    from cembench.results import run_folder
    from cembench.workflows.morphing.drawing import check_views
    from cembench.workflows.morphing.landmarks import common_landmarks, read_landmarks
    from cembench.workflows.morphing.morph import morph as morphed
    from cembench.workflows.morphing.writers import check_output, files_of

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
        raise ParameterError("a morph needs two surfaces or more; name at least one other.")
    registry = registry_with(plugin)
    meshes, known = [], []
    for name in surfaces:
        with err.status(f"reading {name}", spinner="line"):
            mesh, named = _surface(registry, name, faces)
        for notice in mesh.notices:
            note(f"{mesh.name}: {notice}")
        meshes.append(mesh)
        known.append(named)
    if landmarks is None or str(landmarks) == "none":
        places = common_landmarks(meshes, [{} for _ in known] if landmarks else known)
    else:
        places = read_landmarks(landmarks, meshes, known)
    seconds: dict[str, float] = {}
    started = perf_counter()
    maps = _maps(registry, meshes, algorithm, assignments(parameter), plugin, timeout)
    seconds["maps"] = perf_counter() - started
    started = perf_counter()
    first = meshes[0]
    right, up, _ = viewpoints(first)["front"]
    with err.status("registering", spinner="line") as status:
        try:
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
        seconds["registration"] = perf_counter() - started
        status.update("measuring")
        figures: dict[str, Any] = {
            "surfaces": [mesh.name for mesh in meshes],
            "landmarks": list(places.names),
            "algorithm": algorithm,
            "lambda": lam,
            "reach": reach,
            "frames": frames,
        } | found.metrics(frames)
    written = _write(found, output, frames, chosen_views, size, seconds)
    if run is not None:
        given = [*surfaces, *(["--landmarks", str(landmarks)] if landmarks else [])]
        given += [] if faces is None else ["--faces", str(faces)]
        command = f"cembench morph {' '.join(given)} --run {run}"
        written += _lay_down(run, found, figures, command, registry, surfaces)
    if as_json:
        print_json(figures | {"seconds": seconds, "written": [str(path) for path in written]})
        return
    _print(figures, places.names)
    for path in written:
        print_pair("written", path)
    if not written:
        out.print("Nothing was written; add -o FILM.gif to see it.", style="dim")


def _surface(
    registry: Registry, name: str, faces: int | None
) -> tuple[DiskMesh, Mapping[str, int]]:
    """The surface of a file or of a registered name, and its landmarks by name."""
    from cembench.mesh.files import read_mesh
    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.running.plan import generate_surface

    if Path(name).suffix or name not in registry.surfaces:
        if not Path(name).suffix and not Path(name).exists():
            raise ParameterError(
                f"{name!r} is neither a mesh file nor a surface; surfaces: "
                f"{', '.join(sorted(registry.surfaces))}."
            )
        return read_mesh(name), {}
    mesh = generate_surface(registry, name, faces)
    if not isinstance(mesh, DiskMesh):
        raise MeshError(
            f"{name} has {len(mesh.loops)} boundary loops; a morph needs topological disks, with "
            "exactly one."
        )
    find = registry.surface(name).landmarks
    return mesh, find(mesh) if find else {}


def _maps(
    registry: Registry,
    meshes: list[DiskMesh],
    algorithm: str,
    parameters: dict[str, str],
    plugins: list[str],
    timeout: float,
) -> list[NDArray[Any]]:
    """A checked map of each surface; exit code 1 where there is none."""
    from cembench.running.local import Options, map_once
    from cembench.running.plan import MeasurementSettings, plan_cells

    chosen = registry.algorithm(algorithm)
    if chosen.target != "disk":
        able = ", ".join(a.name for a in registry.algorithms.values() if a.target == "disk")
        raise ParameterError(
            f"{algorithm} maps to the target {chosen.target!r}; a morph needs the disk: {able}."
        )
    maps = []
    for mesh in meshes:
        (task,) = plan_cells([chosen], [mesh], parameters, MeasurementSettings(repeats=1), plugins)
        with err.status(f"{chosen.title} on {mesh.name}", spinner="line"):
            record, uv = map_once(task, Options(timeout=timeout))
        if record.outcome.status != "ok" or uv is None:
            complain(f"{mesh.name}: {record.outcome.status}: {record.outcome.cause}")
            raise typer.Exit(1)
        maps.append(uv)
    return maps


def _write(
    found: Morph,
    outputs: list[Path],
    frames: int,
    views: list[str],
    size: int,
    seconds: dict[str, float],
) -> list[Path]:
    """Write the path to every place asked for."""
    import numpy as np

    from cembench.workflows.morphing import writers
    from cembench.workflows.morphing.drawing import Film, draw_film

    times, first = np.linspace(0, 1, frames), found.meshes[0]
    films = [path for path in outputs if path.suffix.lower() in writers.FILMS]
    others = [path for path in outputs if path not in films]
    with err.status("writing", spinner="line") as status:

        def tell(frame: int) -> None:
            status.update(f"frame {frame + 1} of {frames}")

        started = perf_counter()
        for path in others:
            if path.suffix.lower() in writers.ARRAYS and not path.is_dir():
                writers.write_arrays(path, first, times, found.at)
            else:
                writers.write_meshes(path, first, times, found.at, tell)
        if others:
            seconds["frames"] = perf_counter() - started
        started = perf_counter()
        if films:
            film = Film.of(first, found.stops, times, views, size)
            pictures, notice = draw_film(film, tell)
            if notice:
                note(notice, style="dim")
            for path in films:
                writers.write_film(path, pictures)
            seconds["film"] = perf_counter() - started
    return list(outputs)


def _lay_down(
    run: Path,
    found: Morph,
    figures: dict[str, Any],
    command: str,
    registry: Registry,
    surfaces: list[str],
) -> list[Path]:
    from cembench.running.plan import paper_roles
    from cembench.workflows.morphing.exhibit import lay_down

    generated = [name for name in surfaces if name in registry.surfaces]
    standing = paper_roles(registry, generated)
    rows = tuple(standing[name].paper_row if name in standing else "" for name in surfaces)
    with err.status("drawing", spinner="line") as status:
        return lay_down(run, found, figures, command, rows, status.update)


def _print(figures: dict[str, Any], landmarks: tuple[str, ...]) -> None:
    """The figures in words."""
    print_pair("landmarks", ", ".join(landmarks) or "none: aligned by curvature")
    for row in figures["registrations"]:
        out.print(f"\n{row['surface']}", style="bold")
        steps = len(row["lambdas"])
        lines = {
            "lambda": f"{figures['lambda']:g}"
            + (f", reached in {steps} steps without folds" if steps > 1 else "")
            if steps
            else "-",
            "landmark error": "-"
            if row["landmark_error_share"] is None
            else f"{row['landmark_error_share']:.2e} of the surface's size",
            "Dirichlet energy": f"{row['dirichlet_energy']:.4f}",
            "dilatation": "beyond numbers: a triangle nearly without area"
            if row["dilatation_max"] is None
            else f"{row['dilatation_mean']:.2f} in the mean, {row['dilatation_max']:.1f} at most",
            "folded triangles": f"{row['flipped_triangles']}",
            "distance": f"{row['distance_mean_edges']:.3f} mean edges in the mean, "
            f"{row['hausdorff_edges']:.2f} at most",
        }
        for name, words in lines.items():
            out.print(f"  {name:<17} {words}", markup=False)
    out.print("\npath", style="bold")
    out.print(f"  acceleration      {figures['largest_acceleration_share']:.3f} sizes at most")
    out.print(
        f"  step              {figures['largest_step_share']:.4f} sizes at most "
        f"between two of {figures['frames']} frames\n"
    )


#: The verb with the examples that its help shows.
VERBS = (
    (
        morph,
        "Examples:  cembench morph a.obj b.obj --landmarks ab.csv -o ab.gif  ·  "
        "cembench morph liu-wry-face liu-neutral-face liu-smile-face --faces 8000 -o liu.mp4  ·  "
        "cembench morph a.ply b.ply -o frames/ab.obj -o ab.npz --json",
    ),
)
