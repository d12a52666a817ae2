"""The command `theory`: test Section 4 of the paper on a surface."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cembench.commands.console import Json, err, out, print_json
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import Faces
from cembench.commands.run import DEFAULT_RUN
from cembench.workflows.theory_verb import theory as examine

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
    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.registry import load_registry
    from cembench.results import run_folder
    from cembench.running.plan import surface_named
    from cembench.workflows.theory_exhibit import examine_theory
    from cembench.workflows.theory_facts import RIVAL

    run_folder.check(run)
    registry = load_registry()
    surfaces = [surface_named(registry, name, DiskMesh, faces) for name in meshes]
    found: list[Exhibit] = []
    iterations = call.keywords["iterations"]

    rival = registry.algorithms.get(RIVAL)
    size = "" if faces is None else f" --faces {faces}"
    for name, mesh in zip(meshes, surfaces, strict=True):
        command = f"cembench theory {Path(name).name} --iterations {iterations}{size}"
        with err.status(f"Section 4 on {mesh.name}", spinner="line"):
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
    from rich.text import Text

    from cembench.report.render.grid import figures, grid, names, words
    from cembench.results.exhibits import place_of
    from cembench.workflows.theory_facts import LOOKS

    facts = exhibit.facts
    vertices = f"{facts['vertices']:,} vertices, {facts['boundary_vertices']} on the boundary"
    out.print(f"{facts['mesh']}: {vertices}", style="bold", markup=False)
    for part in ("premises", "statements"):
        rows: list[list[str | Text]] = []
        for check in facts[part]:
            mark = Text("ok", style="green") if check["holds"] else Text("NO", style="bold red")
            figure = check["figure"]
            told = str(figure) if isinstance(figure, int) else f"{figure:.3g}"
            rows.append([Text.assemble(check["name"], "  ", (check["source"], "dim")), mark, told])
        out.print(grid([*words(part), names(""), *figures("figure")], rows, gap=2))
    energies: list[list[str]] = []
    for row in facts["energies"]:
        cells = [row[f"after_{k}"] for k in LOOKS] + [row["last"]]
        energies.append([row["name"], *("-" if c is None else f"{c:.6f}" for c in cells)])
    heads = figures(*(f"after {k}" for k in LOOKS), "last")
    out.print(grid([*words("E_C"), *heads], energies, gap=2))
    _show_certificate(facts["certificate"])
    out.print(exhibit.text, markup=False)
    out.print(f"picture  {place_of(run, exhibit.name, 'theory.png')}", soft_wrap=True, markup=False)


def _show_certificate(found: dict[str, Any]) -> None:
    from cembench.report.render.grid import figures, grid, words

    if "missing" in found:
        out.print(f"no modulus: {found['missing']}", markup=False)
        return
    rows = [
        ["surface, at least", f"{found['lower']:.5f}", ""],
        ["surface, at most", f"{found['upper']:.5f}", ""],
        ["middle of both", f"{found['modulus']:.5f}", f"{found['reciprocal_error']:.1e}"],
    ]
    for name, off in found["off"].items():
        image = "-" if off is None else f"{found['modulus'] * (1 + off):.5f}"
        rows.append([name, image, "-" if off is None else f"{off:+.1e}"])
    out.print(grid([*words("four boundary points"), *figures("modulus", "off by")], rows, gap=2))


#: Each command with the examples in its help.
VERBS = (
    (
        theory,
        "Examples:  cembench theory face.obj  ·  "
        "cembench theory spherical-cap --faces 5000 --run results/mine --json",
    ),
)
