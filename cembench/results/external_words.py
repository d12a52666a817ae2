"""Words for the seconds of external programs in tables."""

from __future__ import annotations

from cembench.results.records import Record

#: Marks of algorithms that are not cembench's code, in tables.
PROGRAM_MARK, LIBRARY_MARK = "†", "‡"


def mark_of(record: Record) -> str:
    """Return the mark of an algorithm in a table; "" for cembench's own and plug-ins."""
    if record.external is None:
        return ""
    return PROGRAM_MARK if record.external.kind == "program" else LIBRARY_MARK


def marks_explained(records: list[Record]) -> list[str]:
    """Return one line for each mark used in a table of these records."""
    marks = {mark_of(record) for record in records}
    lines = []
    if PROGRAM_MARK in marks:
        lines.append(
            f"{PROGRAM_MARK} external program: its seconds are the wall clock of a process, with "
            "its start and its files; comparisons take its solve time, and a verdict needs the "
            "wall clock less its start to agree with the time that it prints"
        )
    if LIBRARY_MARK in marks:
        lines.append(
            f"{LIBRARY_MARK} a library of others, called in the process: it solves its systems "
            "in its own way"
        )
    return lines


def solve_words(record: Record) -> str:
    """Return the origin of a program's solve time."""
    return "by its own word" if record.outcome.own_seconds is not None else "wall less start"


def seconds_words(record: Record) -> str:
    """Return the times of an external program in one line; "" for anything else."""
    outcome = record.outcome
    if not record.is_program or outcome.median_seconds is None:
        return ""
    parts = [f"wall clock of the process {outcome.median_seconds:.3f} s"]
    start, solve = outcome.start_seconds, outcome.solve_seconds
    parts.append("start unknown" if start is None else f"on a small mesh {start:.3f} s")
    if solve is not None:
        parts.append(f"solve {solve:.3f} s ({solve_words(record)})")
    if outcome.program is not None:
        sizes = outcome.program.input_bytes, outcome.program.output_bytes
        parts.append("files {:,.0f} kB in, {:,.0f} kB out".format(*(s / 1000 for s in sizes)))
        if outcome.program.version:
            parts.append(f"version: {outcome.program.version}")
    return "; ".join(parts)
