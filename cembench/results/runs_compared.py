"""Compare the seconds of two runs cell by cell, and what they say of the reference.

Rounds of two runs are not paired, and the machine may have drifted between them. So every round
also times a reference kernel that never changes (:mod:`cembench.running.reference_kernel`).
The seconds of a cell are divided by the kernel's in the same round, and compared by the rank-sum
test at the 5 % level. If a run has no kernel times, plain seconds are compared; the interval then
ignores drift.

A run is the rows of its frame (:func:`cembench.results.columns.rows`), or those of a report that
was made from it (:mod:`cembench.results.report_records`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp, log
from statistics import median
from typing import Any

from cembench.results.comparison import Comparison, of_logarithms, verdict_of
from cembench.results.intervals import ERROR, share
from cembench.results.rank_tests import shift_interval, unpaired_p

Row = Mapping[str, Any]
#: Digits of a hash that are enough to know a surface by; kept reports have no more.
HASH_DIGITS = 16
#: Verdicts that two runs may contradict each other in.
_DECIDED = {"faster", "slower"}


@dataclass(frozen=True)
class Change:
    """One cell in two runs; the comparison is of the second run relative to the first."""

    before: Row
    after: Row
    comparison: Comparison
    #: Kernel seconds in the second run over those in the first, used to correct the comparison;
    #: None if one of the runs has none.
    drift: float | None = None

    @property
    def verdicts(self) -> tuple[str, str] | None:
        """What each run says of the cell against its reference; None if one says nothing."""
        said = tuple(row.get("verdict") for row in (self.before, self.after))
        known = all(said) and self.before.get("reference") == self.after.get("reference")
        return (str(said[0]), str(said[1])) if known else None

    @property
    def flipped(self) -> bool:
        """Whether one run calls the cell faster than the reference and the other one slower."""
        return self.verdicts is not None and set(self.verdicts) == _DECIDED


def compare_runs(before: Sequence[Row], after: Sequence[Row]) -> list[Change]:
    """Compare the cells with the same algorithm, parameters, surface and circumstances.

    The code may differ; that is the purpose of the comparison.
    """
    return [
        _change(old, row)
        for old, row in common_cells(before, after)
        if old["seconds_raw"] and row["seconds_raw"]
    ]


def common_cells(before: Sequence[Row], after: Sequence[Row]) -> list[tuple[Row, Row]]:
    """Return the cells of both runs, timed or not."""
    earlier = {_same(row): row for row in before}
    return [(earlier[_same(row)], row) for row in after if _same(row) in earlier]


def _change(before: Row, after: Row) -> Change:
    old, new = len(before["seconds_raw"]), len(after["seconds_raw"])
    drift = _drift(before, after)
    ours, theirs = (_logs(row, corrected=drift is not None) for row in (after, before))
    ratio = exp(median(ours) - median(theirs))
    part = min(_share(row) for row in (before, after))
    shift = shift_interval(ours, theirs, ERROR * part)
    interval = shift and of_logarithms(shift, ratio)
    p = 1.0 if interval is None else min(1.0, unpaired_p(ours, theirs) / part)
    found = Comparison(ratio, interval, verdict_of(interval), min(new, old), p)
    return Change(before, after, found, drift)


def _share(row: Row) -> float:
    """Return the part of the 5 % error for one look: all if the rounds were fixed in advance."""
    return 1.0 if row.get("precision") is None else share(len(row["seconds_raw"]))


def _kernel(row: Row) -> list[float] | None:
    """Return the kernel's seconds of each round; None if a round has none."""
    kernel = row.get("seconds_kernel") or []
    return kernel if all(kernel) and len(kernel) == len(row["seconds_raw"]) else None


def _logs(row: Row, *, corrected: bool) -> list[float]:
    """Return the logarithms of the seconds, divided by the kernel's if `corrected`."""
    kernel = (_kernel(row) if corrected else None) or [1.0] * len(row["seconds_raw"])
    return [log(seconds / one) for seconds, one in zip(row["seconds_raw"], kernel, strict=True)]


def _drift(before: Row, after: Row) -> float | None:
    """Return the ratio of the kernel's seconds, after over before; None if a round has none."""
    old, new = _kernel(before), _kernel(after)
    if old is None or new is None:
        return None
    return exp(median(map(log, new)) - median(map(log, old)))


def _same(row: Row) -> str:
    where = f"{row['mesh_hash'][:HASH_DIGITS]} {row['solves']} {row['backend']} {row['threads']}"
    return f"{row['algorithm']} {sorted(row['parameters'].items())} {where}"
