"""Exhibits of Koebe's method on surfaces with holes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from cembench.api.parameterize import Result
from cembench.conformal.metrics import circle_of, dirichlet_energy, image_area
from cembench.core.atomic import write_bytes
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import MapStep
from cembench.drawing import painter
from cembench.drawing.compose import INK
from cembench.drawing.preview import write_preview
from cembench.drawing.scene import Board, folded_by, image_in_window, surface_in_window
from cembench.mesh.triangle_mesh import HoledMesh
from cembench.registry import Algorithm
from cembench.results.exhibits import (
    Exhibit,
    ExhibitPicture,
    ExhibitTable,
    exhibit_folder,
    write_exhibit,
)
from cembench.results.papers import usual_paper
from cembench.results.records import MeshOrigin, Record
from cembench.running.local import map_once
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, plan_cells

from .exhibit_tables import exhibit_table
from .holes import STAND_IN, HoledMaps
from .page import page

#: Maximum number of steps in a picture; further steps are left out.
MAX_STEPS = 4
#: Pixels of a step's picture, how many are in a row, and how boundaries are drawn on them.
SIDE, COLUMNS = 460, 4
OPEN, CLOSED = {"color": "#c8553d", "linewidth": 1.8}, {"color": INK, "linewidth": 0.8}


def examine_holes(
    mesh: HoledMesh,
    algorithms: Sequence[Algorithm],
    outer: int | None,
    sweeps: int,
    run: Path | None,
    command: str,
    warn: Callable[[str], object],
    tell: Callable[[str], object] = lambda _: None,
) -> HoledMaps:
    """Map a surface by every algorithm; return a row for each, and the first valid map of each.

    Two exhibits are written if there is a `run`. `outer` is a vertex of the outer boundary,
    `sweeps` the maximum number of sweeps, `command` the command that recreates the exhibits. `warn`
    is called if Koebe's method fails, `tell` before each step.
    """
    rows: list[dict[str, Any]] = []
    maps: dict[str, Result] = {}
    for algorithm in algorithms:
        steps: list[MapStep] = []
        counts: list[int | None] = [None]
        if algorithm.steps:
            try:
                tell(f"{algorithm.title} on {mesh.name}: sweep 1 of {sweeps}")
                for step in algorithm.steps(mesh, sweeps=sweeps, outer=outer):
                    steps.append(step)
                    tell(_next_step(mesh, algorithm, step, sweeps))
                counts = [*sorted({1, _best_sweep(mesh, steps)})]
            except AlgorithmFailed as error:
                warn(f"{mesh.name}: {error}")
                counts = [1]
        for count in counts:
            swept = f", {count} sweep{'s' if count > 1 else ''}" if count else ""
            tell(f"{algorithm.title} on {mesh.name}{swept}: mapping, checking")
            row, record, uv = _measured(mesh, algorithm, outer, count)
            rows.append(row)
            if uv is not None and record.outcome.status == "ok":
                maps.setdefault(algorithm.name, Result(mesh, algorithm, uv, record.outcome))
            if uv is not None and count == 1 and run is not None:
                tell(f"{algorithm.title} on {mesh.name}: drawing")
                _write_figure_exhibits(mesh, steps, uv, record, outer, run, command)
    return HoledMaps(maps, rows)


def _next_step(mesh: HoledMesh, algorithm: Algorithm, step: MapStep, sweeps: int) -> str:
    count = len(mesh.loops)
    done = f"boundary {step.boundary + 1} of {count} is a circle"
    return f"{algorithm.title} on {mesh.name}: sweep {step.sweep} of {sweeps}, {done}"


def _best_sweep(mesh: HoledMesh, steps: list[MapStep]) -> int:
    """Return the first sweep whose final map has an E_C within 1 % of the lowest."""
    results = [step.result for step in steps if step.result is not None]
    energies = [dirichlet_energy(mesh, uv) - image_area(mesh, uv) for uv in results]
    enough = min(energies) * (1.01 if min(energies) > 0 else 0.99)
    return 1 + next(k for k, energy in enumerate(energies) if energy <= enough)


def _measured(
    mesh: HoledMesh, algorithm: Algorithm, outer: int | None, sweeps: int | None
) -> tuple[dict[str, Any], Record, Any]:
    """Return a row for one checked call in its own process."""
    known = {parameter.name for parameter in algorithm.parameters}
    arguments = {"outer": outer, "sweeps": sweeps}
    parameters = {k: v for k, v in arguments.items() if v is not None and k in known}
    task = plan_cells([algorithm], [mesh], parameters, MeasurementSettings(repeats=1))[0]
    record, uv = map_once(task, Options())
    outcome = record.outcome
    row = {
        "mesh": mesh.name,
        "faces": mesh.m,
        "holes": len(mesh.loops) - 1,
        "algorithm": algorithm.name,
        "sweeps": sweeps,
        "status": outcome.status,
        "cause": outcome.cause,
        **outcome.metrics,
        "circularity_before_rounding": outcome.extras.get("circularity_before_rounding"),
        "boundaries": [boundary.model_dump() for boundary in outcome.boundaries],
        "iterations": outcome.iterations,
        "seconds": outcome.median_seconds,
        "phases": outcome.phases,
    }
    return row, record, uv


def _write_figure_exhibits(
    mesh: HoledMesh,
    steps: list[MapStep],
    uv: Any,
    record: Record,
    outer: int | None,
    run: Path,
    command: str,
) -> None:
    """Write the exhibits of the map, and of the steps of the first sweep."""
    origin: MeshOrigin = "stand-in" if mesh.name == STAND_IN else "surface"
    alternative = "A checkerboard on the surface and on its image, a disk with circular holes."

    def exhibit(kind: str, file: str, caption: str, **more: Any) -> None:
        picture = ExhibitPicture(file=file, caption=caption, alternative=alternative)
        figure = usual_paper().exhibited(kind)
        shared: dict[str, Any] = {"command": command, "origin": origin, "figure": figure}
        name = f"{kind}-{mesh.name}"
        write_exhibit(run, Exhibit(name=name, pictures=(picture,), **shared, **more))

    figures = {name: record.outcome.metrics[name] for name in _FIGURES}
    caption = (
        f"E_C {figures['conformal_energy']:.4f}   "
        f"mean angle error {figures['angle_error_mean_deg']:.2f} degrees   "
        f"circularity error {figures['boundary_circularity']:.1g}   "
        f"{figures['flipped_triangles']} folds"
    )
    picture = exhibit_folder(run, f"koebe-map-{mesh.name}") / "map.png"
    write_preview(mesh, uv, picture, title=f"{mesh.name}: {record.title}", caption=caption)
    exhibit(
        "koebe-map",
        picture.name,
        caption,
        title=f"{mesh.name} and its image, a disk with circular holes",
        text=f"The result of one sweep of Koebe's method. {caption}.",
        facts=figures,
    )
    if len(mesh.loops) > MAX_STEPS:
        return
    first = [step for step in steps if step.sweep == 1]
    outer_loop, others = mesh.outer_and_holes(outer)
    loops = (outer_loop, *others)
    picture = exhibit_folder(run, f"koebe-steps-{mesh.name}") / "steps.png"
    title = f"{mesh.name}: the steps of Koebe's method"
    write_bytes(picture, steps_page(mesh, loops, first, uv, title))
    words = (
        "(a) The surface. Then, in turn: one boundary (red) is left open and the others are filled,"
        " CEM makes the open one a circle; the next boundary is turned outside by an inversion at "
        "its centroid. The checkerboard is that of the final map throughout."
    )
    exhibit(
        "koebe-steps",
        picture.name,
        words,
        title=f"The steps of Koebe's method on {mesh.name}",
        text=words,
        tables=(_steps_table(loops, first),),
        facts={"iterations": [len(step.energies) - 1 for step in first]},
    )


def steps_page(
    mesh: HoledMesh, loops: Sequence[Any], steps: Sequence[MapStep], final: Any, title: str
) -> bytes:
    """Return a PNG of the surface and the images of all steps, four per row.

    All are under the checkerboard of the final map. Where it and an image are conformal, small
    squares have right angles.
    """
    panels: list[tuple[str, Any, Any]] = [("the surface", None, None)]
    for step in steps:
        loop = loops[step.boundary]
        name = f"hole {step.boundary}" if step.boundary else "outer boundary"
        if step.before is not None:
            panels.append((f"{name} turned outside", step.before, loop))
        panels.append((f"{name} made a circle", step.uv, loop))
    space = surface_in_window(mesh)
    board = Board.of(mesh.F, space, final)
    pictures, notes, marks = [], [], {}
    for number, (label, uv, opened) in enumerate(panels):
        folded = folded_by(final if uv is None else uv, mesh.F)
        if uv is None:
            drawn = painter.surface_panel(mesh.F, space, SIDE)
        else:
            drawn = painter.image_panel(mesh.F, space, uv, folded, SIDE)
            curves = ((loop, image_in_window(uv)[[*loop, loop[0]], :2]) for loop in mesh.loops)
            marks[divmod(number, COLUMNS)] = [
                (curve, OPEN if set(loop) == set(opened) else CLOSED) for loop, curve in curves
            ]
        pictures.append(painter.paint(drawn, painter.checkerboard(drawn, board), folded))
        notes.append(f"({chr(ord('a') + number)}) {label}")
    rows = [pictures[k : k + COLUMNS] for k in range(0, len(panels), COLUMNS)]
    words = [notes[k : k + COLUMNS] for k in range(0, len(panels), COLUMNS)]
    return page(rows, [title], notes=words, marks=marks)


def _steps_table(loops: Sequence[Any], steps: list[MapStep]) -> ExhibitTable:
    """Return the circularity of each boundary after each step of the sweep."""
    names = ("outer", *(f"hole {k}" for k in range(1, len(loops))))
    rows: tuple[tuple[str | float | None, ...], ...] = tuple(
        (
            names[step.boundary],
            len(step.energies) - 1,
            *(circle_of(loop, step.uv[loop]).circularity for loop in loops),
        )
        for step in steps
    )
    columns = ("opened", "iterations", *(f"circularity, {name}" for name in names))
    return ExhibitTable(
        title="Circularity after each step, before rounding", columns=columns, rows=rows
    )


#: The figures of a map in its exhibit.
_FIGURES = (
    "angle_error_mean_deg",
    "conformal_energy",
    "boundary_circularity",
    "flipped_triangles",
)


def holes_table(rows: Sequence[dict[str, Any]], command: str) -> Exhibit:
    """Return a table of the figures of all surfaces as an exhibit, which `command` makes."""
    standing = {row["mesh"] for row in rows} <= {STAND_IN}
    return Exhibit(
        name="holes",
        title="Surfaces with holes",
        text="Koebe's method after one sweep and after the best number of sweeps, and the "
        "other maps to a disk with holes.",
        command=command,
        origin="stand-in" if standing else "surface",
        tables=(exhibit_table("holes", rows),),
        facts={"rows": rows},
    )
