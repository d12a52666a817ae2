"""The progress of a run in a notebook."""

from __future__ import annotations

from typing import Any

from cembench.results.records import Record
from cembench.running.plan import Task
from cembench.running.watcher import Step, Watcher


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
