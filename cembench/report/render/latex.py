"""Render a report as LaTeX: ``report.tex``, and every table as a separate file.

``pdflatex report.tex`` in the report's folder compiles it with packages that every
LaTeX distribution has.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path

from cembench.core.atomic import write_text
from cembench.report.document import (
    SUSPECTS,
    Claim,
    Column,
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
    is_prose,
    items_of,
    marked,
    tex_of,
)

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

PREAMBLE = r"""\documentclass[a4paper,10pt]{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\usepackage{textcomp}
\IfFileExists{lmodern.sty}{\usepackage{lmodern}}{}
\usepackage[margin=2cm]{geometry}
\usepackage{booktabs}
\usepackage{graphicx}
\usepackage{array}
\usepackage{caption}
\captionsetup{labelformat=empty} % titles carry the paper's own numbers
\usepackage[hidelinks]{hyperref}
\setlength{\parindent}{0pt}
\setlength{\parskip}{4pt}
\sloppy
"""


def write_latex(report: Report, folder: Path) -> Path:
    """Write ``report.tex`` and ``tables/*.tex``; return the path of the first."""
    for table in items_of(report, Table):
        _write(folder / tex_of(table), table_lines(table))
    lines = [f"% Made by: {escape(report.command)}", PREAMBLE]
    lines += [rf"\title{{{escape(report.title)}}}", r"\author{}", r"\date{}"]
    lines += [r"\begin{document}", r"\maketitle", *_head(report)]
    lines += [rf"Made by \texttt{{{escape(report.command)}}}."]
    lines += [r"\begin{description}"]
    lines += [rf"\item[{escape(name)}] {escape(words)}" for name, words in report.facts]
    lines += [r"\end{description}", r"\tableofcontents", r"\clearpage"]
    for section in report.sections:
        lines += _section(section, 0)
    lines.append(r"\end{document}")
    path = folder / "report.tex"
    _write(path, lines)
    return path


def _head(report: Report) -> list[str]:
    """Return the paper that the report is about, and the findings."""
    lines, paper, found = [], report.paper, report.findings
    if paper is not None:
        doi = rf"\href{{{paper.address}}}{{doi:{escape(paper.doi)}}}"
        about = rf"{escape(paper.authors)}. \emph{{{escape(paper.title)}}}. {escape(paper.place)}."
        lines += [f"{about} {doi}", ""]
    if found is None:
        return lines
    for k, sentence in enumerate(found.sentences):
        told = _sentence(sentence)
        lines += [rf"\textbf{{{told}}}" if k == 0 else told, ""]
    if found.suspects:
        lines += [rf"\textbf{{{SUSPECTS}}}", *_itemized(map(escape, found.suspects))]
    if found.table is not None:
        lines.append(rf"\input{{{tex_of(found.table).with_suffix('')}}}")
    figures = (rf"\textbf{{{escape(one.number)}}} {escape(one.words)}" for one in found.figures)
    return [*lines, *_itemized(figures)]


def _itemized(lines: Iterable[str]) -> list[str]:
    items = [rf"\item {line}" for line in lines]
    return [r"\begin{itemize}", *items, r"\end{itemize}"] if items else []


def _sentence(sentence: Sentence) -> str:
    return "".join(
        escape(part)
        if isinstance(part, str)
        else rf"\hyperlink{{claim:{part.name}}}{{{escape(part.title)}}}"
        for part in sentence
    )


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


_LEVELS = ("section", "subsection", "subsubsection", "paragraph")


def _section(section: Section, depth: int) -> list[str]:
    level = _LEVELS[min(depth, len(_LEVELS) - 1)]
    lines = [r"\clearpage" if section.page else "", rf"\{level}{{{escape(section.title)}}}"]
    lines.append(rf"\label{{sec:{section.name}}}")
    for item in section.items:
        lines += ["", *_item(item)]
    for below in section.sections:
        lines += _section(below, depth + 1)
    return [*lines, r"\clearpage"] if depth == 0 else lines


def _item(item: Item) -> list[str]:
    if isinstance(item, Text):
        return [escape(item.words)]
    if isinstance(item, Table):
        return [rf"\input{{{tex_of(item).with_suffix('')}}}"]
    if isinstance(item, Figure):
        return _figures((item,), item.full_title, item.caption, f"fig:{item.name}")
    if isinstance(item, Gallery):
        return _figures(item.figures, item.title, item.caption, f"fig:{item.name}")
    if isinstance(item, Gap):
        how = rf" Made by: \texttt{{{escape(item.command)}}}." if item.command else ""
        return [rf"\textbf{{Missing: {escape(item.title)}.}} {escape(item.why)}{how}"]
    return _claim(item)


def _claim(claim: Claim) -> list[str]:
    parts = [("Test", claim.test), ("Found", claim.figures), ("Remark", claim.remark)]
    lines = [
        rf"\hypertarget{{claim:{claim.name}}}{{}}",
        rf"\subsubsection*{{{escape(claim.verdict)}: {escape(claim.title)}}}",
        rf"\begin{{quote}}``{escape(claim.sentence)}'' ({escape(claim.place)})\end{{quote}}",
        r"\begin{description}",
    ]
    lines += [rf"\item[{name}] {escape(words)}" for name, words in parts if words]
    return [*lines, r"\end{description}"]


def _figures(figures: Sequence[Figure], title: str, caption: str, label: str) -> list[str]:
    """Return one figure over the full width, or several in pairs, over pages if there are many."""
    alone = len(figures) == 1
    width = r"0.95\linewidth" if alone else r"0.47\linewidth"
    lines = []
    for k in range(0, len(figures), 8):
        lines += [r"\begin{figure}[htbp]", r"\centering"]
        for figure in figures[k : k + 8]:
            graphic = rf"\includegraphics[width=\linewidth]{{{_printable(figure)}}}"
            words = "" if alone else rf"\\ {{\small {escape(figure.title)}}}"
            lines.append(
                rf"\begin{{minipage}}{{{width}}}\centering {graphic}{words}\end{{minipage}}"
            )
        more = " (continued)" if k else ""
        lines.append(rf"\caption{{{escape(title)}{more}. {escape(caption)}}}")
        lines.append(rf"\label{{{label}}}" if not k else "")
        lines.append(r"\end{figure}")
    return lines


def _printable(figure: Figure) -> str:
    """Return the format of a figure for pdflatex, preferring vector graphics."""
    forms = {path.suffix: path for path in figure.files}
    chosen = next((forms[f] for f in (".pdf", ".png", ".jpg", ".jpeg") if f in forms), None)
    return str(chosen or figure.files[0])


def table_lines(table: Table) -> list[str]:
    """Return the table as floats, which need the packages booktabs and graphicx."""
    lines = [r"% needs \usepackage{booktabs,graphicx}"]
    portions = [part for columns in _by_columns(table) for part in _by_rows(columns)]
    for k, part in enumerate(portions):
        last = k == len(portions) - 1
        more = " (continued)" if k else ""
        body = part.rows[: len(part.rows) - part.footer_rows]
        rows = [_row(part, row) for row in body]
        if part.footer_rows:
            rows += [r"\midrule", *(_row(part, row) for row in part.rows[len(body) :])]
        lines += [
            r"\begin{table}[htbp]",
            r"\centering\small",
            rf"\caption{{{escape(table.title)}{more}}}",
            "" if k else rf"\label{{tab:{table.name}}}",
            # At most as wide as the line, never enlarged.
            r"\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}{%",
            rf"\begin{{tabular}}{{{_alignment(part)}}}",
            r"\toprule",
            *_heads(part.columns),
            r"\midrule",
            *rows,
            r"\bottomrule",
            r"\end{tabular}}",
        ]
        remarks = [table.caption, *table.notes] if last else []
        lines += [rf"\par\footnotesize {escape(remark)}" for remark in remarks if remark]
        lines.append(r"\end{table}")
    return lines


def _by_rows(table: Table) -> list[Table]:
    """Return a table in portions of :data:`ROWS` rows, the footer below the last."""
    last = len(table.rows) - table.footer_rows
    body, footer = table.rows[:last], table.rows[last:]
    portions = [body[k : k + ROWS] for k in range(0, last, ROWS)] or [()]
    return [
        *(replace(table, rows=rows, footer_rows=0) for rows in portions[:-1]),
        replace(table, rows=(*portions[-1], *footer)),
    ]


def _by_columns(table: Table) -> list[Table]:
    """Return a table in portions of whole groups, each with the columns that have no group."""
    numbered = list(enumerate(table.columns))
    common = [k for k, column in numbered if not column.group]
    portions: list[list[int]] = [[]]
    for group, members in groupby(numbered, lambda one: one[1].group):
        places = [k for k, _ in members] if group else []
        if portions[-1] and len(common) + len(portions[-1]) + len(places) > COLUMNS:
            portions.append([])
        portions[-1] += places
    return [table.only(sorted([*common, *places])) for places in portions]


def _alignment(table: Table) -> str:
    return "".join(
        "r" if column.numeric else r"p{0.3\linewidth}" if is_prose(table, k) else "l"
        for k, column in enumerate(table.columns)
    )


def _heads(columns: Sequence[Column]) -> list[str]:
    """Return the groups above their columns, with a rule below each, then the titles."""
    titles = [
        escape(c.title + (f" [{c.unit}]" if c.unit else "")) if c.title else "" for c in columns
    ]
    lines = []
    if any(column.group for column in columns):
        cells, rules, place = [], [], 1
        for group, members in groupby(columns, key=lambda column: column.group):
            count = len(list(members))
            cells.append(rf"\multicolumn{{{count}}}{{c}}{{{escape(group)}}}")
            if group:
                rules.append(rf"\cmidrule(lr){{{place}-{place + count - 1}}}")
            place += count
        lines += [" & ".join(cells) + r" \\", "".join(rules)]
    return [*lines, " & ".join(titles) + r" \\"]


def _row(table: Table, row: Sequence[Value]) -> str:
    pairs = zip(row, table.columns, strict=True)
    cells = [escape(marked(value, column)) for value, column in pairs]
    return " & ".join(cells) + r" \\"


def _write(path: Path, lines: Iterable[str]) -> None:
    write_text(path, "\n".join(line for line in lines if line is not None) + "\n")
