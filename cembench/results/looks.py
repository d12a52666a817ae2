"""When is looked whether a figure is precise enough, and what does looking cost?

Who measures until an interval is narrow looks at it several times, and has as often the chance of
being misled. So the 5 % are spent in shares: an interval that is formed after the k-th look misses
with at most its share of 5 %, and all of them together with at most 5 %, whatever the reason was to
stop (Bonferroni's inequality; so it also holds where one cell's stop depends on other cells).
Looks grow by 1.4: later ones cost little, and none overshoots by much.
"""

from __future__ import annotations

from bisect import bisect_left

from cembench.results.intervals import ERROR
from cembench.results.records import Cell

#: Rounds after which is looked.
LOOKS = (7, 10, 14, 20, 28, 40, 56, 80)
#: Of the 5 %, what the first look may take: just as much as it takes to exclude anything after
#: seven rounds, 2 / 2^7. The others share the rest.
_FIRST = 2 / 2 ** LOOKS[0] / ERROR
_LATER = (1 - _FIRST) / (len(LOOKS) - 1)

#: How far an interval may reach to either side of its figure, relative to it, by default.
USUAL_PRECISION = 0.05
#: Rounds that a cell is measured in at most, by default.
USUAL_MOST_ROUNDS = 56


def share(rounds: int) -> float:
    """Which part of the 5 % belongs to an interval of so many rounds? That of the next look."""
    return _FIRST if rounds <= LOOKS[0] else _LATER


def share_of(rounds: int, *cells: Cell) -> float:
    """As :func:`share`, but all of it where the number of rounds was fixed before."""
    return share(rounds) if any(cell.precision is not None for cell in cells) else 1.0


def next_look(rounds: int, most: int) -> int:
    """After how many rounds is looked next, having so many, where there are at most `most`?"""
    place = bisect_left(LOOKS, rounds + 1)
    return min(LOOKS[place], most) if place < len(LOOKS) else most


def is_look(rounds: int, most: int) -> bool:
    """Is looked after so many rounds?"""
    return rounds in LOOKS or rounds == most
