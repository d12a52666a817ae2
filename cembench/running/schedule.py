"""Decide what a run measures next: the order of a round, and the cells that have enough rounds.

Everything here is a function of the cells' states. Before the first look, when no cell has an
interval, the cheapest cells come first: most cells get one. After it those with the widest
intervals do.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from statistics import median

from cembench.results.comparison import (
    circumstances,
    interval_of_rounds,
    ratio_interval,
    ratios_of_rounds,
)
from cembench.results.intervals import Interval, next_look, share_of
from cembench.results.records import Cell, Ended, Outcome, Record, Round, lower_median
from cembench.results.samples import Samples
from cembench.running.measure import ENOUGH_SECONDS, LONG_CALL
from cembench.running.options import Options
from cembench.running.plan import Task

#: Overhead of a round in seconds: starting a process, reading the mesh and judging the maps.
BESIDE_CALLS = 0.25
#: Share of the budget by which a plan may exceed it after the first round: prices scatter, and a
#: cell that is dropped is not resumed.
_TOLERATED = 0.1

Rounds = Sequence[Round]


@dataclass
class CellState:
    """What a run knows of a cell so far."""

    task: Task
    samples: Samples
    check: Outcome | None = None
    #: By number, from 0.
    rounds: dict[int, Round] = field(default_factory=dict)
    #: Seconds of its processes that were timed in this sitting.
    seconds: list[float] = field(default_factory=list)
    #: None: it needs more processes.
    record: Record | None = None

    @property
    def label(self) -> str:
        """The label of the cell."""
        return self.task.cell.label

    @property
    def passed(self) -> Outcome:
        """The outcome of the check, which has ended."""
        assert self.check is not None
        return self.check

    @property
    def is_timed(self) -> bool:
        """Whether its map is made here, and not read from a file."""
        return self.task.algorithm.maps is None

    def last_round(self, done: int, most_rounds: int) -> int:
        """Return the round after which the cell ends, or after which its interval is checked."""
        return self.task.cell.repeats or next_look(done, most_rounds)

    def processes_left(self, most_rounds: int) -> int:
        """Return the number of processes until it ends or its interval is checked."""
        if not self.is_timed:
            return int(self.check is None)
        done = len(self.rounds)
        return (self.check is None) + max(0, self.last_round(done, most_rounds) - done)

    def lacks_round(self, number: int, most_rounds: int) -> bool:
        """Whether the cell has to be timed in this round."""
        most = self.task.cell.repeats or most_rounds
        return self.record is None and number < most and number not in self.rounds

    @property
    def price(self) -> float:
        """The expected seconds of another round.

        Its first process in a sitting makes one call more than the others, and does not count.
        """
        later = self.seconds[1:]
        return median(later) if later else cost(list(self.rounds.values()))


def in_random_order(cells: Sequence[CellState], seed: int, number: int) -> list[CellState]:
    """Return the order of a round, which depends only on the seed and the round.

    The surfaces come in random order, and for each surface its cells: these are compared with each
    other, so little time should pass between them.
    """
    chance = random.Random(f"{seed} {number}")
    of_surface: dict[str, list[CellState]] = {}
    for state in cells:
        of_surface.setdefault(state.task.cell.mesh_hash, []).append(state)
    blocks = chance.sample(list(of_surface.values()), len(of_surface))
    return [state for block in blocks for state in chance.sample(block, len(block))]


def sharing_groups(cells: Sequence[CellState]) -> list[list[CellState]]:
    """Group the cells that are compared with each other, and so may share a process."""
    groups: dict[str, list[CellState]] = {}
    for state in cells:
        alone = state.task.algorithm.program is not None
        key = state.label if alone else circumstances(state.task.cell)
        groups.setdefault(key, []).append(state)
    return list(groups.values())


def scatter_probe(cells: Sequence[CellState], reference: str) -> CellState | None:
    """Return the cheapest cell whose calls show how a machine scatters; None if there is none.

    That is one of the reference on the smallest surface, where cells are measured until precise.
    """
    calls = [
        state
        for state in cells
        if state.task.cell.algorithm == reference
        and state.task.cell.precision is not None
        and state.task.algorithm.program is None
    ]
    return min(calls, key=lambda state: state.task.mesh.m, default=None)


def partners_of(cells: Sequence[Cell], reference: str) -> dict[str, str]:
    """Return the cell of the reference that each other cell is compared with, by label."""
    references = {circumstances(cell): cell.label for cell in cells if cell.algorithm == reference}
    return {
        cell.label: references[circumstances(cell)]
        for cell in cells
        if circumstances(cell) in references and cell.algorithm != reference
    }


def interim_check(
    cells: Sequence[CellState], number: int, options: Options, seconds_left: float
) -> tuple[list[tuple[CellState, Ended]], list[CellState]]:
    """Return the cells that end after `number` rounds, with the reason, and those that continue.

    A cell ends if it is precise, or cannot continue; references end last. A cell with more rounds,
    from before a kill, was continued at this look before.
    """
    last = number >= options.most_rounds
    states = _until_precise(cells, None if last else number)
    partners = partners_of([state.task.cell for state in states.values()], options.reference)
    rounds = {label: list(state.rounds.values()) for label, state in states.items()}
    lacks = {}
    for label, state in states.items():
        partner = partners.get(label)
        reference = (states[partner].task.cell, rounds[partner]) if partner else None
        lacks[label] = lack(state.task.cell, rounds[label], reference)
    # What a reference is measured for are the ratios of others to it.
    wanted = lacks | dict.fromkeys(partners.values(), 0.0)
    for partner in set(partners.values()):
        widest = max(lacks[label] for label in partners if partners[label] == partner)
        lacks[partner] = min(lacks[partner], widest)
    more = next_look(number, options.most_rounds) - number
    costs = {label: more * state.price for label, state in states.items()}
    chosen: set[str] = set() if last else affordable(wanted, costs, partners, seconds_left)
    short: Ended = "rounds" if last else "budget"
    precise: Ended = "precise"
    ending = [label for label in states if label not in chosen]
    ending.sort(key=lambda label: label in partners.values())
    ended = [(states[label], precise if lacks[label] <= 1 else short) for label in ending]
    return ended, [states[label] for label in states if label in chosen]


def over_budget(
    cells: Sequence[CellState], number: int, options: Options, seconds_left: float
) -> list[CellState]:
    """Return the cells that cannot reach their first look within the budget, by label.

    The cheapest ones are kept; a cell that is dropped is not resumed.
    """
    if seconds_left == inf or number >= next_look(0, options.most_rounds):
        return []
    states = _until_precise(cells, number)
    partners = partners_of([state.task.cell for state in states.values()], options.reference)
    more = next_look(number, options.most_rounds) - number
    costs = {label: more * state.price for label, state in states.items()}
    if number > 1:
        seconds_left += _TOLERATED * (options.budget or 0.0)
    if sum(costs.values()) <= seconds_left:
        return []
    surfaces = {label: state.task.cell.mesh_hash for label, state in states.items()}
    whole = surfaces if options.whole_surfaces else None
    chosen = cheapest(costs, partners, seconds_left, whole)
    return [states[label] for label in sorted(states.keys() - chosen)]


def _until_precise(cells: Sequence[CellState], number: int | None) -> dict[str, CellState]:
    """Return the unfinished cells without a fixed number of rounds, by label.

    With `number`, only those with this number of rounds.
    """
    return {
        state.label: state
        for state in cells
        if state.record is None
        and state.task.cell.precision is not None
        and (number is None or len(state.rounds) == number)
    }


def lack(cell: Cell, rounds: Rounds, reference: tuple[Cell, Rounds] | None = None) -> float:
    """Return the factor by which a cell's intervals are too wide; at most 1 is precise.

    The interval is that of its ratio to a reference, if it was measured with one, else of its
    seconds. Infinite if there is none yet; 0 for a cell with a fixed number of rounds.
    """
    if cell.precision is None:
        return 0.0
    share = share_of(len(rounds), cell, reference[0]) if reference else 1.0
    ratios = ratios_of_rounds(rounds, reference[1], share) if reference else []
    if ratios:
        return _half(ratio_interval(ratios, share), lower_median(ratios)) / cell.precision
    own = interval_of_rounds(cell, rounds)
    return _half(own, lower_median([r.seconds for r in rounds])) / cell.precision


def _half(interval: Interval | None, figure: float) -> float:
    return inf if interval is None else (interval.high - interval.low) / (2 * figure)


def each_round(seconds: float) -> float:
    """Return the estimated seconds of a cell's calls in a process, from those of one call."""
    return seconds + max(seconds, ENOUGH_SECONDS)


