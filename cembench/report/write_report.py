"""A run becomes a folder: every form of its report, with figures and data.

::

    index.html                 the whole report in one file
    report.md pages/ records.md
    report.tex                 pdflatex report.tex
    tables/*.csv tables/*.tex
    figures/                   plots as PNG, SVG, PDF and their data as CSV; pictures as JPEG
    records.csv                every record as a row
    contents.json              which of the folder's files are the report's
"""

from __future__ import annotations

import json
import shutil
import tempfile
from pathlib import Path

from cembench.core.atomic import unwritable
from cembench.core.errors import RecordError
from cembench.report.content.evidence import Evidence
from cembench.report.content.report import Progress, build_report
from cembench.report.document import Report
from cembench.report.export import Format, export_rows
from cembench.report.render.html import write_html
from cembench.report.render.latex import write_latex
from cembench.report.render.markdown import write_markdown
from cembench.report.render.tables_csv import write_tables_csv

CONTENTS = "contents.json"


def write_report(
    run: Path, folder: Path, command: str, progress: Progress = lambda *_: None
) -> Report:
    """Write the report of a run in all its forms.

    Everything is made in a folder of its own and moved when it is complete; files of an earlier
    report that this one does not have are removed, other files are left alone.

    Raises
    ------
    RecordError
        The folder `run` holds no run, or no record; `folder` cannot be written to.

    """
    evidence = Evidence.of(run)
    if folder.exists() and not folder.is_dir():
        raise RecordError(f"{folder} is a file; name a folder with -o.")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(dir=folder.parent, prefix=".report-"))
        try:
            report = _write_all(evidence, draft, command, progress)
            _move(draft, folder)
        finally:
            shutil.rmtree(draft, ignore_errors=True)
    except OSError as error:
        raise unwritable(folder, error) from error
    return report


def _write_all(evidence: Evidence, folder: Path, command: str, progress: Progress) -> Report:
    report = build_report(evidence, folder, command, progress)
    export_rows(list(evidence.rows.values()), folder / "records.csv", Format.csv)
    write_tables_csv(report, folder)
    write_markdown(report, folder)
    write_latex(report, folder)
    write_html(report, folder)
    return report


def _move(draft: Path, folder: Path) -> None:
    files = sorted(str(p.relative_to(draft)) for p in draft.rglob("*") if p.is_file())
    before = _contents(folder)
    for name in files:
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        (draft / name).replace(target)
    (folder / CONTENTS).write_text(json.dumps(files, indent=1) + "\n", encoding="utf-8")
    for name in before:
        if name not in files and (folder / name).resolve().is_relative_to(folder.resolve()):
            (folder / name).unlink(missing_ok=True)


def _contents(folder: Path) -> list[str]:
    """Which files did an earlier report write? None where that is not known."""
    try:
        names = json.loads((folder / CONTENTS).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return []
    return [name for name in names if isinstance(name, str)] if isinstance(names, list) else []
