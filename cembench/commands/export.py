"""The command `export`: all records of a run as one table."""

from __future__ import annotations

from cembench.api import benchmark
from cembench.commands.app import app
from cembench.commands.console import Json, out, print_json
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import DEFAULT_RUN, Run


@app.command(epilog="Example:  cembench export results/run --format parquet")
@from_api(benchmark.Run.export, without=("self",), form="--format")
def export(call: Call, run: Run = DEFAULT_RUN, *, as_json: Json = False) -> None:
    """Print where the table is."""
    from cembench.results.store import Store

    path = call(benchmark.Run(run))
    rows = len(Store(run).record_files())
    if as_json:
        print_json({"output": str(path), "rows": rows})
    else:
        out.print(f"{rows} rows in {path}", soft_wrap=True)
