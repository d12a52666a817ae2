"""Render a report as LaTeX: ``report.tex``, and every table as a separate file.

``pdflatex report.tex`` in the report's folder compiles it with packages that every
LaTeX distribution has.
"""

from __future__ import annotations

import unicodedata
from dataclasses import replace
from functools import cache
from itertools import groupby
from pathlib import Path, PurePosixPath
from typing import Any

from cembench.core.atomic import write_text
from cembench.report.document import Figure, Report, Table, groups_of, is_prose, items_of, tex_of
from cembench.report.render.templates import environment

#: Replacements of characters; other non-Latin characters lose their accents or become "?".
_CHARACTERS = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "$": r"\$", "&": r"\&", "#": r"\#",
    "%": r"\%", "_": r"\_", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}",
    "<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}", '"': r"\textquotedbl{}",
    "\u1d56": r"\textsuperscript{p}", "\u1d50": r"\textsuperscript{m}",
    "\u02e2": r"\textsuperscript{s}", "\u2020": r"\textdagger{}",
    "\u2013": "--", "\u2014": "---", "\u2018": "`", "\u2019": "'", "\u201c": "``", "\u201d": "''",
    "\u2026": r"\dots{}", "\u2212": "$-$", "\u00b1": r"$\pm$", "\u00b0": r"$^\circ$",
    "\u00b7": r"$\cdot$", "\u00d7": r"$\times$", "\u2264": r"$\le$", "\u2265": r"$\ge$",
    "\u221e": r"$\infty$", "\u03c4": r"$\tau$", "\u03c0": r"$\pi$", "\u03c1": r"$\rho$",
    "\u03bb": r"$\lambda$", "\u00b5": r"$\mu$", "\u00b2": r"\textsuperscript{2}",
    "\u00b3": r"\textsuperscript{3}", "\n": " ", "\u00a0": "~",
}  # fmt: skip
#: Maximum rows of a table on a page; longer tables are continued.
ROWS = 38
#: Maximum columns of a table on a page; wider ones are continued after a group of columns.
COLUMNS = 18


def write_latex(report: Report, folder: Path) -> Path:
    """Write ``report.tex`` and ``tables/*.tex``; return the path of the first."""
    for table in items_of(report, Table):
        write_text(folder / tex_of(table), table_lines(table))
    write_text(folder / "report.tex", str(_forms().whole(report)))
    return folder / "report.tex"


def table_lines(table: Table) -> str:
    """Return the table as floats, which need the packages booktabs and graphicx."""
    return str(_forms().table_lines(table))


@cache
def _forms() -> Any:
    """Return the parts of the template as functions; its marks leave LaTeX's braces alone."""
    ends = {"block": ("<%", "%>"), "variable": ("<<", ">>"), "comment": ("<#", "#>")}
    marks = {
        f"{kind}_{end}_string": mark
        for kind, pair in ends.items()
        for end, mark in zip(("start", "end"), pair, strict=True)
    }
    forms = environment(escape, **marks)
    forms.filters |= {"tex": lambda table: tex_of(table).with_suffix(""), "printable": _printable}
    known = {"is_prose": is_prose, "portions": _portions, "groups_of": groups_of}
    return forms.get_template("latex.jinja", globals=known).module


def escape(text: str) -> str:
    """Return text escaped for LaTeX, as far as the fonts have its characters."""
    return "".join(_character(c) for c in text)


def _character(character: str) -> str:
    known = _CHARACTERS.get(character)
    if known is not None:
        return known
    if " " <= character <= "~" or "¡" <= character <= "ž":
        return character
    plain = unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode()
    return "".join(_CHARACTERS.get(c, c) for c in plain) or "?"


def _printable(figure: Figure) -> PurePosixPath:
    """Return the format of a figure for pdflatex, preferring vector graphics."""
    forms = {path.suffix: path for path in figure.files}
    known = [forms[form] for form in (".pdf", ".png", ".jpg", ".jpeg") if form in forms]
    return (known or figure.files)[0]


def _portions(table: Table) -> list[Table]:
    """Return a table in portions of :data:`ROWS` rows and whole groups of columns.

    Each portion has the columns that have no group; the footer is below the last rows.
    """
    numbered = list(enumerate(table.columns))
    common = [k for k, column in numbered if not column.group]
    wide: list[list[int]] = [[]]
    for group, members in groupby(numbered, lambda one: one[1].group):
        places = [k for k, _ in members] if group else []
        if wide[-1] and len(common) + len(wide[-1]) + len(places) > COLUMNS:
            wide.append([])
        wide[-1] += places
    last = len(table.rows) - table.footer_rows
    starts = range(0, max(last, 1), ROWS)
    return [
        replace(part, rows=part.rows[k : k + ROWS], footer_rows=0)
        if k != starts[-1]
        else replace(part, rows=part.rows[k:])
        for part in (table.only(sorted([*common, *places])) for places in wide)
        for k in starts
    ]
