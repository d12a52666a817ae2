"""Render a report as Markdown: ``report.md``, a page per surface, and the linked records."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from cembench.core.atomic import write_text
from cembench.core.loading import is_there, read_bytes
from cembench.report.document import (
    SUSPECTS,
    Claim,
    Figure,
    Gallery,
    Gap,
    Item,
    Report,
    Section,
    Sentence,
    Table,
    Text,
    Value,
    csv_of,
    heading,
    marked,
)

#: Number of digits of a record's key in links.
KEY = 12
_SPECIAL = str.maketrans({c: f"\\{c}" for c in "\\`*_[]<>|#"})


def write_markdown(report: Report, folder: Path) -> Path:
    """Write ``report.md`` and the files it links to; return its path."""
    pages: list[Section] = []
    lines = [f"# {escape(report.title)}", "", *_head(report)]
    lines += [f"Made by `{report.command}`.", ""]
    lines += [f"- **{escape(name)}**: {escape(words)}" for name, words in report.facts]
    lines += ["", "Numbers link to their records; every record is a line of [records.csv]"]
    lines[-1] += "(records.csv)."
    for section in report.sections:
        lines += _section(section, 2, PurePosixPath(), pages)
    path = folder / "report.md"
    _write(path, lines)
    for page in pages:
        up = PurePosixPath("..")
        inner = [f"# {escape(page.title)}", "", "[The whole report](../report.md)"]
        _write(folder / _page(page), [*inner, *_body(page, 2, up, [])])
    _write(folder / "records.md", _records(report.records))
    return path


def append_section(path: Path, section: Section) -> None:
    """Append a section to a file of Markdown, such as the summary of a job; it links to no files.

    Raises
    ------
    RecordError
        The file cannot be read or written.

    """
    before = read_bytes(path).decode(errors="replace").splitlines() if is_there(path) else []
    _write(path, [*before, *_section(section, 2, None, [])])


def escape(text: str) -> str:
    """Return text escaped for Markdown."""
    return text.translate(_SPECIAL).replace("\n", " ")


def _head(report: Report) -> list[str]:
    """Return the paper that the report is about, and the findings."""
    lines, paper, found = [], report.paper, report.findings
    if paper is not None:
        about = f"{paper.authors}. *{escape(paper.title)}*. {paper.place}."
        lines += [f"{about} [doi:{paper.doi}]({paper.address})", ""]
    if found is None:
        return lines
    for k, sentence in enumerate(found.sentences):
        told = _sentence(sentence)
        lines += [f"**{told}**" if k == 0 else told, ""]
    if found.suspects:
        lines += [f"**{SUSPECTS}**", "", *(f"- {escape(line)}" for line in found.suspects), ""]
    if found.table is not None:
        title = f"## {escape(found.table.title)}"
        lines += [title, "", *table_lines(found.table, PurePosixPath()), ""]
    return [*lines, *(f"- **{escape(f.number)}** {escape(f.words)}" for f in found.figures), ""]


def _sentence(sentence: Sentence) -> str:
    return "".join(
        escape(part) if isinstance(part, str) else f"[{escape(part.title)}](#claim-{part.name})"
        for part in sentence
    )


def _page(section: Section) -> PurePosixPath:
    return PurePosixPath("pages", f"{section.name}.md")


def _section(
    section: Section, depth: int, up: PurePosixPath | None, pages: list[Section]
) -> list[str]:
    """Return a section; `up` leads to the report's folder, None if there is none to link to."""
    if section.page and up is not None:
        pages.append(section)
        return [f"- [{escape(section.title)}]({up / _page(section)})"]
    anchor = ["", f'<a id="{section.name}"></a>'] if up is not None else []
    return [
        *anchor,
        "",
        f"{'#' * depth} {escape(section.title)}",
        *_body(section, depth, up, pages),
    ]


def _body(
    section: Section, depth: int, up: PurePosixPath | None, pages: list[Section]
) -> list[str]:
    lines = []
    for item in section.items:
        lines += ["", *_item(item, depth + 1, up)]
    if section.sections:
        lines.append("")
    for below in section.sections:
        lines += _section(below, min(depth + 1, 6), up, pages)
    return lines


