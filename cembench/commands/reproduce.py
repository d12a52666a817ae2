"""The command `reproduce`: the paper's tables, figures and claims on its smallest models."""

from __future__ import annotations

import typer

from cembench.api.reproduce import reproduce as measure
from cembench.commands import report as report_verbs
from cembench.commands.console import SHOWN, Json, complain, print_json
from cembench.commands.exit_codes import resumable
from cembench.commands.from_api import Call, from_api
from cembench.core.extras import Extra, require


@from_api(measure, without=("reporter",), out="-o --output", budget="--budget TIME")
def reproduce(call: Call, *, as_json: Json = False) -> None:
    """Write the report to the same folder; exit with 1 if a cell did not end ok."""
    from cembench.core import folders
    from cembench.results.record_rows import rows

    output = call.keywords["out"]
    require(Extra.REPORT, "a report")
    folders.check(output / "report", "report")
    with resumable():
        records = call(reporter=SHOWN).asked
    report, folder = report_verbs.make_report(output, None, f"cembench reproduce -o {output}")
    bad = [record for record in records if record.outcome.status != "ok"]
    if as_json:
        origins = {record.mesh.paper_row: record.mesh.origin for record in records}
        about = report_verbs.summary(report, folder)
        print_json({"surfaces": origins, "cells": rows(records), "report": about})
    else:
        report_verbs.show_report(report, folder)
        for record in bad:
            name = f"{record.cell.mesh} / {record.cell.algorithm}"
            complain(f"{name}: {record.outcome.status}: {record.outcome.cause}")
    if bad:
        raise typer.Exit(1)


#: Each command with the examples in its help.
VERBS = (
    (
        reproduce,
        "Examples:  cembench reproduce  ·  cembench reproduce --budget 20m -o results/longer  ·  "
        "cembench reproduce --offline",
    ),
)
