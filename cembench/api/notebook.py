"""What a notebook shows."""

from __future__ import annotations

import html
import sys
from collections.abc import Iterable


def html_table(rows: Iterable[tuple[str, str]]) -> str:
    """Return an HTML table of headings and texts, which are escaped.

    >>> html_table([["folds", "< 1"]])
    "<table><tr><th style='text-align:left'>folds</th><td>&lt; 1</td></tr></table>"
    """
    lines = (
        f"<tr><th style='text-align:left'>{html.escape(head)}</th><td>{html.escape(text)}</td></tr>"
        for head, text in rows
    )
    return f"<table>{''.join(lines)}</table>"


def is_notebook() -> bool:
    """Whether this process is the kernel of a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(shell, "kernel")


def show_page(page: str, height: int = 720) -> None:
    """Show an HTML page below the notebook's cell, in a frame of its own."""
    from IPython.display import display

    style = f"width:100%;height:{height}px;border:0"
    frame = f"<iframe srcdoc='{html.escape(page)}' style='{style}'></iframe>"
    display({"text/html": frame}, raw=True)  # type: ignore[no-untyped-call]
