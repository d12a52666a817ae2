"""What a function of the API reports while it works."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from math import inf
from typing import Any


class Reporter:
    """Receives what a function is doing; this one ignores all but warnings, the command line
    shows it.
    """

    @property
    def command(self) -> str:
        """The command that makes this call; empty in Python."""
        return ""

    def busy(self, text: str) -> AbstractContextManager[Callable[[str], object]]:
        """Show a text during a block, which can replace it by calling what it gets."""
        return nullcontext(lambda text: None)

    def step(self, text: str) -> None:
        """Show what begins."""

    def info(self, text: str) -> None:
        """Show what was found or done."""

    def counting(self) -> AbstractContextManager[Callable[[str, int, int], None]]:
        """Show a count during a block, which gets a function of a text, the count and its end."""
        return nullcontext(lambda text, done, end: None)

    def note(self, text: str) -> None:
        """Show a remark."""

    def warn(self, text: str) -> None:
        """Warn of a risk, also where remarks are ignored."""
        warnings.warn(text, stacklevel=3)

    def downloads(self, datasets: Sequence[Any]) -> AbstractContextManager[Callable[[Any], Any]]:
        """Show downloads during a block, which gets a function of a dataset to its progress."""
        return nullcontext(lambda dataset: None)

    def watching(
        self, cells: int, budget: float = inf, *, on_cluster: bool = False, resumes: bool = True
    ) -> AbstractContextManager[Any]:
        """Show the progress of `cells` cells during a block, which gets a watcher or None.

        `budget` is in seconds; `resumes`: whether the same call resumes the work if it is stopped.
        """
        return nullcontext()


SILENT = Reporter()
