"""The command `reproduce`: the paper's tables, figures and claims on its smallest models."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cembench.api.settings import budget_seconds, bytes_of
from cembench.commands import fetch as fetch_verbs
from cembench.commands import report as report_verbs
from cembench.commands.console import SHOWN, Json, complain, err, print_json
from cembench.commands.exit_codes import resumable
from cembench.commands.options import Fresh
from cembench.core.extras import Extra, require
from cembench.results.profiles import Profile

if TYPE_CHECKING:
    from cembench.mesh.triangle_mesh import TriangleMesh
    from cembench.registry import Algorithm, Registry
    from cembench.running.plan import PaperRole


def reproduce(
    *,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the results.")] = Path(
        "results/reproduce"
    ),
    budget: Annotated[
        str,
        typer.Option(
            metavar="TIME",
            help="Time for measuring, e.g. 10m: small surfaces are measured until their times are "
            "precise, and what does not fit has one round.",
        ),
    ] = "180s",
    offline: Annotated[
        bool, typer.Option("--offline", help="Fetch nothing; use models fetched before.")
    ] = False,
    fresh: Fresh = False,
    as_json: Json = False,
) -> None:
    """Measure the paper's algorithms on its smallest models, and write a report.

    Models that are public are fetched (20 seconds at most), and the others have
    stand-ins. It takes about five minutes. What the folder already holds is not
    measured again. The report is written to the same folder.
    """
    from cembench.core import folders
    from cembench.registry import load_registry
    from cembench.results import run_folder
    from cembench.results.profiles import algorithms_of
    from cembench.results.record_rows import rows
    from cembench.results.sequential_checks import USUAL_PRECISION
    from cembench.results.store import Store
    from cembench.running.environment import usable_cores
    from cembench.running.local import run_tasks
    from cembench.running.options import Options
    from cembench.running.plan import MeasurementSettings, plan_cells

    require(Extra.REPORT, "a report")
    run_folder.check(output)
    folders.check(output / "report", "report")
    options = Options(
        memory_bytes=bytes_of(None),
        fresh=fresh,
        budget=budget_seconds(budget),
        whole_surfaces=True,
        jobs=usable_cores(),
    )
    registry = load_registry()
    chosen = [registry.algorithm(name) for name in algorithms_of(Profile.quick, registry)]
    with resumable():
        surfaces, roles = _surfaces(registry, chosen, offline=offline)
    settings = MeasurementSettings.until_precise(USUAL_PRECISION)
    tasks = plan_cells(chosen, surfaces, {}, settings, standing=roles)
    with SHOWN.watching(len(tasks)) as progress:
        records = run_tasks(tasks, Store(output), options, progress)
    command = f"cembench reproduce -o {output}"
    report, folder = report_verbs.make_report(output, None, command)
    if as_json:
        origins = {role.paper_row: role.origin for role in roles.values()}
        about = report_verbs.summary(report, folder)
        print_json({"surfaces": origins, "cells": rows(records), "report": about})
    else:
        report_verbs.show_report(report, folder)
        for record in records:
            if record.outcome.status != "ok":
                name = f"{record.cell.mesh} / {record.cell.algorithm}"
                complain(f"{name}: {record.outcome.status}: {record.outcome.cause}")
    if any(record.outcome.status != "ok" for record in records):
        raise typer.Exit(1)


def _surfaces(
    registry: Registry, algorithms: Sequence[Algorithm], *, offline: bool
) -> tuple[list[TriangleMesh], dict[str, PaperRole]]:
    """Return a surface for each row: the model if it is there, else its stand-in; and the roles."""
    from cembench.api.plan_benchmark import read_surfaces
    from cembench.api.reproduce import fetch_models, public_models
    from cembench.mesh.datasets import is_fetched, surface_file
    from cembench.results.profiles import surfaces_of
    from cembench.running.plan import paper_roles

    stand_ins = {registry.surface(s).paper_row: s for s in surfaces_of(Profile.quick, registry)}
    public = public_models(registry, list(stand_ins))
    if public and not offline:
        with fetch_verbs.bars(public) as progress:
            what = fetch_models(public, progress)
        err.print(what, soft_wrap=True)
    models = {one.paper_row: one for one in public if is_fetched(one)}
    names = [name for row, name in stand_ins.items() if row not in models]
    for kind, rows in (
        ("the paper's models", models),
        ("stand-ins", [row for row in stand_ins if row not in models]),
    ):
        err.print(f"{kind}: {', '.join(rows) or 'none'}", soft_wrap=True)
    made = _made(registry, names)
    files = map(surface_file, models.values())
    read, roles = read_surfaces(files, (), registry, algorithms, SHOWN, faces=None, repair=False)
    return [*read, *made], roles | paper_roles(registry, names)


def _made(registry: Registry, names: Sequence[str]) -> list[TriangleMesh]:
    """Return the stand-ins of these names, made side by side where several are missing."""
    from cembench.api.reproduce import STAND_IN_BYTES, make_stand_ins
    from cembench.running.environment import usable_cores

    jobs = min(usable_cores(), bytes_of(None) // STAND_IN_BYTES)
    with err.status("making stand-ins", spinner="line") as status:

        def made(name: str, done: int, total: int) -> None:
            words = f"[{done}/{total}] made {name}"
            status.update(words)
            if not err.is_terminal:
                err.print(words)

        return make_stand_ins(registry, names, jobs, made)


#: Each command with the examples in its help.
VERBS = (
    (
        reproduce,
        "Examples:  cembench reproduce  ·  cembench reproduce --budget 20m -o results/longer  ·  "
        "cembench reproduce --offline",
    ),
)
