"""A file given to the command line as a user gives it: ``cembench map FILE``."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

from tests.campaign import project
from tests.campaign.verdict import Verdict


def judge_verb(path: Path, read: Verdict) -> Verdict:
    """Map a file that was read, or refused: exit code 0, 1 or 2, words where it is not 0.

    To be called in a forked process: standard output and error are exchanged.
    """
    with tempfile.TemporaryFile() as said:
        kept = os.dup(1), os.dup(2)
        sys.stdout.flush()
        sys.stderr.flush()
        for target in (1, 2):
            os.dup2(said.fileno(), target)
        try:
            code, error = _exit_code(["map", str(path), "-a", "harmonic-circle"])
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            for target, source in zip((1, 2), kept, strict=True):
                os.dup2(source, target)
                os.close(source)
        said.seek(0)
        words = said.read().decode(errors="replace")
    if error or "Traceback (most recent call last)" in words:
        return Verdict(read.outcome, "traceback", f"from the verb map: {error or words[-800:]}")
    if code not in (0, 1, 2) or (code and not words.strip()):
        return Verdict(read.outcome, "exit code", f"{code} from the verb map: {words[-200:]!r}")
    if read.outcome == "refused" and code != 2:
        return Verdict(read.outcome, "exit code", f"{code}, not 2, for a file that is refused")
    return read


def _exit_code(arguments: list[str]) -> tuple[int, str]:
    """Call the command line in this process: its exit code, and an exception that left it."""
    sys.argv = ["cembench", *arguments]
    try:
        project.command_line()
    except SystemExit as stopped:
        return (stopped.code if isinstance(stopped.code, int) else int(bool(stopped.code))), ""
    except Exception as error:
        return 1, f"{type(error).__name__}: {error}"
    return 0, ""
