"""Compare the speed of two algorithms, with an interval and a verdict.

The ratios compared are of times from the same round, each in a fresh process, in random order:
whatever slows the machine for a while slows both. If both had the same cost, either would be the
slower one of a round by the same amount with the same probability. The logarithm of the ratio is
then symmetric about 0, and the signed-rank interval (:mod:`cembench.results.rank_tests`) is exact
under any noise: "faster" is wrong in at most 5 % of all comparisons, even if rounds continued until
the interval was narrow (:mod:`cembench.results.intervals`). Where the algorithms of a
round shared a process too (:mod:`cembench.running.pairing`), the ratios within it decide, unless
those between separate processes show that one algorithm disturbed the other; then a verdict must
hold for both,
so it is wrong no more often. For many comparisons in one table see
:mod:`cembench.results.multiple_testing`; for two runs :mod:`cembench.results.runs_compared`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import exp, log
from statistics import median
from typing import Any, Literal

from cembench.results.intervals import ERROR, USUAL_PRECISION, Interval, share_of
from cembench.results.rank_tests import centre_interval, paired_p
from cembench.results.records import Cell, Record, Round

#: "undecided": the interval contains 1. "too few rounds": there is no interval. "not side by side":
#: no round of one sitting measured both.
Verdict = Literal["faster", "slower", "undecided", "too few rounds", "not side by side"]

#: What a table of speedups says of the limits of what is detected.
NOT_DETECTED = (
    "Results kept by accident are detected or of no use. A solver written to deceive is not "
    "detected: it can recognise a surface by what no motion changes, such as its edge lengths "
    "(docs/cheating.md)."
)

#: Seconds whose interval is wider than this share of them get a warning.
UNSTABLE_WIDTH = 0.25
#: A ratio of seconds is wide if its interval is wider than this share of it; one that reaches the
#: default precision is not.
WIDE_RATIO = 2 * USUAL_PRECISION


@dataclass(frozen=True)
class Comparison:
    """Ratio of a record's seconds to those of a reference.

    `speedup` is t / t_reference - 1: how much faster the reference is.
    `verdict` is about the record, not the reference.
    """

    ratio: float
    interval: Interval | None
    verdict: Verdict
    rounds: int
    #: p-value of the difference (:mod:`cembench.results.rank_tests`), corrected for the looks
    #: taken; corrections for many comparisons use it. 1 without an interval.
    p: float = 1.0
    #: Whether the ratios are those within shared processes.
    together: bool = False
    #: Ratio within shared processes over that between separate ones, where both were measured: an
    #: interval that excludes 1 shows that the algorithms disturb each other.
    disturbance: Interval | None = None

    @property
    def speedup(self) -> float:
        """Rate of speedup: 0 for equal times, 1 if the reference takes half the time."""
        return self.ratio - 1

    @property
    def speedup_interval(self) -> Interval | None:
        """The interval of :attr:`speedup`."""
        i = self.interval
        return None if i is None else Interval(i.low - 1, i.high - 1)


def speedup_columns(found: Comparison | None) -> dict[str, Any]:
    """Return the columns of a comparison by its speedup; all are None without one."""
    interval = found and found.speedup_interval
    return {
        "speedup": found and found.speedup,
        "speedup_low": interval and interval.low,
        "speedup_high": interval and interval.high,
        "verdict": found and found.verdict,
    }


def ratio_interval(ratios: Sequence[float], share: float = 1.0) -> Interval | None:
    """Return the interval of the centre of positive figures, computed on their logarithms.

    `share` is the part of the 5 % error that this interval may use; None for too few figures.
    """
    interval = centre_interval([log(ratio) for ratio in ratios], ERROR * share)
    return interval and of_logarithms(interval, middle_ratio(ratios))


def of_logarithms(interval: Interval, middle: float) -> Interval:
    """Return the interval of a ratio from that of its logarithm; it holds the ratio itself."""
    return Interval(min(exp(interval.low), middle), max(exp(interval.high), middle))


def seconds_interval(record: Record) -> Interval | None:
    """Return the 95 % interval of a cell's seconds; None below six rounds."""
    return interval_of_rounds(record.cell, record.outcome.rounds)


