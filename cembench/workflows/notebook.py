"""HTML tables for notebooks."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence


def html_table(rows: Iterable[Sequence[str]], heads: Sequence[str] = ()) -> str:
    """Return an HTML table; texts are escaped, and the first column holds the row headings.

    >>> html_table([["folds", "< 1"]])
    "<table><tr><th style='text-align:left'>folds</th><td>&lt; 1</td></tr></table>"
    """
    head = "".join(f"<th style='text-align:left'>{html.escape(text)}</th>" for text in heads)
    lines = [f"<tr>{head}</tr>"] if heads else []
    for first, *others in rows:
        cells = "".join(f"<td>{html.escape(text)}</td>" for text in others)
        lines.append(f"<tr><th style='text-align:left'>{html.escape(first)}</th>{cells}</tr>")
    return f"<table>{''.join(lines)}</table>"
