"""Progress of a run and of downloads: live on a terminal, one line at a time elsewhere."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from math import inf
from time import monotonic
from typing import Any, Self

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress import BarColumn, DownloadColumn, TaskID, TextColumn
from rich.progress import Progress as Bars
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from cembench.core.wording import counted
from cembench.mesh.datasets import Dataset
from cembench.mesh.download import Progress
from cembench.report.render.terminal import status_style
from cembench.results.records import Record
from cembench.running.plan import Task
from cembench.running.watcher import Step, Watcher

#: Number of cells in the live table.
_SHOWN = 12


class Remaining:
    """Estimate of the seconds left: each cell's next process takes as long as its last one.

    It is no more than what is left of the `budget` in seconds, while something is left of it.
    """

    def __init__(self, budget: float = inf) -> None:
        self._until = monotonic() + budget
        self.processes = 0
        self.done = 0
        #: So many share what is left.
        self.machines = 1
        self._left: dict[str, int] = {}
        self._last: dict[str, float] = {}

    def expect(self, processes: int) -> None:
        """Set the number of processes that will be run."""
        self.processes = processes

    def expect_more(self, cell: str, processes: int) -> None:
        """Add processes to a cell that needs more rounds."""
        self.processes += processes
        self._left[cell] = self._left.get(cell, 0) + processes

    def ended(self, cell: str, left: int, seconds: float) -> None:
        """Record the seconds of a cell's process, and how many processes it has left."""
        self.done += 1
        self._left[cell] = left
        self._last[cell] = seconds

    def took(self, cell: str, seconds: float) -> None:
        """Add the seconds of a shared process to those of a cell's last one."""
        self._last[cell] = self._last.get(cell, 0.0) + seconds

    def finished(self, cell: str) -> None:
        """Drop the processes still expected for this cell."""
        self.processes -= self._left.pop(cell, 0)

    @property
    def seconds(self) -> float | None:
        """The estimated seconds left; None before the first process has ended."""
        if not self._last:
            return None
        known = sum(self._left.get(cell, 0) * last for cell, last in self._last.items())
        unknown = self.processes - self.done - sum(self._left.values())
        alone = known + max(unknown, 0) * sum(self._last.values()) / len(self._last)
        estimate, left = alone / self.machines, self._until - monotonic()
        return min(estimate, left) if left > 0 else estimate


class PlainProgress(Watcher):
    """Prints a line for each round that begins and each cell that ends, or after a minute."""

    #: Seconds without a line after which one says how far the run is.
    EVERY = 60.0

    def __init__(self, console: Console, cells: int, budget: float = inf) -> None:
        self.console = console
        self.cells = cells
        self.finished_cells = 0
        self.remaining = Remaining(budget)
        self._step: Step | None = None
        self._said_at = monotonic()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: Any) -> None:
        """Do nothing: there is no display to close."""

    def waits(self) -> None:
        """Print that the run waits for another one."""
        self._say("another run is writing to this folder; waiting for it to end")

    def begins(self, processes: int) -> None:
        """Store the number of processes."""
        self.remaining.expect(processes)

    def adds_rounds(self, task: Task, rounds: int) -> None:
        """Add the processes of further rounds."""
        self.remaining.expect_more(task.cell.label, rounds)

    def starts(self, task: Task, step: Step) -> None:
        """Print a line if a new round begins."""
        if step != self._step:
            self._step = step
            self._say_left(str(step))

    def ends(self, task: Task, step: Step, seconds: float) -> None:
        """Update the estimate of the time left, and print it after a minute without a line."""
        self.remaining.ended(task.cell.label, step.rounds - (step.round or 0), seconds)
        if monotonic() - self._said_at > self.EVERY:
            self._say_left(f"{self.remaining.done} of {self.remaining.processes} processes")

    def took(self, task: Task, seconds: float) -> None:
        """Update the estimate of the time left."""
        self.remaining.took(task.cell.label, seconds)

    def finished(self, task: Task, record: Record, *, kept: bool) -> None:
        """Print a line for the cell."""
        self.remaining.finished(task.cell.label)
        self.finished_cells += 1
        how = "kept" if kept else record.outcome.status
        self._say(
            f"[{self.finished_cells}/{self.cells}] {task.cell.mesh} / {task.cell.algorithm}: {how}"
        )

    def machines(self, names: Sequence[str]) -> None:
        """Print the number of workers; those of one machine take turns."""
        self.remaining.machines = max(1, len(set(names)))
        self.shows(f"{counted(len(names), 'worker')} there")

    def shows(self, words: str) -> None:
        """Print a remark; a live display stays below it."""
        self.console.print(words, markup=False, soft_wrap=True)

    def _say_left(self, line: str) -> None:
        left = self.remaining.seconds
        self._say(line + ("" if left is None else f", about {duration(left)} left"))

    def _say(self, line: str) -> None:
        self._said_at = monotonic()
        self.console.print(line, markup=False, soft_wrap=True)


