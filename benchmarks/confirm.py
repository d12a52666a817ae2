"""Does a kept report still hold for the present code? By a shorter run of some of its cells."""

from __future__ import annotations

from datetime import UTC, datetime
from math import isclose
from pathlib import Path
from typing import Any

from benchmarks.kept_report import DIGITS
from benchmarks.origins import hashes, origins, tree_at, write
from benchmarks.pages import ROOT, Section, Table
from cembench.results.columns import rows
from cembench.results.records import REFERENCE
from cembench.results.report_records import has_records, read_rows, text_rows
from cembench.results.runs_compared import Change, compare_runs
from cembench.results.store import Store

#: What a map is known by, and the smallest share of a kept report's cells that speaks for it.
FIGURES, LEAST = ("conformal_energy", "angle_error_mean_deg", "flipped_triangles"), 0.1
#: Kept figures have few digits: they are the same if they differ by less than this share.
SAME = 10.0 ** (2 - DIGITS)


def confirm(report: Path, run: Path, *, reference: str = REFERENCE, command: str = "") -> Section:
    """Renew the marks of a kept report or run if a run of the present code agrees with it.

        cembench run --surfaces ... -a cem,fdm --budget 22m -o results/second
        python -m benchmarks confirm reports/paper results/second

    A change of the code makes a kept report older than the code, whether its figures depend on it
    or not. Measuring it again takes hours; a tenth of its cells tells whether that is needed. The
    run has to be of one commit, and to hold at least that many of the report's cells. All maps in
    both have the same figures, and no verdict against the reference contradicts the report's.
    `command` is what measured the run.
    """
    store, kept = Store(run), _kept(report, reference)
    there = rows(store.records(), reference)
    changes = compare_runs(kept, there)
    if len(changes) < LEAST * len(kept):
        raise SystemExit(f"{run} has {len(changes)} of the report's {len(kept)} cells: too few.")
    other = [change for change in changes if not _same_map(change)]
    flipped = [change for change in changes if change.flipped]
    if other or flipped:
        named = ", ".join(f"{c.after['mesh']} / {c.after['algorithm']}" for c in other + flipped)
        raise SystemExit(
            f"{len(other)} maps have other figures, and {len(flipped)} verdicts contradict the "
            f"report's: {named}. Measure it again."
        )
    git = [about.get("git") or {} for about in store.environments().values()]
    commits = {str(one.get("commit") or "") for one in git}
    if len(commits) != 1 or any(one.get("dirty") for one in git):
        raise SystemExit(f"{run} is not of one commit without changes: {', '.join(commits)}.")
    commit = commits.pop()[:12]
    name, known = report.absolute().relative_to(ROOT).as_posix(), origins()
    said = [change.verdicts for change in changes if change.verdicts is not None]
    how = {
        "commit": commit,
        "date": datetime.now(UTC).date().isoformat(),
        "command": command,
        "cells": len(changes),
        "same_verdict": sum(before == after for before, after in said),
        "one_decides": sum(before != after for before, after in said),
    }
    marks = hashes(tree_at(commit), known[name]["start"])
    write(known | {name: known[name] | {"hashes": marks, "confirmed": how}})
    layout = """
| report | confirmed at | cells | same verdict | at most one decides |
|---|---|---:|---:|---:|
| {report} | `{commit}` | {cells} | {same_verdict} | {one_decides} |"""
    return Section([Table([{"report": name, **how}], layout)])


def _kept(folder: Path, reference: str) -> list[dict[str, Any]]:
    """Return the rows of a kept report, or of a kept run, with the figures as they are kept."""
    if not has_records(folder):
        return rows(Store(folder).records(), reference)
    return [
        row | {name: text[name] or None for name in FIGURES}
        for row, text in zip(read_rows(folder), text_rows(folder), strict=True)
    ]


def _same_map(change: Change) -> bool:
    """Whether both runs have the same figures of the map, to the digits that are kept."""
    pairs: list[tuple[Any, Any]] = [(change.before[f], change.after[f]) for f in FIGURES]
    return all(
        a == b or (None not in (a, b) and isclose(float(a), float(b), rel_tol=SAME, abs_tol=1e-9))
        for a, b in pairs
    )
