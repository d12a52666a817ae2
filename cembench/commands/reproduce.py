"""The command `reproduce`: the paper's tables, figures and claims on its smallest models."""

from __future__ import annotations

from cembench.api.reproduce import reproduce as reproduce_paper
from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, fail, failures, print_json
from cembench.commands.exit_codes import resumable
from cembench.commands.from_api import Call, from_api
from cembench.commands.report import show_report, summary


@app.command(
    epilog="Examples:  cembench reproduce  ·  "
    "cembench reproduce --budget 20m -o results/longer  ·  cembench reproduce --offline"
)
@from_api(reproduce_paper, without=("jobs", "reporter"), budget="--budget TIME")
def reproduce(call: Call, *, as_json: Json = False) -> None:
    """Print the tables and verdicts; exit with 1 if a cell did not end ok."""
    from cembench.results.columns import rows
    from cembench.running.environment import usable_cores

    with resumable():
        reproduction = call(jobs=usable_cores(), reporter=SHOWN)
    folder, records = reproduction.run.folder / "report", reproduction.run.asked
    if as_json:
        about = summary(reproduction.report, folder)
        print_json(
            {"surfaces": dict(reproduction.surfaces), "cells": rows(records), "report": about}
        )
    else:
        show_report(reproduction.report, folder)
    fail(failures(records))