def cost(rounds: Rounds) -> float:
    """Return the estimated seconds of another round of a cell, based on the last one."""
    each = (rounds[-1].calls, rounds[-1].together)
    return BESIDE_CALLS + sum(_with_warm_up(calls) for calls in each if calls)


def _with_warm_up(calls: Sequence[float]) -> float:
    """Return the seconds of a process's calls, with the first one if that was not timed."""
    longest = max(calls)
    return sum(calls) + (longest if longest <= LONG_CALL else 0.0)


def affordable(
    lacks: Mapping[str, float],
    costs: Mapping[str, float],
    partners: Mapping[str, str],
    seconds: float,
) -> set[str]:
    """Return the cells that get more rounds in the remaining seconds, with their partners.

    Parameters
    ----------
    lacks : mapping
        Factor by which a cell's intervals are too wide, by label; see :func:`lack`.
    costs : mapping
        Seconds until the next look, by label, including those of partners.
    partners : mapping
        The cell with which a cell is compared, and so measured side by side.
    seconds : float
        Remaining seconds; infinite without a limit.
    """
    lacking = [label for label in lacks if lacks[label] > 1]
    widest = sorted(lacking, key=lambda label: (-lacks[label], label))
    return _within(widest, costs, partners, seconds)


def cheapest(
    costs: Mapping[str, float],
    partners: Mapping[str, str],
    seconds: float,
    surfaces: Mapping[str, str] | None = None,
) -> set[str]:
    """Return the cells that reach their first look in the remaining seconds, the cheapest first.

    Parameters are those of :func:`affordable`; a cell's partner is measured with it, and not alone:
    it would be compared with nothing. With `surfaces`, the surface of each cell, the cheapest
    surfaces come first, each with all its cells.
    """
    chosen: set[str] = set()
    groups: dict[str, list[str]] = {}
    for label, surface in (surfaces or {}).items():
        groups.setdefault(surface, []).append(label)
    for price, group in sorted(
        (sum(costs[one] for one in group), group) for group in groups.values()
    ):
        if price > seconds:
            break
        chosen.update(group)
        seconds -= price

    def price_beside(label: str) -> float:
        return sum(costs[one] for one in {label, partners.get(label, label)})

    compared = costs.keys() - chosen - set(partners.values())
    ordered = sorted(compared, key=lambda label: (price_beside(label), label))
    return chosen | _within(ordered, costs, partners, seconds)


def _within(
    ordered: Sequence[str], costs: Mapping[str, float], partners: Mapping[str, str], seconds: float
) -> set[str]:
    """Return the cells that can be paid for, in this order, each with its partner."""
    chosen: set[str] = set()
    for label in ordered:
        more = {label, partners.get(label, label)} - chosen
        price = sum(costs[one] for one in more)
        if price <= seconds:
            chosen |= more
            seconds -= price
    return chosen
