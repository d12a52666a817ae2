"""Write a run's report in all its forms, with figures and data.

::

    index.html                 the whole report in one file
    report.md pages/ records.md
    report.tex                 pdflatex report.tex
    tables/*.csv tables/*.tex
    figures/                   plots as PNG, SVG, PDF and their data as CSV; pictures as JPEG
    records.csv                every record as a row
    contents.json              the report's own files with their hashes
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from cembench.core import folders
from cembench.core.atomic import draft_folder, unwritable
from cembench.report.content.evidence import Evidence
from cembench.report.content.report import Progress, build_report, is_of_the_paper
from cembench.report.declared_plots import further
from cembench.report.document import Report
from cembench.report.export import export_rows, write_tables_csv
from cembench.report.plots import drawn
from cembench.report.render.html import write_html
from cembench.report.render.latex import write_latex
from cembench.report.render.markdown import write_markdown
from cembench.report.shared_drawing import shared_drawing
from cembench.results.papers import Paper
from cembench.results.records import Record

#: The file of a paper that declares tables and plots of what was measured, for its reports.
MEASURED = "measured.toml"


def write_report(
    run: Path,
    folder: Path,
    command: str,
    progress: Progress = lambda *_: None,
    *,
    jobs: int = 1,
    tables: Sequence[Path] = (),
    paper: Paper | None = None,
    records: Sequence[Record] = (),
) -> Report:
    """Write the report of a run in all its forms; `jobs` processes draw its pictures and plots.

    `tables` are files with declarations of more tables and plots (:mod:`cembench.report.declared`,
    :mod:`cembench.report.declared_plots`), after those of the paper's folder. `paper` is the one it
    is of; default: the one with most rows of the run. `records` are those of the run, if they were
    read before.

    Everything is made in a separate folder and moved when it is complete. Files of an earlier
    report that this one does not have are removed, unless they were changed; other files are left
    alone.

    Raises
    ------
    ParameterError
        A declaration is wrong, or does not fit the run.
    RecordError
        The folder `run` holds no run, no record, or no model of the paper; `folder` holds files
        that are not a report's or were changed since, or cannot be written.
    """
    evidence = Evidence.of(run, paper, records)
    own = evidence.paper.folder / MEASURED
    of_paper = [own] if is_of_the_paper(evidence) and own.is_file() else []
    declared = further(evidence, [*of_paper, *tables])
    folders.check(folder, "report")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with draft_folder(folder) as draft:
            # Processes pay where there are maps to draw.
            with shared_drawing(jobs if (run / "meshes").is_dir() else 1):
                report = build_report(evidence, draft, command, progress)
                more = [
                    replace(section, items=tuple(drawn(items, draft)))
                    for section, items in declared
                ]
                report = replace(report, sections=(*report.sections, *more))
            _write_all(report, evidence, draft)
            folders.publish(draft, folder, "report")
    except OSError as error:
        raise unwritable(folder, error) from error
    return replace(report, page=folder / "index.html")


def _write_all(report: Report, evidence: Evidence, folder: Path) -> None:
    export_rows(list(evidence.rows.values()), folder / "records.csv", "csv")
    write_tables_csv(report, folder)
    write_markdown(report, folder)
    write_latex(report, folder)
    write_html(report, folder)
