"""Consoles, messages and option parsing that all commands share.

Data is printed as it is. A name, a title or a path may hold what looks like markup (``[/fast]``) or
terminal control codes; no string printed here is interpreted as either. Styles are given as
arguments or as :class:`rich.text.Text`, never inside a string.
"""

from __future__ import annotations

import errno
import json
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.status import Status
from rich.text import Text

from cembench.core.errors import ParameterError
from cembench.core.reporter import Reporter

if TYPE_CHECKING:
    from cembench.results.records import Record

#: Control codes are replaced by visible symbols; tabs and line ends are kept.
_VISIBLE = {code: 0x2400 + code for code in range(32) if chr(code) not in "\t\n"}
_VISIBLE |= {0x7F: 0x2421} | dict.fromkeys(range(0x80, 0xA0), 0xFFFD)


class PlainConsole(Console):
    """A console that prints strings literally, without markup or control codes."""

    def __init__(self, *, stderr: bool = False) -> None:
        super().__init__(stderr=stderr, highlight=False, markup=False, emoji=False)

    def render(
        self, renderable: RenderableType, options: ConsoleOptions | None = None
    ) -> Iterable[Segment]:
        """Yield the printed segments, with control codes made visible."""
        for segment in super().render(renderable, options):
            if segment.control:
                yield segment
            else:
                yield Segment(segment.text.translate(_VISIBLE), segment.style)

    def status(self, status: RenderableType, **options: Any) -> Status:
        """Return a spinner with this text."""
        return _PlainStatus(_literal(status), console=self, **options)

    def on_broken_pipe(self) -> NoReturn:
        """Raise, so that :func:`cembench.commands.exit_codes.ending` chooses the exit code."""
        raise BrokenPipeError(errno.EPIPE, "the output pipe is closed")


class _PlainStatus(Status):
    def update(self, status: RenderableType | None = None, **options: Any) -> None:
        super().update(None if status is None else _literal(status), **options)


def _literal(words: RenderableType) -> RenderableType:
    return Text(words) if isinstance(words, str) else words


out = PlainConsole()
err = PlainConsole(stderr=True)

Json = Annotated[bool, typer.Option("--json", help="Print JSON on standard output.")]
Markdown = Annotated[
    Path | None,
    typer.Option(
        "--markdown", metavar="FILE", help="Append it as Markdown, e.g. to $GITHUB_STEP_SUMMARY."
    ),
]


def print_json(data: Any) -> None:
    """Print data as JSON on standard output."""
    sys.stdout.write(json.dumps(data, indent=2) + "\n")


def print_pair(name: str, value: object) -> None:
    """Print a name in bold and its value, on one line however long."""
    out.print(Text.assemble((name, "bold"), "  ", str(value)), soft_wrap=True)


def complain(message: str) -> None:
    """Print an error on standard error."""
    err.print(f"error: {message}", style="bold red", soft_wrap=True)


def fail(messages: Iterable[str]) -> None:
    """Print errors on standard error; if there is one, end with exit code 1."""
    for message in (messages := list(messages)):
        complain(message)
    if messages:
        raise typer.Exit(1)


def failures(records: Iterable[Record]) -> list[str]:
    """Return what went wrong with each cell that did not end ok."""
    return [
        f"{r.cell.mesh} / {r.cell.algorithm}: {r.outcome.status}: {r.outcome.cause}"
        for r in records
        if r.outcome.status != "ok"
    ]


def warn(message: str) -> None:
    """Print a warning on standard error."""
    err.print(f"warning: {message}", style="yellow", soft_wrap=True)


def note(message: str, style: str = "yellow") -> None:
    """Print a remark on standard error."""
    if not out.quiet:
        err.print(f"note: {message}", style=style, soft_wrap=True)


@contextmanager
def hushed(quiet: bool) -> Iterator[None]:
    """Print nothing but errors and JSON in this block, if `quiet`."""
    out.quiet = quiet
    try:
        yield
    finally:
        out.quiet = False


class Shown(Reporter):
    """Shows what a function of the API is doing on standard error."""

    @property
    def command(self) -> str:
        """The command that was typed."""
        return shlex.join(["cembench", *sys.argv[1:]])

    @contextmanager
    def busy(self, text: str) -> Iterator[Callable[[str], object]]:
        """Show a spinner."""
        if out.quiet:
            yield lambda text: None
            return
        with err.status(text, spinner="line") as status:
            yield status.update

    def step(self, text: str) -> None:
        """Print a line."""
        if not out.quiet:
            err.print(f"{text} ...", style="dim")

    def info(self, text: str) -> None:
        """Print a line."""
        if not out.quiet:
            err.print(text, soft_wrap=True)

    @contextmanager
    def counting(self) -> Iterator[Callable[[str, int, int], None]]:
        """Show a bar on a terminal, and lines elsewhere."""
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

        if out.quiet:
            yield lambda text, done, end: None
            return
        text_column = TextColumn("{task.description}", markup=False)
        columns = BarColumn(20), MofNCompleteColumn(), text_column
        with Progress(*columns, console=err, transient=True) as bar:
            task = bar.add_task("reading")

            def count(text: str, done: int, end: int) -> None:
                bar.update(task, description=text, completed=done, total=end)
                if not err.is_terminal and done < end:
                    err.print(f"[{done + 1}/{end}] {text}", soft_wrap=True)

            yield count

    def note(self, text: str) -> None:
        """Print a remark."""
        note(text)

    def warn(self, text: str) -> None:
        """Print a warning."""
        warn(text)

    def downloads(self, datasets: Sequence[Any]) -> AbstractContextManager[Callable[[Any], Any]]:
        """Show a bar for each download on a terminal."""
        from cembench.commands.progress import download_bars

        return download_bars(err, datasets)

    @contextmanager
    def watching(
        self, cells: int, budget: float = inf, *, on_cluster: bool = False, resumes: bool = True
    ) -> Iterator[Any]:
        """Show a live table on a terminal, and lines elsewhere; Ctrl-C says how to resume."""
        from cembench.commands.exit_codes import resumable
        from cembench.commands.progress import progress_on

        stopping = resumable() if resumes else nullcontext()
        if out.quiet:
            with stopping:
                yield None
            return
        with stopping, progress_on(err, cells, budget, on_cluster=on_cluster) as progress:
            yield progress


SHOWN = Shown()


def split(names: list[str]) -> list[str]:
    """Return the names given by a repeated or comma-separated option."""
    return [part.strip() for name in names for part in name.split(",") if part.strip()]


def assignments(texts: Sequence[str]) -> dict[str, str]:
    """Return the parameters that ``-p NAME=VALUE`` sets.

    Raises
    ------
    ParameterError
        An assignment is not of that form.
    """
    pairs = {}
    for assignment in texts:
        name, equals, value = assignment.partition("=")
        if not equals or not name:
            raise ParameterError(f"-p {assignment!r} is not of the form NAME=VALUE.")
        pairs[name.strip()] = value.strip()
    return pairs
