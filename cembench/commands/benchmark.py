"""The command `run`: measure algorithms on surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

import typer
from rich.text import Text

from cembench.api.benchmark import benchmark
from cembench.commands.app import app
from cembench.commands.cluster import hours, show_hours
from cembench.commands.console import SHOWN, Json, out, print_json, split
from cembench.commands.external import Command, Settings, declared_command
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import DEFAULT_RUN, Meshes, OutputRun, Surfaces

if TYPE_CHECKING:
    from cembench.api.benchmark import Run
    from cembench.api.run_plan import Plan


@app.command(
    epilog="Examples:  cembench run --profile quick --dry-run  ·  "
    "cembench run --mesh a.obj -a cem,lscm --solves reuse,backslash  ·  "
    "cembench run --surfaces spherical-cap -o results/cap --json  ·  "
    "cembench run --set real-disks -a all --limit 20  ·  "
    "cembench run --mesh-dir meshes -a lscm,cem --maps theirs=their_uvs"
)
@from_api(
    benchmark,
    without=("watcher", "reporter"),
    often=(
        *("mesh", "surfaces", "algorithms", "faces", "rounds", "plugins", "parameters", "profile"),
        *("output", "dry_run"),
    ),
    sets="--set",
    limit="--limit N",
    precision="--precision SHARE",
    budget="--budget TIME",
    maps="--maps NAME=FOLDER",
    solves="--solves NAME",
    cluster="--cluster PLACE",
    part="--part K/N",
)
def run(
    call: Call,
    *,
    mesh: Meshes = [],  # noqa: B006
    dataset: Annotated[
        list[str], typer.Option("--dataset", help="Public surfaces (see `fetch`), comma-separated.")
    ] = [],  # noqa: B006
    surfaces: Surfaces = [],  # noqa: B006
    command: Command = None,
    program: Settings = [],  # noqa: B006
    output: OutputRun = DEFAULT_RUN,
    as_json: Json = False,
) -> None:
    """Print the figures of the cells that were asked for; exit with 1 if one did not end ok."""
    keywords = call.keywords
    declared, named = declared_command(command, program)
    measured = call(
        surfaces=[*mesh, *split(dataset), *split(surfaces)],
        algorithms=[*(keywords["algorithms"] or ["usual"]), *named],
        plugins=[*keywords["plugins"], *declared],
        output=output,
        reporter=SHOWN,
    )
    if keywords["dry_run"]:
        _print_plan(measured.plan, as_json=as_json)
    else:
        _print_run(measured, keywords["reference"], as_json=as_json)


def _print_run(run: Run, reference: str | None, *, as_json: bool) -> None:
    from cembench.report.content.evidence import Evidence
    from cembench.report.content.many_surfaces import MANY
    from cembench.report.run_tables import contest_tables, machine_lines, many_table, results_table
    from cembench.results.columns import rows
    from cembench.results.records import REFERENCE
    from cembench.results.stability import outlier_lines
    from cembench.results.store import Store

    records, folder, reference = list(run.asked), run.folder, reference or REFERENCE
    suspects = [Text(f"! {line}", style="yellow") for line in outlier_lines(records)]
    evidence = Evidence(Store(folder), tuple(records), ())
    many = len({record.cell.mesh_hash for record in records}) > MANY
    if as_json:
        print_json(rows(records, reference))
    elif many:
        out.print(many_table(evidence))
        for words in (*machine_lines(evidence.machines), *suspects):
            out.print(words)
    else:
        out.print(results_table(evidence))
        for speedups in contest_tables(records, reference):
            out.print("", speedups, sep="\n")
        for words in suspects:
            out.print(words)
    if not as_json:
        out.print(f"\nRecords and maps: {folder.resolve()}", soft_wrap=True)
    if many and not as_json:
        out.print(f"Pictures and profiles: cembench report {folder}", soft_wrap=True)
    if any(record.outcome.status != "ok" for record in records):
        raise typer.Exit(1)


def _print_plan(plan: Plan, *, as_json: bool) -> None:
    """Print which cells would be measured, and their estimated cost."""
    from cembench.commands.progress import duration
    from cembench.report.run_tables import plan_table

    costs, summary = plan.costs(), plan.summary()
    on_cluster = hours(plan.tasks, costs, plan.options.budget) if plan.cluster else None
    if as_json:
        print_json(summary | ({"cluster": on_cluster} if on_cluster else {}))
        return
    lines = [
        (t.cell, t.facts.faces, c.basis if c else _not_run(about), c)
        for t, c, about in zip(plan.tasks, costs, summary["cells"], strict=True)
    ]
    out.print(plan_table(lines))
    known = [cost for cost in costs if cost is not None]
    is_rough = any(cost.basis == "rough" for cost in known)
    rough = " (rough: few similar cells were measured here before)" if is_rough else ""
    out.print(
        f"\n{len(known)} of {len(plan.tasks)} cells to measure: about "
        f"{duration(summary['seconds'])}, {summary['memory_bytes'] / 2**30:.1f} GiB at most{rough}"
    )
    if on_cluster:
        show_hours(on_cluster)


def _not_run(cell: Mapping[str, str | None]) -> str:
    """Return why a cell of a plan has no cost."""
    if cell["held"]:
        return f"recorded: {cell['held']}"
    return "cannot run here" if cell["lacks"] else "a map from a file"
