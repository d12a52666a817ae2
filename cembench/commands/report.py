"""The command `report`, and the parts it shares with `reproduce`."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from cembench.api import benchmark
from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, out, print_json
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import DEFAULT_RUN, Run

if TYPE_CHECKING:
    from cembench.report.document import Report

#: What ``--json`` has of the paper.
CITATION = {"title", "authors", "place", "doi"}
#: Processes that draw, at most: each holds a surface with its maps.
MAX_DRAWING = 2


@app.command(
    epilog="Examples:  cembench report results/run  ·  "
    "cembench report results/run -o out --json  ·  cembench report results/run --tables mine.toml"
)
@from_api(
    benchmark.Run.report,
    without=("self", "command", "jobs", "reporter"),
    folder="-o --output",
    paper="--paper NAME|FOLDER",
)
def report(call: Call, run: Run = DEFAULT_RUN, *, as_json: Json = False) -> None:
    """Print the four tables and the verdicts."""
    _ask_for_trust(call)
    written = call(benchmark.Run(run), jobs=drawing_jobs(), reporter=SHOWN)
    folder = call.keywords["folder"] or run / "report"
    if as_json:
        print_json(summary(written, folder))
    else:
        show_report(written, folder)


def _ask_for_trust(call: Call) -> None:
    """Ask at a terminal whether the code in the folder of a paper may run."""
    from cembench.results.papers import code_of

    paper = call.keywords["paper"]
    code = code_of(paper) if paper and not call.keywords["trust"] and sys.stdin.isatty() else None
    if code is not None:
        call.keywords["trust"] = typer.confirm(f"{code} will run with your rights. Run it?")


def drawing_jobs() -> int:
    """Return the number of processes that draw a report."""
    from cembench.running.environment import usable_cores

    return min(usable_cores(), MAX_DRAWING)


def show_report(report: Report, folder: Path) -> None:
    """Print the paper's tables, the verdicts on its claims, and the report's path."""
    from cembench.report.render.terminal import paper_tables

    out.print(paper_tables(report))
    verdicts = summary(report, folder)["verdicts"]
    if verdicts:
        out.print("Claims: " + ", ".join(f"{verdict} {n}" for verdict, n in verdicts.items()))
    out.print(f"Report: {(folder / 'index.html').resolve()}", soft_wrap=True, markup=False)


def summary(report: Report, folder: Path) -> dict[str, Any]:
    """Return a report's contents for JSON output."""
    from cembench.report.document import VERDICTS, Claim, Figure, Gap, Table, items_of, plain

    claims = {claim.name: claim.verdict for claim in items_of(report, Claim)}
    counts = Counter(claims.values())
    findings = report.findings
    return {
        "title": report.title,
        "paper": report.paper and report.paper.model_dump(include=CITATION),
        "findings": [plain(sentence) for sentence in findings.sentences] if findings else [],
        "suspects": list(findings.suspects) if findings else [],
        "report": str(folder),
        "html": str(folder / "index.html"),
        "markdown": str(folder / "report.md"),
        "latex": str(folder / "report.tex"),
        "tables": [table.name for table in items_of(report, Table)],
        "figures": [figure.name for figure in items_of(report, Figure)],
        "gaps": {gap.title: gap.why for gap in items_of(report, Gap)},
        "claims": claims,
        "verdicts": {verdict: counts[verdict] for verdict in VERDICTS if counts[verdict]},
    }
