"""What a notebook shows."""

from __future__ import annotations

import html
import sys
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

from cembench.running.watcher import Step, Watcher

if TYPE_CHECKING:
    from cembench.results.records import Record
    from cembench.running.plan import Task


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


class NotebookProgress(Watcher):
    """A line below the notebook's cell that says how far a run is."""

    def __init__(self, cells: int) -> None:
        from IPython.display import display

        self._cells, self._done, self._step = cells, 0, ""
        shown = {"text/plain": f"measuring {cells} cells"}
        self._line: Any = display(shown, raw=True, display_id=True)  # type: ignore[no-untyped-call]

    def starts(self, task: Task, step: Step) -> None:
        """Show the step when another begins."""
        if str(step) != self._step:
            self._step = str(step)
            self._show(self._step)

    def finished(self, task: Task, record: Record, *, kept: bool) -> None:
        """Show the cell that ended."""
        self._done += 1
        self._show(f"{task.cell.mesh} / {task.cell.algorithm}: {record.outcome.status}")

    def _show(self, words: str) -> None:
        line = f"{self._done} of {self._cells} cells; {words}"
        self._line.update({"text/plain": line}, raw=True)
