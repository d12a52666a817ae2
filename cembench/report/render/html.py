"""Render a report as one self-contained HTML page.

Style, script, pictures, data and Plotly's script are embedded, and the content security policy
forbids every request. Each picture is embedded once. Records, plots, their pictures and data are
one compressed text, which the script unpacks. Without JavaScript text, tables and pictures are on
one long page. With it, sections marked as pages are pages, tables sort and are filtered, plots and
pictures zoom, and a number opens its record. Nothing here depends on which sections a report has.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import json
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cache
from itertools import groupby
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import quote

import jinja2
from markupsafe import Markup, escape

from cembench.conformal.metrics import METRICS
from cembench.core.atomic import write_text
from cembench.core.extras import Extra, missing
from cembench.core.names import in_lists
from cembench.report.document import (
    ORIGINS,
    Claim,
    Figure,
    Gallery,
    Item,
    Report,
    Section,
    Table,
    Value,
    csv_of,
    groups_of,
    items_of,
)
from cembench.report.pictures import embed_pixels, embed_vector, pixel_cap, size_of, unreadable
from cembench.report.render import templates
from cembench.results.columns import COLUMNS
from cembench.results.machines import letter

#: The facets, each with the columns of a record whose values name a choice.
FACETS: Mapping[str, tuple[str, ...]] = {
    "surface": ("mesh", "paper_row"),
    "algorithm": ("algorithm", "title"),
    "status": ("status",),
}
Rows = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Facets:
    """The choices of a report's filter.

    Parameters
    ----------
    choices : mapping
        The choices of each of :data:`FACETS`, as printed.
    names : mapping
        Names in tables and plots that mean one choice: its facet and its place among the choices.
    cells : mapping
        The places of each record's choices, by its key.
    """

    choices: Mapping[str, list[str]]
    names: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    cells: Mapping[str, list[int]] = field(default_factory=dict)


def facets_of(records: Rows) -> Facets:
    """Return the choices that records offer. Names that mean several choices are left out."""
    printed = _printed(records)
    choices = [sorted({own[k] for own in printed.values()}, key=str.casefold) for k in range(3)]
    cells = {
        key: [choices[k].index(name) for k, name in enumerate(own)] for key, own in printed.items()
    }
    meant: dict[str, set[tuple[int, int]]] = {}
    for key, row in records.items():
        for k, columns in enumerate(FACETS.values()):
            for name in filter(None, (printed[key][k], *map(row.get, columns))):
                meant.setdefault(str(name), set()).add((k, cells[key][k]))
    names = {name: titles.pop() for name, titles in meant.items() if len(titles) == 1}
    return Facets(dict(zip(FACETS, choices, strict=True)), names, cells)


def _printed(records: Rows) -> dict[str, tuple[str, str, str]]:
    """Return the surface, algorithm and status of each record; algorithms of one title differ."""
    titles = {r.get("algorithm"): r.get("title") or r.get("algorithm") for r in records.values()}
    often = Counter(titles.values())

    def of(row: Mapping[str, Any]) -> tuple[str, str, str]:
        name = row.get("algorithm")
        title = titles[name] if often[titles[name]] == 1 else f"{titles[name]} ({name})"
        title = in_lists(str(title or ""))
        surface = row.get("paper_row") or row.get("mesh")
        return str(surface or ""), title, str(row.get("status") or "")

    return {key: of(row) for key, row in records.items()}


FILE = "index.html"
#: Maximum bytes of embedded data of a figure or table; larger data is only linked.
DATA_BYTES = 200_000
#: Characters of a record's key in the page, more if they would not be unique.
KEY = 12
_ENCODED = json.JSONEncoder(default=str, ensure_ascii=False).encode
_PIXELS = (".png", ".jpg", ".jpeg", ".webp")


def write_html(report: Report, folder: Path) -> Path:
    """Write `index.html`, the whole report in one file, and return its path.

    Pictures and data are read from the files that the figures name, relative to `folder`. The same
    report gives the same bytes. Without Plotly (the extra "report") plots stay pictures.

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
    figures = list(items_of(report, Figure))
    pictures = _Pictures(figures, folder)
    data = _small_files(
        folder, [f.data for f in figures if f.data], map(csv_of, items_of(report, Table))
    )
    keys = _short_keys(report.records)
    facets = facets_of(report.records)
    interactive = not missing(Extra.REPORT)
    plots = {anchors.of(f): _plot(f.plot) for f in figures if f.plot is not None and interactive}
    script = template_text("unpack.js") + template_text("report.js")
    style = template_text("report.css")
    if any(gallery.scene for gallery in items_of(report, Gallery)):
        script, style = script + template_text("view.js"), style + template_text("view.css")
    library, packed_library = _plotly() if plots else (b"", "")
    store = {
        "texts": pictures.vectors | data,
        "plots": plots,
        "records": {keys[key]: _record(key, row) for key, row in report.records.items()},
        "choices": facets.choices,
        "names": facets.names,
        "cells": {keys[key]: places for key, places in facets.cells.items()},
    }
    return (
        environment()
        .get_template("report.html")
        .render(
            report=report,
            sections=sections,
            pages=_in_order([s for s in everything if s["section"].page]),
            facets={name: options for name, options in facets.choices.items() if len(options) > 1},
            keys=keys,
            anchor=anchors.of,
            table=lambda table: _table(table, keys, anchors.of(table)),
            picture=pictures.of,
            thumbnail=pictures.first_of,
            table_data=lambda table: path if (folder / (path := csv_of(table))).exists() else "",
            style=Markup(style),
            scene=lambda gallery: as_text(gallery.scene),
            script=Markup(script),
            store=_packed(_json(store)),
            library=packed_library,
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


def _table(table: Table, keys: Mapping[str, str], anchor: str) -> Mapping[str, Any]:
    """Return a table for the template: heads, rows, footers, remarks and the legend.

    A column with figures of a single origin has its mark in the head, others in each cell.
    """
    body = table.rows[: len(table.rows) - table.footer_rows]
    columns = list(zip(*body, strict=True)) or [()] * len(table.columns)
    common = [_common_origin(column) for column in columns]
    remarks = list(dict.fromkeys(v.why for row in table.rows for v in row if v.why))
    letters = {why: letter(place).lower() for place, why in enumerate(remarks)}

    def cell(value: Value, place: int) -> _Cell:
        known = common[place] == value.origin
        return _Cell(
            value,
            number=_sortable(value.number),
            mark="" if known else ORIGINS.get(value.origin, ("", ""))[1],
            origin=value.origin,
            record=keys.get(value.record, ""),
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
        "groups": groups_of(table.columns),
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
    origins = {value.origin for value in values if value.number is not None}
    return origins.pop() if len(origins) == 1 else ""


# --- figures ---------------------------------------------------------------------------------


class _Pictures:
    """The pictures of all figures: each file embedded once, all within one budget of pixels."""

    def __init__(self, figures: Sequence[Figure], folder: Path) -> None:
        drawn = dict.fromkeys(file for f in figures if (file := _vector_file(f)) is not None)
        small = {file: embed_vector(folder / file) for file in drawn}
        self._found = {file: picture for file, picture in small.items() if picture is not None}
        self._files = {
            id(f): vector if (vector := _vector_file(f)) in self._found else _pixel_file(f)
            for f in figures
        }
        self._placed: set[PurePosixPath] = set()
        rasters = {
            file: f.plot is not None
            for f in figures
            if (file := self._files[id(f)]) is not None and file not in self._found
        }
        cap = pixel_cap([size_of(folder / file) for file in rasters])
        with ThreadPoolExecutor() as pool:
            embedded = pool.map(
                lambda item: embed_pixels(folder / item[0], cap, exact=item[1]), rasters.items()
            )
            self._found |= zip(rasters, embedded, strict=True)

    @property
    def vectors(self) -> dict[str, str]:
        """The vector graphics by file; the page's script shows them."""
        return {str(file): picture.svg for file, picture in self._found.items() if picture.svg}

    def of(self, figure: Figure, *, copy: bool = False) -> Mapping[str, Any] | None:
        """Return the picture of a figure, with its bytes unless it is a copy or shown before."""
        file = self._files[id(figure)]
        if file is None:
            return None
        source = self._found[file]
        uri = "" if copy or file in self._placed else source.uri
        if uri:
            self._placed.add(file)
        return {"file": str(file), "uri": uri, "width": source.width, "height": source.height}

    def first_of(self, section: Section) -> Mapping[str, Any] | None:
        """Return a copy of the first picture of a page, for the list of pages."""
        one = Report(title="", command="", facts=(), sections=(section,))
        pictures = (f for f in items_of(one, Figure) if f.plot is None and self._files[id(f)])
        first = next(pictures, None)
        return None if first is None else self.of(first, copy=True)


def _vector_file(figure: Figure) -> PurePosixPath | None:
    """Return the vector graphic of a plot, or of a figure that has no other picture."""
    vector = next((file for file in figure.files if file.suffix.lower() == ".svg"), None)
    return vector if figure.plot is not None or _pixel_file(figure) is None else None


def _pixel_file(figure: Figure) -> PurePosixPath | None:
    return next((file for file in figure.files if file.suffix.lower() in _PIXELS), None)


def _plot(plot: Mapping[str, Any]) -> dict[str, Any]:
    """Return a Plotly figure as JSON values, without its template."""
    from plotly.io.json import to_json_plotly  # needs the extra

    plain = json.loads(to_json_plotly(dict(plot)))
    plain.get("layout", {}).pop("template", None)
    return {"data": plain.get("data", []), "layout": plain.get("layout", {})}


def _small_files(
    folder: Path, needed: Iterable[PurePosixPath], others: Iterable[PurePosixPath]
) -> dict[str, str]:
    """Return the text of small data files by path; those of `others` need not exist."""
    small = {}
    for file in (*needed, *(file for file in others if (folder / file).exists())):
        try:
            content = (folder / file).read_bytes()
        except OSError as error:
            raise unreadable(folder / file, error) from error
        if len(content) <= DATA_BYTES:
            small[str(file)] = content.decode(errors="replace")
    return small


# --- records ---------------------------------------------------------------------------------


def _short_keys(records: Mapping[str, Any]) -> dict[str, str]:
    """Return the first characters of each key, as many as make them unique."""
    size = KEY
    while len({key[:size] for key in records}) < len(records):
        size += 1
    return {key: key[:size] for key in records}


def _record(key: str, row: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a record for the page: its cell, what is looked at most, and all fields."""
    title = " · ".join(str(row[name]) for name in ("mesh", "algorithm") if row.get(name))
    shown = {name: value for name, value in row.items() if value not in (None, "", [], {}, ())}
    fields = [(n, _entries(v)) for n, v in shown.items()]
    return {"title": title or key, "head": list(_head(shown)), "fields": fields}


METRIC_TITLES = {metric.name: metric.title for metric in METRICS}
#: What a record opens with: the columns, in this order, before the metrics.
_FIRST = (
    *("run", "machine", "mesh", "vertices", "faces", "title", "target", "status", "cause"),
    "seconds_raw",
)


def _head(row: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield what is looked at most: names, seconds of each round, and metrics, to four digits."""
    headings = {"seconds_raw": "seconds of each round", "mesh": "surface", "title": "algorithm"}
    names = [name for name in (*_FIRST, *(m.name for m in METRICS), "iterations") if name in row]
    for name in names:
        column, value = COLUMNS.get(name), row[name]
        usual = column.heading if column else ""
        heading = headings.get(name) or METRIC_TITLES.get(name) or usual or name
        if isinstance(value, list | tuple):
            text = ", ".join(f"{v:.4g}" for v in value if isinstance(v, int | float))
        else:
            text = f"{value:.4g}" if isinstance(value, float) else str(value)
            text = f"{value:,}" if type(value) is int else text
        unit = "s" if name == "seconds_raw" else column.unit if column else ""
        yield heading, f"{text} {unit}".rstrip()


def _entries(value: Any) -> list[tuple[str, str]]:
    """Return a field as text, with one line per name for a mapping."""
    if isinstance(value, Mapping):
        return [(str(name), _words(inner)) for name, inner in value.items()]
    return [("", _words(value))]


def _words(value: Any) -> str:
    if isinstance(value, str):
        return value
    if type(value) in (int, float):
        return repr(value)
    if isinstance(value, list | tuple) and all(isinstance(v, str) for v in value):
        return "; ".join(value)
    return _ENCODED(_short(value))


def _short(value: Any) -> Any:
    """Return nested lists with their numbers to six digits; records.csv has them all.

    The seconds of every call would be two fifths of the page.
    """
    if isinstance(value, float):
        return float(f"{value:.6g}")
    return list(map(_short, value)) if isinstance(value, list | tuple) else value


# --- the page --------------------------------------------------------------------------------


def environment() -> jinja2.Environment:
    """Return the templates with the filters of pages."""
    forms = templates.environment()
    forms.filters |= {
        "words": _prose,
        "stopped": lambda title: title if title.endswith((".", "?", "!")) else f"{title}.",
        "address": lambda file: quote(str(file)),
    }
    return forms


def _prose(words: str) -> Markup:
    """Return a report's text as HTML: `code` between backticks, symbols such as E_C, links."""
    text, *rest = re.split(r"`([^`\n]+)`", words)
    pairs = zip(rest[::2], rest[1::2], strict=True)
    return _symbols(text) + Markup("").join(
        Markup("<code>{}</code>").format(code) + _symbols(text) for code, text in pairs
    )


def _symbols(words: str) -> Markup:
    symbol = re.compile(r"\b([A-Za-z])_([A-Z]+)\b")
    words = re.sub(r"(?<=\d) (?=%)", "\u00a0", words)  # no line ends before a per cent
    text = re.sub(r"(https://[^\s<>]*[\w/])", r'<a href="\1">\1</a>', str(escape(words)))
    return Markup(symbol.sub(r"<i>\1</i><sub>\2</sub>", text))


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
    return (templates.FOLDER / name).read_text(encoding="utf-8")


@cache
def _plotly() -> tuple[bytes, Markup]:
    """Return Plotly's script, plain and as compressed text."""
    import plotly  # needs the extra

    source = (Path(plotly.__file__).parent / "package_data" / "plotly.min.js").read_bytes()
    return source, _packed(source)


def _packed(content: bytes) -> Markup:
    """Return content as compressed text, which the browser unpacks."""
    return as_text(gzip.compress(content, 9, mtime=0))


def as_text(content: bytes) -> Markup:
    """Return bytes as text for a script element (base 85, a sixteenth shorter than base 64)."""
    return Markup(base64.b85encode(content).decode())


def _json(content: Any) -> bytes:
    return json.dumps(content, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
