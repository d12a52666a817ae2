"""Which of two algorithms is faster, by how much, and how sure is that?

Compared are ratios of times taken in one round, each in a fresh process, in random order: what
slows the machine for a while slows both. Had both the same cost, either would be the slower one of
a round by the same amount with the same chance, so the logarithm of the ratio scatters evenly about
0, and the signed-rank interval (:mod:`cembench.results.signed_rank`) is exact under any noise:
"faster" is said wrongly in at most 5 % of all comparisons, also where the rounds went on until the
interval was narrow (:mod:`cembench.results.looks`). Of many comparisons in one table see
:mod:`cembench.results.many`; of two runs :mod:`cembench.results.runs_compared`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import exp, log
from statistics import median
from typing import Literal

from cembench.results.intervals import ERROR, Interval
from cembench.results.looks import USUAL_PRECISION, share_of
from cembench.results.records import Cell, Record, Round
from cembench.results.signed_rank import centre_interval
from cembench.results.student import paired_p

#: "undecided": the interval holds 1. "too few rounds": there is none. "not side by side": no round
#: of one sitting measured both.
Verdict = Literal["faster", "slower", "undecided", "too few rounds", "not side by side"]

#: A cell whose interval is wider than this share of its figure gets a warning: what reaches the
#: usual precision to either side is not.
UNSTABLE_WIDTH = 2 * USUAL_PRECISION


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
    #: The probability of a difference as clear as this by chance (:mod:`cembench.results.student`),
    #: looking paid for: what many comparisons are corrected by. 1 without an interval.
    p: float = 1.0

    @property
    def speedup(self) -> float:
        """Eq. 33: 0 for equal times, 1 where the reference takes half the time."""
        return self.ratio - 1

    @property
    def speedup_interval(self) -> Interval | None:
        """The interval of :attr:`speedup`."""
        i = self.interval
        return None if i is None else Interval(i.low - 1, i.high - 1)


def ratio_interval(ratios: Sequence[float], share: float = 1.0) -> Interval | None:
    """Return where the centre of positive figures lies, on their logarithms, with their median.

    `share` is the part of the 5 % that this interval may miss; None where there are too few.
    """
    found = centre_interval([log(ratio) for ratio in ratios], ERROR * share)
    if found is None:
        return None
    middle = _middle(ratios)
    return Interval(min(exp(found.low), middle), max(exp(found.high), middle))


def seconds_interval(record: Record) -> Interval | None:
    """Where does the centre of the cell's rounds lie, with 95 %? None below six rounds."""
    return interval_of_rounds(record.cell, record.outcome.rounds)


def interval_of_rounds(cell: Cell, rounds: Sequence[Round]) -> Interval | None:
    """Return the interval of a cell's own seconds after these rounds."""
    return ratio_interval([r.seconds for r in rounds], share_of(len(rounds), cell))


def is_unstable(record: Record) -> bool:
    """Is the interval of the cell's figure wider than :data:`UNSTABLE_WIDTH` of it?"""
    interval, figure = seconds_interval(record), record.outcome.median_seconds
    return bool(interval and figure and interval.high - interval.low > UNSTABLE_WIDTH * figure)


def paired_ratios(record: Record, reference: Record) -> list[float]:
    """The ratio of both times in each round that measured both in one sitting.

    Of an external program that is its solve time: what its process costs besides stands beside it,
    and is never compared with seconds of a call. None where a round has no such time.
    """
    return ratios_of_rounds(record.outcome.rounds, reference.outcome.rounds)


def ratios_of_rounds(ours: Sequence[Round], theirs: Sequence[Round]) -> list[float]:
    """As :func:`paired_ratios`, of rounds that are not in a record yet."""
    times = [(a.solve_seconds, b.solve_seconds) for a, b in _pairs(ours, theirs)]
    ratios = [a / b for a, b in times if a is not None and b is not None]
    return ratios if len(ratios) == len(times) else []


def _pairs(ours: Sequence[Round], theirs: Sequence[Round]) -> list[tuple[Round, Round]]:
    return [(a, b) for a, b in zip(ours, theirs, strict=False) if a.sitting == b.sitting]


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
    return compare_ratios(ratios, share_of(len(ratios), record.cell, reference.cell))


def compare_cpu(record: Record, reference: Record) -> Comparison | None:
    """As :func:`compare`, of the CPU seconds; None where a round of one has none, or shows none.

    The CPU's time of an external program is not only of its solving, so it is not compared.
    """
    if record.is_program or reference.is_program:
        return None
    pairs = _pairs(record.outcome.rounds, reference.outcome.rounds)
    times = [(a.cpu_seconds, b.cpu_seconds) for a, b in pairs]
    ratios = [a / b for a, b in times if a and b and a > 0 and b > 0]
    if not ratios or len(ratios) < len(times):
        return None
    return compare_ratios(ratios, share_of(len(ratios), record.cell, reference.cell))


def compare_ratios(ratios: Sequence[float], share: float = 1.0) -> Comparison:
    """What do the ratios of paired rounds say? `share` as in :func:`ratio_interval`.

    The median is taken of logarithms: swapping the two algorithms inverts it.
    """
    interval = ratio_interval(ratios, share)
    p = 1.0 if interval is None else min(1.0, paired_p([log(r) for r in ratios]) / share)
    return Comparison(_middle(ratios), interval, verdict_of(interval), len(ratios), p)


def _middle(ratios: Sequence[float]) -> float:
    return exp(median(map(log, ratios)))


def verdict_of(interval: Interval | None) -> Verdict:
    """What does the interval of a ratio say of the numerator?"""
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
