"""How many times of a run are unstable, and why, in a sentence."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import combinations
from math import log
from statistics import median, stdev

from cembench.results.comparison import (
    UNSTABLE_WIDTH,
    both_ratios,
    circumstances,
    compare,
    is_unstable,
    seconds_interval,
)
from cembench.results.records import Ended, Record

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
        return f"No time has an interval, with too few rounds for one: {_why(without)}."
    told = (
        f"{len(unstable) or 'None'} of {len(timed)} {'time' if len(timed) == 1 else 'times'} "
        f"{'is' if len(unstable) < 2 else 'are'} unstable (95 % interval wider than "
        f"{UNSTABLE_WIDTH:.0%} of the figure)"
    )
    if unstable:
        told += f": {_why(unstable)}"
        busy = sum(_is_beside_work(r) for r in unstable)
        told += f"; {busy} of them measured beside other work" if busy else ""
    if without:
        has = "has" if len(without) == 1 else "have"
        told += f". {len(without)} {has} too few rounds for an interval: {_why(without)}"
    return f"{told}."


def scatter_words(records: Sequence[Record]) -> str:
    """Return how far ratios scatter from round to round, and how many are unstable.

    Empty without comparisons of at least two rounds. Every two cells that share their circumstances
    are compared; the figures are medians over these.
    """
    separate, within, widths = [], [], []
    for ours, theirs in _compared(records):
        apart, together = both_ratios(ours.outcome.rounds, theirs.outcome.rounds)
        found = compare(ours, theirs)
        if len(apart) < 2 or found is None:
            continue
        separate.append(_scatter(apart))
        within += [_scatter(together)] if together else []
        if found.interval is not None:
            widths.append((found.interval.high - found.interval.low) / found.ratio)
    if not separate:
        return ""
    told = f"Ratios of two algorithms scatter by {median(separate):.1%} from round to round"
    if within:
        told += f" between processes and by {median(within):.1%} within one process"
    told += f" (medians over {len(separate)} pairs)"
    if widths:
        unstable = sum(width > UNSTABLE_WIDTH for width in widths)
        told += f"; {unstable} of {len(widths)} have an interval wider than {UNSTABLE_WIDTH:.0%}"
    return f"{told}."


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
    busy = sum(bool(r.neighbours and r.neighbours.busy) for r in rounds)
    return busy >= _BUSY_SHARE * len(rounds)
