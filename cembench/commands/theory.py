"""The verb that puts Section 4 of the paper to the test on a surface."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cembench.commands.console import Json, err, out, print_json
from cembench.commands.options import Faces
from cembench.commands.run import DEFAULT_RUN

if TYPE_CHECKING:
    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.registry import Algorithm
    from cembench.results.exhibits import Exhibit
    from cembench.workflows.theory import Check


def theory(
    meshes: Annotated[
        list[str],
        typer.Argument(metavar="MESH...", help="Surface: a file, or a name of `list surfaces`."),
    ],
    *,
    iterations: Annotated[
        int, typer.Option(min=20, max=1_000_000, help="Of the bare iterations (23) and (30).")
    ] = 200,
    faces: Faces = None,
    run: Annotated[
        Path, typer.Option("--run", "-o", "--output", help="The run that gets the exhibits.")
    ] = DEFAULT_RUN,
    as_json: Json = False,
) -> None:
    """What of the paper's Section 4 holds on a surface, and to which digit?

    Premises (Definition 1, signs of the weights), Theorem 2, Corollary 1, Remark 2, Theorem 3 and
    Remark 3; spectrum of K, speed of the iteration. A statement that fails although all premises
    hold makes the exit code 1. docs/theory.md explains the figures.
    """
    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.registry import load_registry
    from cembench.results import run_folder
    from cembench.running.plan import surface_named

    run_folder.check(run)
    registry = load_registry()
    surfaces = [surface_named(registry, name, DiskMesh, faces) for name in meshes]
    found: list[tuple[dict[str, Any], Exhibit]] = []
    from cembench.workflows.theory_facts import RIVAL

    rival = registry.algorithms.get(RIVAL)
    size = "" if faces is None else f" --faces {faces}"
    for name, mesh in zip(meshes, surfaces, strict=True):
        command = f"cembench theory {Path(name).name} --iterations {iterations}{size}"
        with err.status(f"Section 4 on {mesh.name}", spinner="line"):
            found.append(_examine(mesh, rival, iterations, run, command))
    if as_json:
        print_json([facts for facts, _ in found])
    else:
        for facts, exhibit in found:
            _show(facts, exhibit, run)
    if any(facts["premises_hold"] and not facts["statements_hold"] for facts, _ in found):
        raise typer.Exit(1)


def _examine(
    mesh: DiskMesh, rival: Algorithm | None, iterations: int, run: Path, command: str
) -> tuple[dict[str, Any], Exhibit]:
    from cembench.results.exhibits import Exhibit, ExhibitPicture, exhibit_folder, write_exhibit
    from cembench.workflows.theory_facts import theory_facts
    from cembench.workflows.theory_plot import write_theory_plot

    name = f"theory-{mesh.name}"
    folder = exhibit_folder(run, name)  # complains now of what it could not write in the end
    found = theory_facts(mesh, rival, iterations)
    facts = dict(found.facts)
    write_theory_plot(
        folder / "theory.png",
        f"{mesh.name}: {mesh.n:,} vertices, {facts['boundary_vertices']} on the boundary",
        found.spectrum,
        found.trajectories,
        found.others,
        facts["rate_predicted"],
    )
    exhibit = Exhibit(
        name=name,
        title=f"Section 4 on {mesh.name}",
        text=_summary(facts) + (f" {found.missing}" if found.missing else ""),
        command=command,
        origin="surface",
        pictures=(
            ExhibitPicture(
                file="theory.png",
                caption="Spectrum of K, conformal energy and steps of the bare iterations.",
                alternative=_summary(facts),
            ),
        ),
        tables=_tables(found.premises, found.statements, facts["energies"]),
        facts=facts,
    )
    write_exhibit(run, exhibit)
    return facts, exhibit


def _summary(facts: dict[str, Any]) -> str:
    broken = [check["name"] for check in facts["premises"] if not check["holds"]]
    fails = [check["name"] for check in facts["statements"] if not check["holds"]]
    count = len(facts["statements"])
    words = "All premises hold." if not broken else f"Premises that fail: {'; '.join(broken)}."
    words += (
        f" All {count} statements hold."
        if not fails
        else f" Of {count} statements these fail: {'; '.join(fails)}; the others hold."
    )
    speed = (
        f" The gap of K is {facts['gap']:.4g}; a step of (23) shrinks to {facts['rate_23']:.4f} of "
        f"the one before (predicted {facts['rate_predicted']:.4f}), of (30) to "
        f"{facts['rate_30']:.4f}."
    )
    return words + speed


def _tables(given: Sequence[Check], said: Sequence[Check], energies: list[dict[str, Any]]) -> Any:
    from cembench.results.exhibits import ExhibitTable
    from cembench.workflows.theory_facts import LOOKS

    def of(title: str, checks: Sequence[Check]) -> ExhibitTable:
        rows = tuple(
            (c.name, c.source, "yes" if c.holds else "NO", c.figure, c.meaning) for c in checks
        )
        return ExhibitTable(
            title=title, columns=("what", "where", "holds", "figure", "meaning"), rows=rows
        )

    columns = ("iteration", *(f"after {k}" for k in LOOKS), "last", "iterations")
    keys = ("name", *(f"after_{k}" for k in LOOKS), "last", "iterations")
    rows = tuple(tuple(row[key] for key in keys) for row in energies)
    return (
        of("Premises", given),
        of("Statements", said),
        ExhibitTable(title="Conformal energy E_C", columns=columns, rows=rows),
    )


def _show(facts: dict[str, Any], exhibit: Exhibit, run: Path) -> None:
    from rich.table import Table as Grid
    from rich.text import Text

    from cembench.results.exhibits import place_of
    from cembench.workflows.theory_facts import LOOKS

    vertices = f"{facts['vertices']:,} vertices, {facts['boundary_vertices']} on the boundary"
    out.print(f"{facts['mesh']}: {vertices}", style="bold", markup=False)
    for part in ("premises", "statements"):
        grid = Grid(box=None, pad_edge=False, header_style="bold")
        grid.add_column(part, ratio=1)
        grid.add_column("")
        grid.add_column("figure", justify="right", no_wrap=True)
        for check in facts[part]:
            mark = Text("ok", style="green") if check["holds"] else Text("NO", style="bold red")
            figure = check["figure"]
            grid.add_row(
                Text.assemble(check["name"], "  ", (check["source"], "dim")),
                mark,
                str(figure) if isinstance(figure, int) else f"{figure:.3g}",
            )
        out.print(grid)
    grid = Grid(box=None, pad_edge=False, header_style="bold")
    grid.add_column("E_C")
    for heading in (*(f"after {k}" for k in LOOKS), "last"):
        grid.add_column(heading, justify="right")
    for row in facts["energies"]:
        cells = [row[f"after_{k}"] for k in LOOKS] + [row["last"]]
        grid.add_row(row["name"], *("-" if c is None else f"{c:.6f}" for c in cells))
    out.print(grid)
    out.print(exhibit.text, markup=False)
    out.print(f"picture  {place_of(run, exhibit.name, 'theory.png')}", soft_wrap=True, markup=False)


#: Each verb with the examples that its help shows.
VERBS = (
    (
        theory,
        "Examples:  cembench theory face.obj  ·  "
        "cembench theory spherical-cap --faces 5000 --run results/mine --json",
    ),
)
