"""Render a report as one self-contained HTML page.

Style, script, pictures, data and Plotly's script are embedded, and the content security policy
forbids every request. Without JavaScript everything is on one long page. With it, sections marked
as pages are pages, tables sort, plots and pictures zoom, and a number opens its record. Nothing
here depends on which sections a report has.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import quote

import jinja2
import plotly
from markupsafe import Markup, escape
from plotly.io.json import to_json_plotly

from cembench.core.atomic import write_text
from cembench.report.document import (
    ORIGINS,
    SUSPECTS,
    Claim,
    Column,
    Figure,
    Gallery,
    Item,
    Report,
    Section,
    Table,
    Value,
    Verdict,
    csv_of,
    figures_of,
    galleries_of,
)
from cembench.report.pictures import (
    THUMBNAIL,
    Embedded,
    data_uri,
    embed_pixels,
    embed_vector,
    pixel_cap,
    size_of,
    unreadable,
)

FILE = "index.html"
#: The sign before each verdict, so that it does not rely on colour alone.
SIGNS: Mapping[Verdict, str] = {
    "does not hold here": "✗",
    "holds in part": "◐",
    "holds": "✓",
    "too few rounds": "…",
    "not tested here": "○",
}
#: Maximum bytes of embedded data of a figure; larger data is only linked.
DATA_BYTES = 200_000
_PIXELS = (".png", ".jpg", ".jpeg", ".webp")
_TEMPLATES = Path(__file__).parents[1] / "templates"


def write_html(report: Report, folder: Path) -> Path:
    """Write `index.html`, the whole report in one file, and return its path.

    Pictures and data are read from the files that the figures name, relative to `folder`. The same
    report gives the same bytes.

    Raises
    ------
    RenderError
        A figure names a file that does not exist or is not a picture.
    RecordError
        The page cannot be written.

    """
    write_text(folder / FILE, render(report, folder))
    return folder / FILE


def render(report: Report, folder: Path) -> str:
    """Return the page as text."""
    anchors = _Anchors()
    sections = [_section(section, anchors, None) for section in report.sections]
    everything = [s for top in sections for s in _all_sections(top)]
    figures = list(figures_of(report))
    pictures = _embed_all(figures, folder)
    script, style = template_text("report.js"), template_text("report.css")
    if any(gallery.scene for gallery in galleries_of(report)):
        script, style = script + template_text("view.js"), style + template_text("view.css")
    library = _plotly_source() if any(f.plot is not None for f in figures) else b""
    return (
        environment()
        .get_template("report.html")
        .render(
            report=report,
            sections=sections,
            pages=_in_order([s for s in everything if s["section"].page]),
            records={key: _record(key, row) for key, row in report.records.items()},
            anchor=anchors.of,
            table=lambda table: _table(table, report.records, anchors.of(table)),
            picture=lambda figure: pictures[id(figure)],
            thumbnail=lambda section: _thumbnail(section, folder),
            plot=_plot,
            data=lambda figure: _data(folder, figure.data) if figure.data else "",
            table_data=lambda table: (
                _data(folder, p) if (folder / (p := csv_of(table))).exists() else ""
            ),
            style=Markup(style),
            scene=lambda gallery: base64.b64encode(gallery.scene).decode(),
            script=Markup(script),
            library=Markup(_squeezed(library)),
            policy=policy([script.encode(), library]),
        )
    )


# --- sections and anchors --------------------------------------------------------------------


class _Anchors:
    """Unique names in the page for everything that can be linked to."""

    def __init__(self) -> None:
        self._names: dict[int, str] = {}
        self._taken: Counter[str] = Counter({"records": 1})

    def of(self, thing: Section | Table | Figure | Gallery | Claim) -> str:
        if id(thing) not in self._names:
            name = re.sub(r"[^\w.-]+", "-", thing.name).strip("-") or "part"
            self._taken[name] += 1
            again = self._taken[name]
            self._names[id(thing)] = name if again == 1 else f"{name}--{again}"
        return self._names[id(thing)]


def _section(section: Section, anchors: _Anchors, above: Section | None) -> dict[str, Any]:
    """Return a section for the template, with items grouped by kind and its pages separate."""
    anchor = anchors.of(section)
    parts = [_section(part, anchors, section) for part in section.sections]
    return {
        "section": section,
        "anchor": anchor,
        "runs": _runs(section.items),
        "parts": [part for part in parts if not part["section"].page],
        "pages": [part for part in parts if part["section"].page],
        "above": {"title": above.title, "anchor": anchors.of(above)} if above else None,
    }


def _all_sections(top: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    yield top
    for part in (*top["parts"], *top["pages"]):
        yield from _all_sections(part)


def _in_order(pages: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return each page with its predecessor and successor."""
    return [
        {**page, "before": before, "after": after}
        for before, page, after in zip([None, *pages], pages, [*pages[1:], None], strict=False)
    ]


