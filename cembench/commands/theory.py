"""The command `theory`: test Section 4 of the paper on a surface."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cembench.api.theory import theory as examine
from cembench.commands.console import SHOWN, Json, out, print_json
from cembench.commands.from_api import Call, from_api
from cembench.commands.run import DEFAULT_RUN

if TYPE_CHECKING:
    from cembench.api.theory_facts import TheoryFacts


@from_api(examine, without=("surface", "reporter"))
def theory(
    call: Call,
    meshes: Annotated[
        list[str],
        typer.Argument(metavar="MESH...", help="Mesh file, or a name from `list surfaces`."),
    ],
    *,
    run: Annotated[
        Path, typer.Option("--run", "-o", "--output", help="Add the exhibits to this run.")
    ] = DEFAULT_RUN,
    as_json: Json = False,
) -> None:
    """Print what was tested; exit with 1 if a statement fails although all premises hold."""
    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.results import run_folder
    from cembench.running.surfaces import load_surface

    run_folder.check(run)
    for name in meshes[1:]:  # a wrong one ends the command before the first takes its time
        load_surface(name, (DiskMesh,), faces=call.keywords["faces"])
    found = [call(name, run=run, reporter=SHOWN) for name in meshes]
    if as_json:
        print_json([one.facts for one in found])
    else:
        for one in found:
            _show(one, run)
    if any(one.facts["premises_hold"] and not one.facts["statements_hold"] for one in found):
        raise typer.Exit(1)


def _show(found: TheoryFacts, run: Path) -> None:
    from cembench.api.theory_exhibit import PICTURE, theory_exhibit
    from cembench.report.content.exhibits import tables_shown
    from cembench.results.exhibits import place_of

    facts, exhibit = found.facts, theory_exhibit(found)
    vertices = f"{facts['vertices']:,} vertices, {facts['boundary_vertices']} on the boundary"
    out.print(f"{facts['mesh']}: {vertices}", style="bold", markup=False)
    out.print(tables_shown(exhibit))
    out.print(exhibit.text, markup=False)
    out.print(f"picture  {place_of(run, exhibit.name, PICTURE)}", soft_wrap=True, markup=False)


#: Each command with the examples in its help.
VERBS = (
    (
        theory,
        "Examples:  cembench theory face.obj  ·  "
        "cembench theory spherical-cap --faces 5000 --run results/mine --json",
    ),
)
