"""When a figure's precision is checked, and how the error is shared among these looks.

Measuring until an interval is narrow means looking at it several times, and each look can mislead.
So the 5 % error is divided: the interval after the k-th look misses with at most its share of the
5 %, and all of them together with at most 5 %, whatever the reason to stop was (Bonferroni's
inequality; it also holds if one cell's stop depends on other cells). Looks grow by a factor of 1.4:
later ones cost little, and none overshoots by much.
"""

from __future__ import annotations

from bisect import bisect_left
from typing import TYPE_CHECKING

from cembench.results.intervals import ERROR

if TYPE_CHECKING:
    from cembench.results.records import Cell

#: Numbers of rounds after which the precision is checked.
LOOKS = (7, 10, 14, 20, 28, 40, 56, 80)
#: Share of the 5 % for the first look: the least with which seven rounds can exclude anything,
#: 2 / 2^7. The other looks share the rest.
_FIRST = 2 / 2 ** LOOKS[0] / ERROR
_LATER = (1 - _FIRST) / (len(LOOKS) - 1)

#: Default precision: largest half-width of an interval, relative to its figure.
USUAL_PRECISION = 0.05
#: Default maximum number of rounds of a cell.
USUAL_MOST_ROUNDS = 56


def share(rounds: int) -> float:
    """Return the part of the 5 % for an interval of this many rounds, that of the next look."""
    return _FIRST if rounds <= LOOKS[0] else _LATER


def share_of(rounds: int, *cells: Cell) -> float:
    """As :func:`share`, but the whole 5 % if the number of rounds was fixed in advance."""
    return share(rounds) if any(cell.precision is not None for cell in cells) else 1.0


def next_look(rounds: int, most: int) -> int:
    """Return the number of rounds at the next look, at most `most`."""
    place = bisect_left(LOOKS, rounds + 1)
    return min(LOOKS[place], most) if place < len(LOOKS) else most


def is_look(rounds: int, most: int) -> bool:
    """Whether the precision is checked after this many rounds."""
    return rounds in LOOKS or rounds == most
