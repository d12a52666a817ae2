"""The verb that puts Section 4 of the paper to the test on a surface."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cembench.commands.console import Json, err, out, print_json
from cembench.commands.options import Faces
from cembench.commands.run import DEFAULT_RUN

if TYPE_CHECKING:
    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.results.exhibits import Exhibit
    from cembench.workflows.theory import Check

#: The algorithm whose course is shown beside CEM's, where it is installed.
RIVAL = "direct-cem"
#: After how many iterations the table of energies looks.
LOOKS = (0, 20, 200)
#: K is formed, for the statements on its entries, up to so many boundary vertices.
DENSE = 1200


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
    mesh: DiskMesh, rival: Any, iterations: int, run: Path, command: str
) -> tuple[dict[str, Any], Exhibit]:
    from cembench.results.exhibits import Exhibit, ExhibitPicture, exhibit_folder, write_exhibit
    from cembench.workflows.theory import (
        BoundaryOperator,
        predicted_rate,
        premises,
        statements,
        trajectory,
    )
    from cembench.workflows.theory_plot import write_theory_plot

    name = f"theory-{mesh.name}"
    folder = exhibit_folder(run, name)  # complains now of what it could not write in the end
    K = BoundaryOperator(mesh)
    dense = K.size <= DENSE
    paths = {
        "CEM, step (23)": trajectory(K, iterations, inversion=False),
        "CEM, step (30)": trajectory(K, iterations, inversion=True),
    }
    plain, inverse = paths.values()
    given, said = premises(K), statements(K, plain, inverse, dense=dense)
    leading, _ = K.leading_eigenpairs()
    others, missing = _rival_history(rival, mesh)
    rate = predicted_rate(leading)
    facts: dict[str, Any] = {
        "mesh": mesh.name,
        "vertices": mesh.n,
        "boundary_vertices": K.size,
        "premises_hold": all(check.holds for check in given),
        # The first claims nothing: see the check's source.
        "statements_hold": all(c.holds for c in said if c.source != "not claimed"),
        "premises": [_as_dict(check) for check in given],
        "statements": [_as_dict(check) for check in said],
        "eigenvalues": leading.tolist(),
        "gap": float(1 - leading[1]),
        "rate_predicted": rate,
        "rate_23": plain.rate,
        "rate_30": inverse.rate,
        "rises_23": _rises(plain),
        "rises_30": _rises(inverse),
        "energies": _energies(paths, others),
    }
    write_theory_plot(
        folder / "theory.png",
        f"{mesh.name}: {mesh.n:,} vertices, {K.size} on the boundary",
        (K.spectrum() if dense else leading).tolist(),
        paths,
        others,
        rate,
    )
    exhibit = Exhibit(
        name=name,
        title=f"Section 4 on {mesh.name}",
        text=_summary(facts) + (f" {missing}" if missing else ""),
        command=command,
        origin="surface",
        pictures=(
            ExhibitPicture(
                file="theory.png",
                caption="Spectrum of K, conformal energy and steps of the bare iterations.",
                alternative=_summary(facts),
            ),
        ),
        tables=_tables(given, said, facts["energies"]),
        facts=facts,
    )
    write_exhibit(run, exhibit)
    return facts, exhibit


def _as_dict(check: Check) -> dict[str, Any]:
    from dataclasses import asdict

    return asdict(check)


def _rises(path: Any) -> dict[str, float | int]:
    """How often E_C rises by more than rounding, and by how much together and at most."""
    from cembench.workflows.theory import TOLERANCE

    rises = path.rises[path.rises > TOLERANCE * abs(path.energies[0])]
    return {
        "count": len(rises),
        "largest": float(rises.max(initial=0.0)),
        "together": float(rises.sum()),
    }


def _rival_history(rival: Any, mesh: DiskMesh) -> tuple[dict[str, tuple[float, ...]], str]:
    """The energies of the algorithm beside CEM; or why there are none."""
    from cembench.core.errors import AlgorithmFailed

    if rival is None or not isinstance(mesh, rival.mesh_type):
        return {}, f"{RIVAL} is not installed here." if rival is None else ""
    try:
        result = rival.function(mesh.fresh(), **rival.arguments({}))
    except AlgorithmFailed as error:
        return {}, f"{rival.title} failed: {error}."
    if not result.energy_history:
        return {}, f"{rival.title} tells no energies."
    return {rival.title: result.energy_history}, ""


def _energies(paths: Any, others: Any) -> list[dict[str, Any]]:
    """E_C at the start, after 20 and after 200 iterations, and the lowest; None where none is."""
    curves = {name: path.energies.tolist() for name, path in paths.items()}
    curves |= {name: list(history) for name, history in others.items()}
    rows = []
    for name, curve in curves.items():
        at = {f"after_{k}": curve[k] if k < len(curve) else None for k in LOOKS}
        rows.append({"name": name} | at | {"last": curve[-1], "iterations": len(curve) - 1})
    return rows


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


def _tables(given: list[Check], said: list[Check], energies: list[dict[str, Any]]) -> Any:
    from cembench.results.exhibits import ExhibitTable

    def of(title: str, checks: list[Check]) -> ExhibitTable:
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