def _runs(items: Sequence[Item]) -> list[tuple[str, list[Item]]]:
    """Group neighbouring items of the same kind, so that consecutive claims share a filter."""
    return [(kind.__name__.lower(), list(run)) for kind, run in groupby(items, type)]


# --- tables ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Cell:
    value: Value
    number: str
    mark: str
    origin: str
    record: str
    remark: str


def _table(
    table: Table, records: Mapping[str, Mapping[str, Any]], anchor: str
) -> Mapping[str, Any]:
    """Return a table for the template: heads, rows, footers, remarks and the legend.

    A column with figures of a single origin has its mark in the head, others in each cell.
    """
    body = table.rows[: len(table.rows) - table.footer_rows]
    columns = list(zip(*body, strict=True)) or [()] * len(table.columns)
    common = [_common_origin(column) for column in columns]
    remarks = list(dict.fromkeys(v.why for row in table.rows for v in row if v.why))
    letters = {why: _letters(place) for place, why in enumerate(remarks)}

    def cell(value: Value, place: int) -> _Cell:
        told = common[place] == value.origin
        return _Cell(
            value,
            number=_sortable(value.number),
            mark="" if told else ORIGINS.get(value.origin, ("", ""))[1],
            origin=value.origin,
            record=value.record if value.record in records else "",
            remark=letters.get(value.why, ""),
        )

    rows = [[cell(v, place) for place, v in enumerate(row)] for row in table.rows]
    origins = {v.origin for row in table.rows for v in row}
    return {
        "table": table,
        "anchor": anchor,
        "columns": [
            {"column": c, "origin": o, "mark": ORIGINS[o][1] if o else "", "marks": marked}
            for c, o, marked in zip(
                table.columns,
                common,
                [any(r[place].mark for r in rows) for place in range(len(table.columns))],
                strict=True,
            )
        ],
        "groups": _groups(table.columns),
        "rows": rows[: len(body)],
        "footers": rows[len(body) :],
        "notes": [note for note in table.notes if note not in table.places.values()],
        "remarks": [(letters[why], table.places.get(why, why)) for why in remarks],
        "legend": [
            (mark, words, o) for o, (words, mark) in ORIGINS.items() if o in origins and mark
        ],
        "linked": any(c.record for row in rows for c in row),
    }


def _sortable(number: float | None) -> str:
    """Return a number with all digits for the page's script; empty for a gap."""
    if number is None or math.isnan(number):
        return ""
    return repr(float(number)).replace("inf", "Infinity")


def _common_origin(values: Sequence[Value]) -> Any:
    found = {value.origin for value in values if value.number is not None}
    return found.pop() if len(found) == 1 else ""


def _groups(columns: Sequence[Column]) -> list[tuple[str, int]]:
    """Return the group headings with their numbers of columns; empty without groups."""
    if not any(column.group for column in columns):
        return []
    return [(name, len(list(run))) for name, run in groupby(columns, lambda c: c.group)]


def _letters(place: int) -> str:
    """Return the mark of a remark: a, b, ..., z, aa, ab, ..."""
    rest, last = divmod(place, 26)
    return (_letters(rest - 1) if rest else "") + chr(ord("a") + last)


# --- figures ---------------------------------------------------------------------------------


def _embed_all(figures: Sequence[Figure], folder: Path) -> dict[int, Embedded | None]:
    """Return the picture of each figure by identity, all within one budget of pixels."""
    rasters = [folder / file for f in figures if (file := _pixel_file(f)) is not None]
    cap = pixel_cap([size_of(path) for path in rasters])
    with ThreadPoolExecutor() as pool:
        pictures = pool.map(lambda figure: _embed(figure, folder, cap), figures)
        return {id(f): picture for f, picture in zip(figures, pictures, strict=True)}


def _embed(figure: Figure, folder: Path, cap: float) -> Embedded | None:
    """Return a plot as a vector graphic if it is small, and anything else as pixels."""
    vector = next((file for file in figure.files if file.suffix.lower() == ".svg"), None)
    raster = _pixel_file(figure)
    found = None
    if vector is not None and (figure.plot is not None or raster is None):
        found = embed_vector(folder / vector)
    if found is None and raster is not None:
        found = embed_pixels(folder / raster, cap, exact=figure.plot is not None)
    return found