class PlainOnCluster(PlainProgress):
    """Like its base, without lines for rounds, because machines are at different rounds."""

    def starts(self, task: Task, step: Step) -> None:
        """Print nothing."""


class LiveProgress(PlainProgress):
    """Shows a table of the cells in work, and a bar with the time left."""

    EVERY = inf

    def __init__(self, console: Console, cells: int, budget: float = inf) -> None:
        super().__init__(console, cells, budget)
        self._lines: dict[str, tuple[str, str, Text]] = {}
        self._recent: deque[str] = deque(maxlen=_SHOWN)
        self._notice = ""
        self._live = Live(console=console, transient=True, get_renderable=self._picture)

    def __enter__(self) -> Self:
        self._live.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._live.__exit__(*error)

    def starts(self, task: Task, step: Step) -> None:
        """Move the cell to the end of the table."""
        self._notice = ""
        self._show(task, Text(str(step), style="bold"))

    def ends(self, task: Task, step: Step, seconds: float) -> None:
        """Mark the step as done."""
        super().ends(task, step, seconds)
        self._show(task, Text(f"{step} done", style="dim"))

    def finished(self, task: Task, record: Record, *, kept: bool) -> None:
        """Show the status and the seconds."""
        self.remaining.finished(task.cell.label)
        self.finished_cells += 1
        status = record.outcome.status
        text = Text("kept" if kept else status, style=status_style(status))
        if record.outcome.median_seconds is not None:
            text.append(f"  {record.outcome.median_seconds:.3f} s", style="dim")
        self._show(task, text)

    def _say(self, line: str) -> None:
        self._notice = line

    def _show(self, task: Task, state: Text) -> None:
        label = task.cell.label
        self._lines[label] = (task.cell.mesh, task.cell.algorithm, state)
        if label in self._recent:
            self._recent.remove(label)
        self._recent.append(label)

    def _picture(self) -> RenderableType:
        lines = [self._lines[label] for label in self._recent]
        table = Table.grid(padding=(0, 2))
        for line in lines:
            table.add_row(*line)
        bar = Table.grid(padding=(0, 1))
        left = self.remaining.seconds
        bar.add_row(
            ProgressBar(total=max(self.remaining.processes, 1), completed=self.remaining.done),
            f"{self.finished_cells}/{self.cells} cells",
            "" if left is None else f"about {duration(left)} left",
        )
        bar.columns[0].width = 30
        return Group(table, bar, *([Text(self._notice)] if self._notice else []))


def progress_on(
    console: Console, cells: int, budget: float = inf, *, on_cluster: bool = False
) -> PlainProgress:
    """Return the live table on a terminal, and one line per event elsewhere."""
    kind = LiveProgress if console.is_terminal else PlainOnCluster if on_cluster else PlainProgress
    return kind(console, cells, budget)


def duration(seconds: float) -> str:
    """Return seconds in a readable form, such as "3 min"."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    if seconds < 90 * 60:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"


@dataclass
class _Bar:
    """The progress bar of one file."""

    bars: Bars
    line: TaskID
    total: int = 0
    whole: TaskID | None = None

    def update(self, count: int) -> None:
        """Add bytes that have arrived."""
        self.bars.update(self.line, advance=count, total=self.total or None)
        if self.whole is not None:
            self.bars.update(self.whole, advance=count)

    def close(self) -> None:
        """Hide the bar of this file if there are others."""
        self.bars.stop_task(self.line)
        if self.whole is not None:
            self.bars.update(self.line, visible=False)


@contextmanager
def download_bars(
    console: Console, datasets: Sequence[Dataset]
) -> Iterator[Callable[[Dataset], Progress | None]]:
    """Yield a function that makes a bar for each file on a terminal, and nothing elsewhere."""
    if not console.is_terminal:
        yield lambda dataset: None
        return
    columns = (TextColumn("{task.description}", markup=False), BarColumn(20), DownloadColumn())
    total = sum(d.size or 0 for d in datasets)
    with Bars(*columns, console=console, transient=True) as bars:
        whole = bars.add_task("all files", total=total or None) if len(datasets) > 1 else None

        def bar(dataset: Dataset) -> Progress:
            line = bars.add_task(f"fetching {dataset.name}", total=dataset.size)
            return _Bar(bars, line, whole=whole)

        yield bar
