"""Compare the seconds of two runs cell by cell.

Rounds of two runs are not paired, and the machine may have drifted between them. So every round
also times a reference kernel that never changes (:mod:`cembench.running.reference_kernel`).
The seconds of a cell are divided by the kernel's in the same round, and compared by the rank-sum
test at the 5 % level. If a run has no kernel times, plain seconds are compared; the interval then
ignores drift.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, log
from statistics import median

from cembench.results.comparison import Comparison, circumstances, verdict_of
from cembench.results.intervals import ERROR, Interval, share_of
from cembench.results.rank_tests import shift_interval, unpaired_p
from cembench.results.records import Record, Round


@dataclass(frozen=True)
class Change:
    """One cell in two runs; the comparison is of the second run relative to the first."""

    before: Record
    after: Record
    comparison: Comparison
    #: Kernel seconds in the second run over those in the first, used to correct the comparison;
    #: None if one of the runs has none.
    drift: float | None = None


def compare_runs(before: Sequence[Record], after: Sequence[Record]) -> list[Change]:
    """Compare the cells with the same algorithm, parameters, surface and circumstances.

    The code may differ; that is the purpose of the comparison.
    """
    earlier = {_same(record): record for record in before}
    pairs = [(earlier.get(_same(record)), record) for record in after]
    return [
        _change(old, record)
        for old, record in pairs
        if old is not None and old.outcome.rounds and record.outcome.rounds
    ]


def _change(before: Record, after: Record) -> Change:
    old, new = before.outcome.rounds, after.outcome.rounds
    drift = _drift(old, new)
    ours, theirs = (_logs(rounds, corrected=drift is not None) for rounds in (new, old))
    ratio = exp(median(ours) - median(theirs))
    share = min(share_of(len(new), after.cell), share_of(len(old), before.cell))
    shift = shift_interval(ours, theirs, ERROR * share)
    interval = (
        None if shift is None else Interval(min(exp(shift.low), ratio), max(exp(shift.high), ratio))
    )
    p = 1.0 if interval is None else min(1.0, unpaired_p(ours, theirs) / share)
    rounds = min(len(new), len(old))
    return Change(
        before, after, Comparison(ratio, interval, verdict_of(interval), rounds, p), drift
    )


def _logs(rounds: Sequence[Round], *, corrected: bool) -> list[float]:
    """Return the logarithms of the seconds, divided by the kernel's if `corrected`."""
    return [log(r.seconds) - (log(r.kernel_seconds or 1.0) if corrected else 0.0) for r in rounds]


def _drift(before: Sequence[Round], after: Sequence[Round]) -> float | None:
    """Return the ratio of the kernel's seconds, after over before; None if a round has none."""
    old, new = (
        [r.kernel_seconds for r in rounds if r.kernel_seconds] for rounds in (before, after)
    )
    if len(old) < len(before) or len(new) < len(after):
        return None
    return exp(median(map(log, new)) - median(map(log, old)))


def _same(record: Record) -> str:
    cell = record.cell
    return f"{cell.algorithm} {sorted(cell.parameters.items())} {circumstances(cell)}"
