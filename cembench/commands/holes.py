"""The command `holes`: the steps of Koebe's method and its result."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cembench.api.holes import holes as examine
from cembench.api.holes import holes_command
from cembench.commands.console import SHOWN, Json, complain, out, print_json
from cembench.commands.from_api import Call, from_api
from cembench.commands.run import DEFAULT_RUN

#: The surface that is mapped where none is named.
STAND_IN = "ho-face-with-holes"


@from_api(examine, without=("surface", "reporter"))
def holes(
    call: Call,
    meshes: Annotated[
        list[str],
        typer.Argument(
            metavar="MESH", help="Surface with holes: a mesh file, or a registered name."
        ),
    ] = [STAND_IN],  # noqa: B006 - typer copies defaults
    *,
    run: Annotated[
        Path, typer.Option("--run", "-o", "--output", help="Add the exhibits to this run.")
    ] = DEFAULT_RUN,
    as_json: Json = False,
) -> None:
    """Print a table of all surfaces, and add it to the run."""
    from cembench.api.holes_exhibits import write_holes_table
    from cembench.mesh.triangle_mesh import HoledMesh
    from cembench.report.content.exhibits import tables_shown
    from cembench.results import run_folder
    from cembench.running.surfaces import load_surface

    run_folder.check(run)
    given = call.keywords
    for name in meshes[1:]:  # a wrong one ends the command before the first takes its time
        load_surface(name, (HoledMesh,), faces=given["faces"]).outer_and_holes(given["outer"])
    rows = [row for name in meshes for row in call(name, run=run, reporter=SHOWN).rows]
    command = holes_command([Path(name).name for name in meshes], **given)
    exhibit = write_holes_table(rows, run, command)
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
