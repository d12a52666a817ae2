"""The command `show`: everything that is recorded about a cell."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cembench.api import benchmark
from cembench.commands.app import app
from cembench.commands.console import Json, fail, out, print_json, print_pair
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import DEFAULT_RUN
from cembench.core.errors import ParameterError

if TYPE_CHECKING:
    from cembench.results.records import Record


@app.command(epilog="Examples:  cembench show face/cem  ·  cembench show 3fa9 --run results/mine")
@from_api(benchmark.Run.show, without=("self",), cell="CELL")
def show(
    call: Call,
    *,
    run: Annotated[Path, typer.Option("--run", help="The run's folder.")] = DEFAULT_RUN,
    as_json: Json = False,
) -> None:
    """Print the records; exit with 1 if a map does not agree with one."""
    from cembench.results.columns import row
    from cembench.results.store import Store
    from cembench.results.verify import verify_map

    cell, store = call.keywords["cell"], Store(run)
    if cell and Path(cell).is_dir():
        raise ParameterError(
            f"{cell} is a folder, and show takes a cell: cembench show CELL --run {cell}. "
            f"cembench status {cell} lists its cells."
        )
    records = call(benchmark.Run(run))
    if as_json:
        print_json([row(record) for record in records])
    else:
        _show_records(records)
    findings = (f for r in records for f in verify_map(store, store.record_file(r.cell), r))
    fail(str(finding) for finding in findings if finding.disagrees)


def _show_records(records: Sequence[Record]) -> None:
    from cembench.report.record_table import figures_table
    from cembench.results.columns import significant

    for record in records:
        outcome = record.outcome
        print_pair(outcome.status, f"{record.cell.solves}  {record.cell.key[:12]}")
        out.print(figures_table(record))
        for number, r in enumerate(outcome.rounds, start=1):
            calls = " ".join(significant(seconds, 4) for seconds in r.calls)
            out.print(f"round {number:<3} {r.started_at}  {calls}")
        for words in filter(None, (outcome.cause, outcome.traceback)):
            out.print(words, soft_wrap=True)
