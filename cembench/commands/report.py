"""The command `report`, and the parts it shares with `reproduce`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cembench.commands.console import Json, err, out, print_json
from cembench.commands.options import Verify
from cembench.commands.run import DEFAULT_RUN, Run

if TYPE_CHECKING:
    from cembench.report.document import Report

Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", help="The report's folder (default: RUN/report)."),
]


Tables = Annotated[
    list[Path],
    typer.Option("--tables", help="A TOML file that declares more tables and plots. Repeatable."),
]
PaperName = Annotated[
    str | None,
    typer.Option(
        "--paper",
        metavar="NAME|FOLDER",
        help="The paper whose tables and claims it has: an installed one, or its folder.",
    ),
]
#: What ``--json`` has of the paper.
CITATION = {"title", "authors", "place", "doi"}
#: Processes that draw, at most: each holds a surface with its maps.
MOST_DRAWING = 2


def report(
    run: Run = DEFAULT_RUN,
    *,
    output: Output = None,
    tables: Tables = [],  # noqa: B006 - typer copies defaults
    paper: PaperName = None,
    verify: Verify = False,
    as_json: Json = False,
) -> None:
    """Write a report of a run: the paper's tables, figures and claims, as measured.

    The folder holds index.html (one file that works offline), report.md,
    report.tex, and each table, figure and its data as separate files. The four
    tables are printed here too. --tables adds tables and plots of your own; docs/tables.md
    says how they are declared.
    """
    written, folder = make_report(run, output, tables=tables, paper=paper, verify=verify)
    if as_json:
        print_json(summary(written, folder))
    else:
        show_report(written, folder)


def make_report(
    run: Path,
    output: Path | None,
    command: str = "",
    *,
    tables: Sequence[Path] = (),
    paper: str | None = None,
    verify: bool = False,
) -> tuple[Report, Path]:
    """Write a report with progress on standard error; return the report and its folder."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    from cembench.report.write_report import write_report
    from cembench.results.papers import find_paper
    from cembench.results.store import Store
    from cembench.results.verify import Depth, sound_records
    from cembench.running.environment import usable_cores

    asked = find_paper(paper) if paper else None
    records = sound_records(Store(run), Depth.everything if verify else Depth.sample)
    folder = output or run / "report"
    told = f"cembench report {run}" + (f" -o {output}" if output else "")
    told += "".join(f" --tables {file}" for file in tables)
    told += f" --paper {paper}" if paper else ""
    bar = Progress(
        BarColumn(20), MofNCompleteColumn(), TextColumn("{task.description}", markup=False),
        console=err, transient=True,
    )  # fmt: skip
    with bar:
        task = bar.add_task("reading")

        def progress(words: str, done: int, total: int) -> None:
            bar.update(task, description=words, completed=done, total=total)
            if not err.is_terminal and done < total:
                err.print(f"[{done + 1}/{total}] {words}", markup=False, soft_wrap=True)

        made = write_report(
            run, folder, command or told, progress, jobs=min(usable_cores(), MOST_DRAWING),
            tables=tables, paper=asked, records=records,
        )  # fmt: skip
        return made, folder


def show_report(report: Report, folder: Path) -> None:
    """Print the paper's tables, the verdicts on its claims, and the report's path."""
    from cembench.report.render.terminal_report import paper_tables

    out.print(paper_tables(report))
    verdicts = summary(report, folder)["verdicts"]
    if verdicts:
        out.print("Claims: " + ", ".join(f"{n} {verdict}" for verdict, n in verdicts.items()))
    out.print(f"Report: {(folder / 'index.html').resolve()}", soft_wrap=True, markup=False)


def summary(report: Report, folder: Path) -> dict[str, Any]:
    """Return a report's contents for JSON output."""
    from cembench.report.document import (
        VERDICTS,
        Claim,
        Gap,
        figures_of,
        plain,
        sections_of,
        tables_of,
    )

    items = [item for _, section in sections_of(report) for item in section.items]
    claims = {item.name: item.verdict for item in items if isinstance(item, Claim)}
    counts = Counter(claims.values())
    found = report.findings
    return {
        "title": report.title,
        "paper": report.paper and report.paper.model_dump(include=CITATION),
        "findings": [plain(sentence) for sentence in found.sentences] if found else [],
        "suspects": list(found.suspects) if found else [],
        "report": str(folder),
        "html": str(folder / "index.html"),
        "markdown": str(folder / "report.md"),
        "latex": str(folder / "report.tex"),
        "tables": [table.name for table in tables_of(report)],
        "figures": [figure.name for figure in figures_of(report)],
        "gaps": {item.title: item.why for item in items if isinstance(item, Gap)},
        "claims": claims,
        "verdicts": {verdict: counts[verdict] for verdict in VERDICTS if counts[verdict]},
    }


#: Each command with the examples in its help.
VERBS = (
    (
        report,
        "Examples:  cembench report results/run  ·  cembench report results/run -o out --json  ·  "
        "cembench report results/run --tables mine.toml",
    ),
)
