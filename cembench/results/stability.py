"""What is to be said of a run as a whole: maps that stand out, and times that are unstable."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, groupby
from math import log
from statistics import median, stdev

from cembench.results.comparison import (
    UNSTABLE_WIDTH,
    WIDE_RATIO,
    both_ratios,
    circumstances,
    compare,
    is_unstable,
    seconds_interval,
)
from cembench.results.records import Ended, Record

#: A map is an outlier if its mean angle error is over this many times the others' median ...
TIMES = 3.0
#: ... and at least this many degrees: below, ratios are of rounding.
DEGREES = 0.1
#: The fewest other algorithms whose median says what a surface allows.
FEWEST = 2
#: Maximum numbers of algorithms, and of further surfaces of each, that are listed.
LISTED, NAMED = 5, 6


@dataclass(frozen=True)
class Outlier:
    """A map whose mean angle error is over three times the median of the other algorithms'."""

    record: Record
    angle: float
    median: float

    @property
    def times(self) -> float:
        """The mean angle error over the others' median; infinite for a median of 0."""
        return self.angle / self.median if self.median else float("inf")

    @property
    def words(self) -> str:
        """The map and both figures."""
        return (
            f"{self.record.title} on {self.record.cell.mesh}: {self.angle:.3g} degrees, "
            f"the other algorithms' median is {self.median:.3g}"
        )


def outliers(records: Iterable[Record]) -> list[Outlier]:
    """Return the disk maps over three times worse than the others' median, the worst first.

    What counts is the mean angle error, whatever the status of the cell. An algorithm measured
    several times on a surface (policies, parameters) is one of the others by its median, and is
    named by its worst map.
    """
    by_surface: dict[str, dict[str, list[tuple[float, Record]]]] = {}
    for record in records:
        angle = record.outcome.metrics.get("angle_error_mean_deg")
        if record.target == "disk" and angle is not None:
            of_surface = by_surface.setdefault(record.cell.mesh_hash, {})
            of_surface.setdefault(record.cell.algorithm, []).append((float(angle), record))
    suspects = []
    for of_surface in by_surface.values():
        usual = {name: median(angle for angle, _ in maps) for name, maps in of_surface.items()}
        for name, maps in of_surface.items():
            others = [angle for other, angle in usual.items() if other != name]
            worst, record = max(maps, key=lambda one: one[0])
            if len(others) >= FEWEST and worst >= DEGREES and worst > TIMES * median(others):
                suspects.append(Outlier(record, worst, median(others)))
    return sorted(suspects, key=lambda one: -one.times)


def outlier_lines(records: Iterable[Record]) -> list[str]:
    """Return a line for each algorithm with :func:`outliers`, with its worst map and the others.

    Algorithms that do not promise conformal maps come last, and say so. Those beyond
    :data:`LISTED` are counted.
    """
    suspects = sorted(outliers(records), key=lambda one: one.record.cell.algorithm)
    grouped = [list(g) for _, g in groupby(suspects, key=lambda one: one.record.cell.algorithm)]
    ordered = sorted(grouped, key=lambda maps: (not _is_conformal(maps[0]), -maps[0].times))
    left = sum(map(len, ordered[LISTED:]))
    more = [f"and {left} more maps by other algorithms"] * bool(left)
    return [*map(_line, ordered[:LISTED]), *more]


def _line(maps: Sequence[Outlier]) -> str:
    """Return the line of an algorithm: its worst map, and the surfaces of the others."""
    first, *rest = maps
    named = ", ".join(
        f"{one.record.cell.mesh} ({one.angle:.3g}, median {one.median:.3g})" for one in rest[:NAMED]
    )
    more = f" and {len(rest) - NAMED} more" if len(rest) > NAMED else ""
    also = f"; also on {named}{more}" if rest else ""
    design = "" if _is_conformal(first) else " (its maps are not conformal by design)"
    return first.words + also + design


def _is_conformal(found: Outlier) -> bool:
    """Whether the algorithm promises conformal maps; those of plug-ins are taken to."""
    from cembench.registry import load_registry

    known = load_registry().algorithms.get(found.record.cell.algorithm)
    return known is None or known.conformal


