"""Receive the progress of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cembench.results.records import Record
from cembench.running.plan import Task


@dataclass(frozen=True)
class Step:
    """One process of a cell: its check, or one of its rounds, counted from 1."""

    #: None: the check.
    round: int | None = None
    #: How many there are, or those up to the next look, after which there may be more.
    rounds: int = 0
    may_go_on: bool = False

    def __str__(self) -> str:
        if self.round is None:
            return "check"
        return f"round {self.round} of {'at least ' if self.may_go_on else ''}{self.rounds}"


class Watcher:
    """Receives the progress of a run; a subclass shows it."""

    def waits(self) -> None:
        """Another run is writing to the folder; this one continues when that one has ended."""

    def begins(self, processes: int) -> None:
        """The run starts; `processes` processes will be started."""

    def adds_rounds(self, task: Task, rounds: int) -> None:
        """A cell is not precise yet; `rounds` more rounds follow."""

    def starts(self, task: Task, step: Step) -> None:
        """A process starts."""

    def ends(self, task: Task, step: Step, seconds: float) -> None:
        """A process has ended, after `seconds` in all."""

    def took(self, task: Task, seconds: float) -> None:
        """A cell's part of a process that it shared took `seconds` more."""

    def finished(self, task: Task, record: Record, *, kept: bool) -> None:
        """A cell has its record, from an earlier run if `kept`; it needs no more processes."""

    def machines(self, names: Sequence[str]) -> None:
        """These machines of a cluster take part now, one name per worker."""

    def shows(self, message: str) -> None:
        """A remark: what precision can be expected, or what happened to a machine of a cluster."""
