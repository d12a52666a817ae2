"""The command `theory`: test Section 4 of the paper on a surface."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cembench.api.theory import theory as examine
from cembench.commands.console import SHOWN, Json, out, print_json
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import Faces
from cembench.commands.run import DEFAULT_RUN

if TYPE_CHECKING:
    from cembench.results.exhibits import Exhibit


@from_api(examine, without=("surface",))
def theory(
    call: Call,
    meshes: Annotated[
        list[str],
        typer.Argument(metavar="MESH...", help="Mesh file, or a name from `list surfaces`."),
    ],
    *,
    faces: Faces = None,
    run: Annotated[
        Path, typer.Option("--run", "-o", "--output", help="Add the exhibits to this run.")
    ] = DEFAULT_RUN,
    as_json: Json = False,
) -> None:
    """Print what was tested; exit with 1 if a statement fails although all premises hold."""
    from cembench.api.theory_exhibit import examine_theory
    from cembench.api.theory_facts import RIVAL
    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.registry import load_registry
    from cembench.results import run_folder
    from cembench.running.surfaces import load_surface

    run_folder.check(run)
    registry = load_registry()
    surfaces = [load_surface(name, (DiskMesh,), faces=faces, registry=registry) for name in meshes]
    found: list[Exhibit] = []
    iterations = call.keywords["iterations"]

    rival = registry.algorithms.get(RIVAL)
    size = "" if faces is None else f" --faces {faces}"
    for name, mesh in zip(meshes, surfaces, strict=True):
        command = f"cembench theory {Path(name).name} --iterations {iterations}{size}"
        with SHOWN.busy(f"Section 4 on {mesh.name}"):
            found.append(examine_theory(mesh, rival, iterations, run, command))
    if as_json:
        print_json([exhibit.facts for exhibit in found])
    else:
        for exhibit in found:
            _show(exhibit, run)
    facts = [exhibit.facts for exhibit in found]
    if any(one["premises_hold"] and not one["statements_hold"] for one in facts):
        raise typer.Exit(1)


def _show(exhibit: Exhibit, run: Path) -> None:
    from cembench.report.content.exhibits import tables_shown
    from cembench.results.exhibits import place_of

    facts = exhibit.facts
    vertices = f"{facts['vertices']:,} vertices, {facts['boundary_vertices']} on the boundary"
    out.print(f"{facts['mesh']}: {vertices}", style="bold", markup=False)
    out.print(tables_shown(exhibit))
    out.print(exhibit.text, markup=False)
    out.print(f"picture  {place_of(run, exhibit.name, 'theory.png')}", soft_wrap=True, markup=False)


#: Each command with the examples in its help.
VERBS = (
    (
        theory,
        "Examples:  cembench theory face.obj  ·  "
        "cembench theory spherical-cap --faces 5000 --run results/mine --json",
    ),
)