def interval_of_rounds(cell: Cell, rounds: Sequence[Round]) -> Interval | None:
    """Return the interval of a cell's own seconds after these rounds."""
    return ratio_interval([r.seconds for r in rounds], share_of(len(rounds), cell))


def is_unstable(record: Record) -> bool:
    """Whether the interval is wider than :data:`UNSTABLE_WIDTH` times the cell's figure."""
    interval, figure = seconds_interval(record), record.outcome.median_seconds
    return bool(interval and figure and interval.high - interval.low > UNSTABLE_WIDTH * figure)


def paired_ratios(record: Record, reference: Record) -> list[float]:
    """Return the ratios that decide, one for each round that measured both in one sitting.

    See :func:`ratios_of_rounds`.
    """
    ours, theirs = record.outcome.rounds, reference.outcome.rounds
    share = share_of(len(_pairs(ours, theirs)), record.cell, reference.cell)
    return ratios_of_rounds(ours, theirs, share)


def measured_ratios(record: Record, reference: Record) -> list[float]:
    """Return :func:`paired_ratios` by our clock alone, whatever solve time a program prints."""
    pairs = _pairs(record.outcome.rounds, reference.outcome.rounds)
    if record.is_program or reference.is_program:
        return _ratios([(a.measured_seconds, b.measured_seconds) for a, b in pairs])
    return paired_ratios(record, reference)


def ratios_of_rounds(
    ours: Sequence[Round], theirs: Sequence[Round], share: float = 1.0
) -> list[float]:
    """Return the ratio of both times for each round that measured both in one sitting.

    These are the ratios within shared processes if every round has them and they agree with those
    between separate ones, which are the ratios otherwise. For an external program the solve time is
    used; the cost of its process is shown separately and never compared with the seconds of a call.
    Empty if a round has no such time.
    """
    separate, together = both_ratios(ours, theirs)
    return together if agree(disturbance(separate, together, share)) else separate


def both_ratios(ours: Sequence[Round], theirs: Sequence[Round]) -> tuple[list[float], list[float]]:
    """Return the ratios between separate processes, and those within shared ones, if any."""
    pairs = _pairs(ours, theirs)
    separate = _ratios([(a.solve_seconds, b.solve_seconds) for a, b in pairs])
    return separate, _ratios([(a.together_seconds, b.together_seconds) for a, b in pairs])


def disturbance(
    separate: Sequence[float], together: Sequence[float], share: float = 1.0
) -> Interval | None:
    """Return the interval of the ratio within shared processes over that between separate ones."""
    if not together or len(together) != len(separate):
        return None
    return ratio_interval([a / b for a, b in zip(together, separate, strict=True)], share)


def agree(found: Interval | None) -> bool:
    """Whether the shared processes are known to show the same ratio as separate ones."""
    return found is not None and 1 in found


def _ratios(times: Sequence[tuple[float | None, float | None]]) -> list[float]:
    ratios = [a / b for a, b in times if a is not None and b is not None]
    return ratios if len(ratios) == len(times) else []


def _pairs(ours: Sequence[Round], theirs: Sequence[Round]) -> list[tuple[Round, Round]]:
    return [(a, b) for a, b in zip(ours, theirs, strict=False) if a.sitting == b.sitting]


def compare(record: Record, reference: Record) -> Comparison | None:
    """Compare a record with the reference on the same surface in the same run.

    None if one of them has no times, or an external program has no solve time. An algorithm is not
    called faster while its maps of one surface differ from process to process: what it keeps, and
    makes different by noise, cannot be told from its work.
    """
    found = _compared(record, reference)
    for verdict, faster in (("faster", record), ("slower", reference)):
        if found is not None and found.verdict == verdict and scatters(faster):
            return replace(found, verdict="undecided", p=1.0)
    return found


def scatters(record: Record) -> bool:
    """Whether fresh processes map a surface in different ways, whatever the position of the map."""
    return any(measured.differs for measured in record.outcome.rounds)