def _pixel_file(figure: Figure) -> PurePosixPath | None:
    return next((file for file in figure.files if file.suffix.lower() in _PIXELS), None)


def _thumbnail(section: Section, folder: Path) -> Embedded | None:
    """Return a thumbnail of a page's first picture, for the list of pages."""
    one = Report(title="", command="", facts=(), sections=(section,))
    pictures = (_pixel_file(figure) for figure in figures_of(one) if figure.plot is None)
    file = next((file for file in pictures if file is not None), None)
    if file is None:
        return None
    return embed_pixels(folder / file, math.inf, longest=THUMBNAIL, exact=False)


def _plot(figure: Figure) -> Markup:
    """Return a Plotly figure as JSON that is safe in a script element."""
    plot = json.loads(to_json_plotly(dict(figure.plot or {})))
    plot.get("layout", {}).pop("template", None)
    return _script_json({"data": plot.get("data", []), "layout": plot.get("layout", {})})


def _script_json(content: Any) -> Markup:
    text = json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def _data(folder: Path, file: PurePosixPath) -> str:
    """Return a link to data: the data itself, or its file if it is large."""
    try:
        content = (folder / file).read_bytes()
    except OSError as error:
        raise unreadable(folder / file, error) from error
    if len(content) > DATA_BYTES:
        return quote(str(file))
    return data_uri(content, "text/csv;charset=utf-8")


# --- records ---------------------------------------------------------------------------------


def _record(key: str, row: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a record for the template: its cell and all available figures."""
    title = " · ".join(str(row[name]) for name in ("mesh", "algorithm") if row.get(name))
    shown = {name: value for name, value in row.items() if value not in (None, "", [], {}, ())}
    return {"title": title or key, "fields": [(n, _entries(v)) for n, v in shown.items()]}


def _entries(value: Any) -> list[tuple[str, str]]:
    """Return a field as text, with one line per name for a mapping."""
    if isinstance(value, Mapping):
        return [(str(name), _words(inner)) for name, inner in value.items()]
    return [("", _words(value))]


def _words(value: Any) -> str:
    if isinstance(value, str):
        return value
    if isinstance(value, list | tuple) and all(isinstance(v, str) for v in value):
        return "; ".join(value)
    return json.dumps(value, default=str, ensure_ascii=False)


# --- the page --------------------------------------------------------------------------------


def environment() -> jinja2.Environment:
    """Return the templates with their filters."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "words": _prose,
        "stopped": lambda title: title if title.endswith((".", "?", "!")) else f"{title}.",
        "address": lambda file: quote(str(file)),
    }
    environment.globals |= {
        "ORIGINS": ORIGINS,
        "SIGNS": SIGNS,
        "SUSPECTS": SUSPECTS,
        "Counter": Counter,
    }
    return environment


def _prose(words: str) -> Markup:
    """Return a report's text as HTML: `code` between backticks, symbols such as E_C."""
    text, *rest = re.split(r"`([^`\n]+)`", words)
    pairs = zip(rest[::2], rest[1::2], strict=True)
    return _symbols(text) + Markup("").join(
        Markup("<code>{}</code>").format(code) + _symbols(text) for code, text in pairs
    )


def _symbols(words: str) -> Markup:
    symbol = re.compile(r"\b([A-Za-z])_([A-Z]+)\b")
    return Markup(symbol.sub(r"<i>\1</i><sub>\2</sub>", str(escape(words))))


def policy(scripts: Sequence[bytes]) -> str:
    """Return the content security policy: only the page's own scripts run, without requests."""
    hashes = [base64.b64encode(hashlib.sha256(s).digest()).decode() for s in scripts if s]
    allowed = " ".join(f"'sha256-{value}'" for value in hashes)
    return (
        "default-src 'none'; base-uri 'none'; form-action 'none'; img-src data: blob:; "
        f"style-src 'unsafe-inline'; script-src {allowed}"
    )


def template_text(name: str) -> str:
    """Return a part of the page that is not a template: style or script."""
    return (_TEMPLATES / name).read_text()


@cache
def _plotly_source() -> bytes:
    return (Path(plotly.__file__).parent / "package_data" / "plotly.min.js").read_bytes()


@cache
def _squeezed(source: bytes) -> str:
    """Return a script as compressed text, which the browser unpacks for the first plot."""
    return base64.b64encode(gzip.compress(source, 9, mtime=0)).decode() if source else ""
