"""Exit codes and last messages of the command line.

====  ===================================================================================
0     every requested cell ended ok
1     a cell did not end ok, or the contents of a run disagree
2     the usage or the input was wrong; a message says what, where and what to do
70    an internal error of cembench; its traceback is in a file, or shown by CEMBENCH_DEBUG=1
74    the system refused to read or write a file
129   stopped by SIGHUP (130: by Ctrl-C, 143: by SIGTERM); temporary files are removed
141   the output pipe was closed (``cembench list | head -1``)
====  ===================================================================================
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from typing import Any, NoReturn

from typer.core import TyperGroup

from cembench.commands.console import complain, err
from cembench.core.errors import CembenchError

BAD_USAGE, FAULT, SYSTEM, CLOSED_PIPE = 2, 70, 74, 141
#: Environment variable: if set, the traceback of an internal error goes to standard error.
DEBUG = "CEMBENCH_DEBUG"
#: What the help calls values of these types; a flag has none.
VALUES = {"<bool>": "", "<path>": "PATH", "<list[Path]>": "PATH...", "<int range>": "N"}
VALUES |= {"<str>": "NAME", "<list[str]>": "NAME..."}
#: Message after Ctrl-C.
STOPPED, STOPPED_AND_KEPT = "Stopped.", "Stopped; the same command resumes."


class _Passed(BaseException):
    """Carries an exception past the command-line library, which would handle it differently."""

    def __init__(self, error: Exception) -> None:
        self.error = error


class _Resumable(KeyboardInterrupt):
    """Ctrl-C during work whose results so far are kept."""


@contextmanager
def resumable() -> Iterator[None]:
    """Make Ctrl-C in this block print that the same command resumes the work."""
    try:
        yield
    except KeyboardInterrupt as error:
        raise _Resumable from error


class Verbs(TyperGroup):
    """The commands; an OSError or EOFError in one is not treated as wrong usage or Ctrl-D."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the list of commands as plain text; loading what draws boxes doubles its time."""
        self.rich_markup_mode = None
        for command in self.commands.values():
            command.short_help = (command.help or "").split("\n\n")[0]
        super().format_help(ctx, formatter)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command whose help names values as users do, not as Python does."""
        command = super().get_command(ctx, cmd_name)
        for one in command.get_params(ctx) if command else ():
            if shown := getattr(one, "display_type_rich", None):  # newer versions of the library
                one.display_type_rich = partial(_named_value, shown)  # type: ignore[attr-defined]
        return command

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read a command line; without a word it asks for help, and so does `help VERB`."""
        if args[:1] == ["help"]:
            args = [*args[1:2], "--help"]
        return super().parse_args(ctx, args or ([] if ctx.resilient_parsing else ["--help"]))

    def invoke(self, ctx: Any) -> Any:
        """Call the command."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as error:
            err.print(STOPPED_AND_KEPT if isinstance(error, _Resumable) else STOPPED)
            raise
        except (OSError, EOFError) as error:
            raise _Passed(error) from error


def _named_value(shown: Callable[[Any], str | None], ctx: Any) -> str | None:
    words = shown(ctx)
    return VALUES.get(words or "", words)


@contextmanager
def ending() -> Iterator[None]:
    """Turn any exception in this block into a message and an exit code."""
    _open_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError):  # a replaced stream may not support this
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    before = stop_on_signals()
    try:
        try:
            yield
        except SystemExit:
            sys.stdout.flush()  # now, while a closed pipe can still be distinguished from a fault
            raise
    except _Passed as passed:
        _end_of(passed.error)
    except Exception as error:
        _end_of(error)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _open_closed_streams() -> None:
    """Let output go nowhere where it was closed, as some supervisors do.

    The next file to be opened would otherwise take the number of the stream, and its output.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            handle = os.open(os.devnull, os.O_RDWR)
            if handle != number:
                os.dup2(handle, number)
                os.close(handle)
            mode = "w" if number else "r"
            setattr(sys, name, os.fdopen(number, mode, encoding="utf-8", closefd=False))


def _end_of(error: Exception) -> NoReturn:
    if isinstance(error, BrokenPipeError):
        _forget_output()
        sys.exit(CLOSED_PIPE)
    if isinstance(error, CembenchError):
        complain(str(error))
        sys.exit(BAD_USAGE)
    trace = "".join(traceback.format_exception(error))
    if isinstance(error, OSError):
        where = f"{os.fspath(error.filename)!r}: " if error.filename is not None else ""
        message = f"{where}{error.strerror or error}. {_advice(error)}"
        code = SYSTEM
    else:
        message = f"internal error in cembench: {type(error).__name__}: {error}. "
        message += "Please report it, with " + _kept(trace)
        code = FAULT
    complain(message)
    if DEBUG in os.environ:
        with suppress(OSError):
            sys.stderr.write(trace)
    sys.exit(code)


def _advice(error: OSError) -> str:
    from cembench.core.atomic import FREE_SPACE, FULL

    if error.errno in FULL:
        return FREE_SPACE
    if isinstance(error, FileNotFoundError):
        return "It, or a folder above it, is gone; run the same command again."
    return "The operating system refused the access."


def _kept(trace: str) -> str:
    """Write a traceback to a file; return where it is, or how to show it."""
    if DEBUG not in os.environ:
        with suppress(OSError):
            handle, name = tempfile.mkstemp(".txt", "cembench-fault-")
            with os.fdopen(handle, "wb") as file:
                file.write(trace.encode(errors="backslashreplace"))
            return f"the traceback in {name}."
    return f"the traceback that {DEBUG}=1 prints."


def _forget_output() -> None:
    """Discard buffered output, so that the interpreter does not complain at exit."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except BrokenPipeError:
            os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def stop_on_signals() -> dict[int, Any]:
    """Make SIGTERM and SIGHUP unwind like Ctrl-C, so that temporary folders are removed.

    An ignored signal (``nohup``) stays ignored; a second signal does not interrupt the cleanup.
    Returns the previous handlers.
    """
    known = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    mortal = [number for number in known if signal.getsignal(number) is signal.SIG_DFL]
    return {number: signal.signal(number, _stop) for number in mortal}


def _stop(number: int, _: object) -> NoReturn:
    signal.signal(number, signal.SIG_IGN)
    sys.exit(128 + number)