def _compared(record: Record, reference: Record) -> Comparison | None:
    ours, theirs = record.outcome.solve_seconds, reference.outcome.solve_seconds
    if ours is None or theirs is None:
        return None
    separate, together = both_ratios(record.outcome.rounds, reference.outcome.rounds)
    if not separate:
        return Comparison(ours / theirs, None, "not side by side", 0)
    share = share_of(len(separate), record.cell, reference.cell)
    disturbed = disturbance(separate, together, share)
    if agree(disturbed):
        return replace(compare_ratios(together, share), together=True, disturbance=disturbed)
    alone = compare_ratios(separate, share)
    if disturbed is not None:
        # The verdict must hold either way, and so it errs no more often than that of either.
        return replace(confirmed(alone, together, share), disturbance=disturbed)
    return confirmed(alone, measured_ratios(record, reference), share)


def confirmed(found: Comparison, measured: Sequence[float], share: float = 1.0) -> Comparison:
    """Return a comparison with its verdict only if other ratios of its rounds have the same one.

    They are those by our clock, which differ only for an external program that prints its solve
    time: its own word never decides a comparison alone.
    """
    ours = compare_ratios(measured, share) if measured else None
    if ours is not None and ours.verdict == found.verdict:
        return replace(found, p=max(found.p, ours.p))
    return replace(found, verdict="undecided", p=1.0) if found.p < 1 else found


def compare_cpu(record: Record, reference: Record) -> Comparison | None:
    """Like :func:`compare`, for CPU seconds; None if a round of either has none, or shows zero.

    CPU seconds of an external program include more than solving, so they are not compared.
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
    """Return the comparison from the ratios of paired rounds; `share` as in :func:`ratio_interval`.

    The median is taken over logarithms, so swapping the two algorithms inverts it.
    """
    interval = ratio_interval(ratios, share)
    p = 1.0 if interval is None else min(1.0, paired_p([log(r) for r in ratios]) / share)
    return Comparison(middle_ratio(ratios), interval, verdict_of(interval), len(ratios), p)


def middle_ratio(ratios: Sequence[float]) -> float:
    """Return the median of ratios, taken over their logarithms."""
    return exp(median(map(log, ratios)))


def verdict_of(interval: Interval | None) -> Verdict:
    """Return the verdict on the numerator from the interval of a ratio."""
    if interval is None:
        return "too few rounds"
    if 1 in interval:
        return "undecided"
    return "slower" if interval.low > 1 else "faster"


def references(records: Iterable[Record], algorithm: str) -> dict[str, list[Record]]:
    """Return the records of the reference algorithm, by :func:`circumstances`.

    Of several sets of parameters the one of most records counts, the first of two alike; there are
    several records with it if the code or the number of rounds was changed.
    """
    own = [record for record in records if record.cell.algorithm == algorithm]
    ranked = [how for how, _ in Counter(str(r.cell.parameters) for r in own).most_common()]
    own.sort(key=lambda record: ranked.index(str(record.cell.parameters)))
    chosen: dict[str, list[Record]] = {}
    for record in own:
        held = chosen.setdefault(circumstances(record.cell), [])
        if not held or held[0].cell.parameters == record.cell.parameters:
            held.append(record)
    return chosen


def reference_of(record: Record, known: Mapping[str, Sequence[Record]]) -> Record | None:
    """Return the one of the :func:`references` that was measured beside a record, or the latest."""

    def rank(base: Record) -> tuple[int, bool, str]:
        beside = len(_pairs(record.outcome.rounds, base.outcome.rounds))
        return beside, base.outcome.status == "ok", base.started_at

    return max(known.get(circumstances(record.cell), ()), key=rank, default=None)


def latest(records: Sequence[Record]) -> list[Record]:
    """Drop records that differ only in code or rounds; ok ones are preferred, then later ones."""
    best: dict[str, Record] = {}
    ranked = sorted(records, key=lambda r: (r.outcome.status == "ok", r.started_at), reverse=True)
    for record in ranked:
        cell = record.cell
        same = f"{cell.algorithm} {sorted(cell.parameters.items())} {circumstances(cell)}"
        best.setdefault(same, record)
    kept = {record.cell.key for record in best.values()}
    return [record for record in records if record.cell.key in kept]


def circumstances(cell: Cell) -> str:
    """Return a text that two cells share if their times are comparable."""
    return f"{cell.mesh_hash} {cell.solves} {cell.backend} {cell.threads}"
