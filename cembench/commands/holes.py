"""The command `holes`: the steps of Koebe's method and its result."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cembench.api.holes import holes as map_all
from cembench.commands.console import SHOWN, Json, complain, out, print_json
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import Faces
from cembench.commands.run import DEFAULT_RUN

#: The surface that is mapped where none is named.
STAND_IN = "ho-face-with-holes"


@from_api(map_all, only=("outer",))
def holes(
    call: Call,
    meshes: Annotated[
        list[str],
        typer.Argument(
            metavar="MESH", help="Surface with holes: a mesh file, or a registered name."
        ),
    ] = [STAND_IN],  # noqa: B006 - typer copies defaults
    *,
    sweeps: Annotated[
        int, typer.Option(min=1, max=1000, help="Maximum number of sweeps to try.")
    ] = 8,
    faces: Faces = None,
    run: Annotated[
        Path, typer.Option("--run", "-o", "--output", help="Add the exhibits to this run.")
    ] = DEFAULT_RUN,
    as_json: Json = False,
) -> None:
    """Map surfaces with holes, and draw the steps of Koebe's method.

    One sweep is the paper's Algorithm 2. The table compares it with the best
    number of sweeps, by conformal energy, and with every other algorithm for this
    class. docs/holes.md explains it.
    """
    from cembench.api.holes_exhibits import examine_holes, write_holes_table
    from cembench.mesh.triangle_mesh import HoledMesh
    from cembench.registry import load_registry
    from cembench.report.content.exhibits import tables_shown
    from cembench.results import run_folder
    from cembench.running.surfaces import load_surface

    run_folder.check(run)
    outer = call.keywords["outer"]
    registry = load_registry()
    surfaces = [load_surface(name, (HoledMesh,), faces=faces, registry=registry) for name in meshes]
    for mesh in surfaces:
        mesh.outer_and_holes(outer)
    algorithms = [a for a in registry.algorithms.values() if a.target == "circular holes"]
    rows: list[dict[str, Any]] = []
    options = "".join(
        f" --{option} {value}"
        for option, value in (("outer", outer), ("sweeps", sweeps), ("faces", faces))
        if value is not None
    )
    for name, mesh in zip(meshes, surfaces, strict=True):
        with SHOWN.busy(f"Koebe's method on {mesh.name}") as tell:
            command = f"cembench holes {Path(name).name}{options}"
            rows += examine_holes(mesh, algorithms, outer, sweeps, run, command, complain, tell)
    files = " ".join(Path(name).name for name in meshes)
    exhibit = write_holes_table(rows, run, f"cembench holes {files}{options}")
    if as_json:
        print_json(rows)
    else:
        out.print(tables_shown(exhibit))
        out.print(f"\nExhibits: {(run / 'exhibits').resolve()}", soft_wrap=True, markup=False)
    bad = [row for row in rows if row["status"] != "ok"]
    for row in bad:
        complain(f"{row['mesh']} / {row['algorithm']}: {row['status']}: {row['cause']}")
    if bad:
        raise typer.Exit(1)


#: Each command with the examples in its help.
VERBS = (
    (
        holes,
        "Examples:  cembench holes face_with_holes.obj --sweeps 4 --run results/mine  ·  "
        "cembench holes ho-face-with-holes --faces 20000 --json",
    ),
)
