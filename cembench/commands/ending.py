"""How the command line ends, whatever happens in a verb.

====  ===================================================================================
0     every cell asked for ended ok
1     one did not, or something in a run does not agree
2     the call or the input was wrong; a message says what, where and what to do
70    a fault of cembench itself; its traceback is in a file, or shown with CEMBENCH_DEBUG=1
74    the system refused to read or write a file
129   stopped by SIGHUP, as 130 by Ctrl-C and 143 by SIGTERM; temporary files are gone
141   nobody reads the output any more (``cembench list | head -1``)
====  ===================================================================================
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn

from typer.core import TyperGroup

from cembench.commands.console import complain, err
from cembench.core.errors import CembenchError

BAD_USAGE, FAULT, SYSTEM, CLOSED_PIPE = 2, 70, 74, 141
#: Set to anything, it shows the traceback of a fault on standard error.
DEBUG = "CEMBENCH_DEBUG"
#: What Ctrl-C is answered with.
STOPPED, STOPPED_AND_KEPT = "Stopped.", "Stopped; the same command resumes."


class _Passed(BaseException):
    """Carries an exception past the command-line library, which has an ending of its own for it."""

    def __init__(self, error: Exception) -> None:
        self.error = error


class _Resumable(KeyboardInterrupt):
    """Ctrl-C where what was done is kept."""


@contextmanager
def resumable() -> Iterator[None]:
    """Let Ctrl-C out of the enclosed tell that the same command goes on where it was stopped."""
    try:
        yield
    except KeyboardInterrupt as error:
        raise _Resumable from error


class Verbs(TyperGroup):
    """The verbs; OSError and EOFError out of one of them are no usage errors and no Ctrl-D."""

    def invoke(self, ctx: Any) -> Any:
        """Call the verb."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as error:
            err.print(STOPPED_AND_KEPT if isinstance(error, _Resumable) else STOPPED)
            raise
        except (OSError, EOFError) as error:
            raise _Passed(error) from error


@contextmanager
def ending() -> Iterator[None]:
    """Turn whatever comes out of the enclosed into an exit code and a message."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError):  # a stream that was replaced may not be able to
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    before = _stop_on_signals()
    try:
        try:
            yield
        except SystemExit:
            sys.stdout.flush()  # now, while a closed pipe can still be told from a fault
            raise
    except _Passed as passed:
        _end_of(passed.error)
    except Exception as error:
        _end_of(error)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _end_of(error: Exception) -> NoReturn:
    if isinstance(error, BrokenPipeError):
        _forget_output()
        sys.exit(CLOSED_PIPE)
    if isinstance(error, CembenchError):
        complain(str(error))
        sys.exit(BAD_USAGE)
    told = "".join(traceback.format_exception(error))
    if isinstance(error, OSError):
        where = f"{os.fspath(error.filename)!r}: " if error.filename is not None else ""
        message = f"{where}{error.strerror or error}. The system refused to read or write it."
        code = SYSTEM
    else:
        message = f"cembench met a fault of its own: {type(error).__name__}: {error}. "
        message += "Please report it, with " + _kept(told)
        code = FAULT
    complain(message)
    if DEBUG in os.environ:
        with suppress(OSError):
            sys.stderr.write(told)
    sys.exit(code)


def _kept(told: str) -> str:
    """Lay a traceback into a file and return its name in words, or how to see it."""
    if DEBUG not in os.environ:
        with (
            suppress(OSError),
            tempfile.NamedTemporaryFile(
                "w",
                prefix="cembench-fault-",
                suffix=".txt",
                delete=False,
                errors="backslashreplace",
            ) as file,
        ):
            file.write(told)
            return f"the traceback in {file.name}."
    return f"the traceback that {DEBUG}=1 shows."


def _forget_output() -> None:
    """Let what is buffered go nowhere, so that the interpreter does not complain at its end."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except BrokenPipeError:
            os.dup2(nowhere, stream.fileno())
    os.close(nowhere)


def _stop_on_signals() -> dict[int, Any]:
    """Let SIGTERM and SIGHUP unwind like Ctrl-C does, so that temporary folders are removed.

    A signal that is ignored (``nohup``) stays so; a second one does not interrupt the clearing up.
    Returns what handled them before.
    """
    known = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
    mortal = [number for number in known if signal.getsignal(number) is signal.SIG_DFL]
    return {number: signal.signal(number, _stop) for number in mortal}


def _stop(number: int, _: object) -> NoReturn:
    signal.signal(number, signal.SIG_IGN)
    sys.exit(128 + number)
