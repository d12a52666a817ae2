"""Which of two algorithms is faster, by how much, and how sure is that?

Compared are ratios of times taken in one round, each in a fresh process, in random order: what
slows the machine for a while slows both. Had both the same cost, either would be the faster one of
a round with probability 1/2, so the interval of the median ratio
(:mod:`cembench.results.intervals`) is exact under any noise, and "faster" is said wrongly in at
most 5 % of all comparisons.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import exp, log
from statistics import median
from typing import Literal

from cembench.results.intervals import Interval, median_interval
from cembench.results.records import Cell, Record

#: "undecided": the interval holds 1. "too few rounds": there is none. "not side by side": no round
#: of one sitting measured both.
Verdict = Literal["faster", "slower", "undecided", "too few rounds", "not side by side"]

#: A cell whose interval is wider than this share of its median gets a warning.
UNSTABLE_WIDTH = 0.2


@dataclass(frozen=True)
class Comparison:
    """Seconds of one record over those of a reference.

    `speedup` is Eq. 33 of the paper, t / t_reference - 1: how much faster the reference is.
    `verdict` is said of the record, not of the reference.
    """

    ratio: float
    interval: Interval | None
    verdict: Verdict
    rounds: int

    @property
    def speedup(self) -> float:
        """Eq. 33: 0 for equal times, 1 where the reference takes half the time."""
        return self.ratio - 1

    @property
    def speedup_interval(self) -> Interval | None:
        """The interval of :attr:`speedup`."""
        i = self.interval
        return None if i is None else Interval(i.low - 1, i.high - 1)


def seconds_interval(record: Record) -> Interval | None:
    """Where does the median of the cell's rounds lie, with 95 %? None below six rounds."""
    return median_interval(record.outcome.seconds)


def is_unstable(record: Record) -> bool:
    """Is the interval of the cell's figure wider than :data:`UNSTABLE_WIDTH` of it?"""
    interval, figure = seconds_interval(record), record.outcome.median_seconds
    return bool(interval and figure and interval.high - interval.low > UNSTABLE_WIDTH * figure)


def paired_ratios(record: Record, reference: Record) -> list[float]:
    """The ratio of both times in each round that measured both in one sitting.

    Of an external program that is its solve time: what its process costs besides stands beside it,
    and is never compared with seconds of a call. None where a round has no such time.
    """
    pairs = zip(record.outcome.rounds, reference.outcome.rounds, strict=False)
    times = [(a.solve_seconds, b.solve_seconds) for a, b in pairs if a.sitting == b.sitting]
    ratios = [a / b for a, b in times if a is not None and b is not None]
    return ratios if len(ratios) == len(times) else []


def compare(record: Record, reference: Record) -> Comparison | None:
    """Is the record's algorithm faster than the reference's, on the same surface in the same run?

    None where one of them has no times, or an external program no solve time.
    """
    ours, theirs = record.outcome.solve_seconds, reference.outcome.solve_seconds
    if ours is None or theirs is None:
        return None
    ratios = paired_ratios(record, reference)
    if not ratios:
        return Comparison(ours / theirs, None, "not side by side", 0)
    return compare_ratios(ratios)


def compare_ratios(ratios: Sequence[float]) -> Comparison:
    """What do the ratios of paired rounds say?

    The median is taken of logarithms: swapping the two algorithms inverts it.
    """
    interval = median_interval(ratios)
    ratio = exp(median(map(log, ratios)))
    return Comparison(ratio, interval, _verdict(interval), len(ratios))


def _verdict(interval: Interval | None) -> Verdict:
    if interval is None:
        return "too few rounds"
    if 1 in interval:
        return "undecided"
    return "slower" if interval.low > 1 else "faster"


def references(records: Iterable[Record], algorithm: str) -> dict[str, Record]:
    """The records of the algorithm that others are compared with, by :func:`circumstances`."""
    return {circumstances(r.cell): r for r in records if r.cell.algorithm == algorithm}


def circumstances(cell: Cell) -> str:
    """What two cells must share for their times to be comparable."""
    return f"{cell.mesh_hash} {cell.solves} {cell.backend} {cell.threads}"


@dataclass(frozen=True)
class Change:
    """One cell in two runs; the comparison says what the second is, measured against the first."""

    before: Record
    after: Record
    comparison: Comparison


def compare_runs(before: Sequence[Record], after: Sequence[Record]) -> list[Change]:
    """What became faster or slower from one run to another?

    Paired are cells of the same algorithm and parameters, surface and circumstances; the code may
    differ, that is what is asked about. Rounds of two runs are no pairs: the interval is the
    widest ratio that the intervals of both medians allow, and a drift of the machine from the one
    run to the other is not in it.
    """
    earlier = {_same(record): record for record in before}
    changes = []
    for record in after:
        old = earlier.get(_same(record))
        if old is None:
            continue
        ours, theirs = record.outcome.median_seconds, old.outcome.median_seconds
        if ours is not None and theirs is not None:
            changes.append(Change(old, record, _unpaired(record, old, ours / theirs)))
    return changes


def _unpaired(record: Record, reference: Record, ratio: float) -> Comparison:
    ours, theirs = seconds_interval(record), seconds_interval(reference)
    rounds = min(len(record.outcome.rounds), len(reference.outcome.rounds))
    interval = None
    if ours is not None and theirs is not None:
        interval = Interval(ours.low / theirs.high, ours.high / theirs.low)
    return Comparison(ratio, interval, _verdict(interval), rounds)


def _same(record: Record) -> str:
    cell = record.cell
    return f"{cell.algorithm} {sorted(cell.parameters.items())} {circumstances(cell)}"


def machine_differences(before: dict[str, object], after: dict[str, object]) -> list[str]:
    """Which facts of two environments differ that make their seconds incomparable?"""
    return [
        f"{name}: {before.get(name)} / {after.get(name)}"
        for name in ("cpu", "cores", "memory_bytes", "platform", "python", "libraries", "blas")
        if before.get(name) != after.get(name)
    ]
