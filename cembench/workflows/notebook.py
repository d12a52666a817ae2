"""What a notebook shows of a result: figures as a table of HTML."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence


def html_table(rows: Iterable[Sequence[str]], heads: Sequence[str] = ()) -> str:
    """Return a table of HTML; every text is escaped, the first column is the rows' heading.

    >>> html_table([["folds", "< 1"]])
    "<table><tr><th style='text-align:left'>folds</th><td>&lt; 1</td></tr></table>"
    """
    head = "".join(f"<th style='text-align:left'>{html.escape(text)}</th>" for text in heads)
    lines = [f"<tr>{head}</tr>"] if heads else []
    for first, *others in rows:
        cells = "".join(f"<td>{html.escape(text)}</td>" for text in others)
        lines.append(f"<tr><th style='text-align:left'>{html.escape(first)}</th>{cells}</tr>")
    return f"<table>{''.join(lines)}</table>"