def _item(item: Item, depth: int, up: PurePosixPath | None) -> list[str]:
    title = "#" * min(depth, 6)
    if isinstance(item, Text):
        return [escape(item.words)]
    if isinstance(item, Table):
        return [f"{title} {escape(item.title)}", "", *table_lines(item, up)]
    if isinstance(item, Figure | Gallery) and up is None:
        return []
    if isinstance(item, Figure):
        return [f"{title} {escape(item.full_title)}", "", *_figure(item, up)]
    if isinstance(item, Gallery):
        lines = [f"{title} {escape(item.title)}", ""]
        for figure in item.figures:
            lines += [*_figure(figure, up), ""]
        return [*lines, escape(item.caption)]
    if isinstance(item, Gap):
        how = f" Made by: `{item.command}`." if item.command else ""
        return [f"> **Missing: {escape(item.title)}.** {escape(item.why)}{how}"]
    return _claim(item, title)


def _claim(claim: Claim, title: str) -> list[str]:
    return [
        f'<a id="claim-{claim.name}"></a>',
        "",
        f"{title} {claim.verdict}: {escape(claim.title)}",
        "",
        f"> {escape(claim.sentence)} ({escape(claim.place)})",
        "",
        f"- **Test**: {escape(claim.test)}",
        f"- **Found**: {escape(claim.figures)}",
        f"- **Verdict**: **{claim.verdict}**",
        *([f"- **Remark**: {escape(claim.remark)}"] if claim.remark else []),
    ]


def _figure(figure: Figure, up: PurePosixPath | None) -> list[str]:
    up = up or PurePosixPath()
    shown = f"![{escape(figure.alternative or figure.title)}]({up / figure.files[0]})"
    links = [f"[{path.suffix[1:].upper()}]({up / path})" for path in figure.files[1:]]
    if figure.data:
        links.append(f"[data]({up / figure.data})")
    tail = f" ({', '.join(links)})" if links else ""
    return [shown, "", escape(figure.caption) + tail]


def table_lines(table: Table, up: PurePosixPath | None) -> list[str]:
    """Return the table with its caption, notes and a link to its CSV; links need `up`."""
    heads = [escape(heading(column)) for column in table.columns]
    rule = ["---:" if column.numeric else ":---" for column in table.columns]
    lines = [_cells(heads), _cells(rule)]
    last = len(table.rows) - table.footer_rows
    for k, row in enumerate(table.rows):
        cells = [
            _value(value, marked(value, column), up)
            for column, value in zip(table.columns, row, strict=True)
        ]
        lines.append(_cells([f"*{c}*" if c else "" for c in cells] if k >= last else cells))
    lines += ["", escape(table.caption)] if table.caption else []
    lines += ["", *(f"- {escape(note)}" for note in table.notes)] if table.notes else []
    return lines if up is None else [*lines, "", f"[CSV]({up / csv_of(table)})"]


def _value(value: Value, text: str, up: PurePosixPath | None) -> str:
    if not value.record or up is None:
        return escape(text)
    return f"[{escape(text)}]({up / 'records.md'}#{value.record[:KEY]})"


def _cells(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _records(records: Mapping[str, Mapping[str, Any]]) -> list[str]:
    lines = ["# Records", "", "[The whole report](report.md)"]
    for key, row in records.items():
        lines += ["", f'<a id="{key[:KEY]}"></a>', ""]
        lines.append(f"## {escape(str(row['mesh']))} / {escape(str(row['algorithm']))}")
        lines.append("")
        for name, value in row.items():
            if value not in (None, [], {}, "") and name not in ("mesh", "algorithm"):
                lines.append(f"- {escape(name)}: {escape(_short(value))}")
    return lines


def _short(value: Any) -> str:
    text = f"{value:.10g}" if isinstance(value, float) else str(value)
    return text if len(text) < 400 else text[:400] + " ... (whole in records.csv)"


def _write(path: Path, lines: Iterable[str]) -> None:
    write_text(path, "\n".join(lines).strip() + "\n")
