"""Render a report as Markdown: ``report.md``, a page per surface, and the linked records."""

from __future__ import annotations

from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any

from cembench.core.atomic import write_text
from cembench.core.loading import is_there, read_bytes
from cembench.report.document import Report, Section, sections_of
from cembench.report.render.templates import environment

#: Number of digits of a record's key in links.
KEY = 12
_SPECIAL = str.maketrans({c: f"\\{c}" for c in "\\`*_[]<>|#"})
_HERE, _ABOVE = PurePosixPath(), PurePosixPath("..")


def write_markdown(report: Report, folder: Path) -> Path:
    """Write ``report.md`` and the files it links to; return its path."""
    path = folder / "report.md"
    _write(path, _forms().whole(report, _HERE))
    for page in (section for section in sections_of(report) if section.page):
        _write(folder / "pages" / f"{page.name}.md", _forms().page(page, _ABOVE))
    _write(folder / "records.md", _forms().records(report.records))
    return path


def append_section(path: Path, section: Section) -> None:
    """Append a section to a file of Markdown, such as the summary of a job; it links to no files.

    Raises
    ------
    RecordError
        The file cannot be read or written.
    """
    before = read_bytes(path).decode(errors="replace") if is_there(path) else ""
    _write(path, f"{before.rstrip()}\n{_forms().part(section, 2, None)}")


@cache
def _forms() -> Any:
    """Return the parts of the template as functions."""
    forms = environment(lambda text: text.translate(_SPECIAL).replace("\n", " "))
    forms.filters["short"] = _short
    return forms.get_template("markdown.jinja", globals={"KEY": KEY}).module


def _short(value: Any) -> str:
    text = f"{value:.10g}" if isinstance(value, float) else str(value)
    return text if len(text) < 400 else text[:400] + " ... (whole in records.csv)"


def _write(path: Path, text: str) -> None:
    write_text(path, f"{text.strip()}\n")