_ENDED: dict[Ended | None, str] = {
    "budget": "the time was used up",
    "rounds": "the maximum number of rounds was reached",
    "precise": "a precision that allows it was asked for",
    None: "their number of rounds was fixed",
}
#: A cell was measured beside other work if the machine was busy in this share of its rounds.
_BUSY_SHARE = 0.25


def stability_words(records: Sequence[Record]) -> str:
    """Return how many times are unstable or have no interval, with what ended their cells.

    Empty if nothing was timed. A time is unstable if its 95 % interval is wider than
    :data:`~cembench.results.comparison.UNSTABLE_WIDTH` times the figure.
    """
    timed = [r for r in records if r.outcome.rounds]
    if not timed:
        return ""
    unstable = [r for r in timed if is_unstable(r)]
    without = [r for r in timed if seconds_interval(r) is None]
    if len(without) == len(timed):
        most = max(len(r.outcome.rounds) for r in timed)
        times = "once" if most == 1 else f"at most {most} times"
        return f"Each cell was timed {times}, so no intervals are given: {_why(without)}."
    if len(unstable) + len(without) == len(timed):
        sentence = (
            f"No time is stable ({len(unstable)} of {len(timed)} have a 95 % interval wider than "
            f"{UNSTABLE_WIDTH:.0%} of the figure)"
        )
    else:
        sentence = (
            f"{len(unstable) or 'None'} of {len(timed)} {'time' if len(timed) == 1 else 'times'} "
            f"{'is' if len(unstable) < 2 else 'are'} unstable (95 % interval wider than "
            f"{UNSTABLE_WIDTH:.0%} of the figure)"
        )
    if unstable:
        sentence += f": {_why(unstable)}"
        busy = sum(_is_beside_work(r) for r in unstable)
        sentence += f"; {busy} of them measured beside other work" if busy else ""
    if without:
        has = "has" if len(without) == 1 else "have"
        sentence += f". {len(without)} {has} too few rounds for an interval: {_why(without)}"
    return f"{sentence}."


def scatter_words(records: Sequence[Record]) -> str:
    """Return how far ratios scatter from round to round, and how many are unstable.

    Empty without comparisons of at least two rounds. Every two cells that share their circumstances
    are compared; the figures are medians over these.
    """
    separate, within, widths = [], [], []
    for ours, theirs in _compared(records):
        apart, together = both_ratios(ours.outcome.rounds, theirs.outcome.rounds)
        comparison = compare(ours, theirs)
        if len(apart) < 2 or comparison is None:
            continue
        separate.append(_scatter(apart))
        within += [_scatter(together)] if together else []
        if comparison.interval is not None:
            widths.append((comparison.interval.high - comparison.interval.low) / comparison.ratio)
    if not separate:
        return ""
    sentence = f"Ratios of two algorithms scatter by {median(separate):.1%} from round to round"
    if within:
        sentence += f" between processes and by {median(within):.1%} within one process"
    sentence += f" (medians over {len(separate)} pairs)"
    if widths:
        wide = sum(width > WIDE_RATIO for width in widths)
        sentence += f"; {wide} of {len(widths)} have an interval wider than {WIDE_RATIO:.0%}"
    return f"{sentence}."


def _compared(records: Sequence[Record]) -> Iterator[tuple[Record, Record]]:
    """Return the pairs of timed cells that are comparable."""
    groups: dict[str, list[Record]] = {}
    for record in records:
        if len(record.outcome.rounds) > 1:
            groups.setdefault(circumstances(record.cell), []).append(record)
    for group in groups.values():
        yield from combinations(group, 2)


def _scatter(ratios: Sequence[float]) -> float:
    return stdev(map(log, ratios))


def _why(records: Sequence[Record]) -> str:
    counts = Counter(_reason(r) for r in records)
    if len(counts) == 1:
        return next(iter(counts))
    return ", ".join(f"{count} as {reason}" for reason, count in counts.most_common())


def _reason(record: Record) -> str:
    if record.outcome.ended == "precise" and all(r.together for r in record.outcome.rounds):
        return "only ratios, within shared processes, had to be precise"
    return _ENDED[record.outcome.ended]


def _is_beside_work(record: Record) -> bool:
    rounds = record.outcome.rounds
    return sum(r.busy for r in rounds) >= _BUSY_SHARE * len(rounds)
