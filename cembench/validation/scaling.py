"""Stage 4: growth of the seconds with the number of triangles.

A round gives an exponent of growth between the two largest meshes, and how much it is above that of
a reference solver in the same round. What slows the machine for a while slows both; what makes
large meshes dearer on it (a neighbour in the shared cache) raises both. The processes of a round
are in random order, so both figures scatter evenly about their true values, and the signed-rank
interval holds for any noise. Rounds are added until the answer is clear
(:mod:`cembench.results.intervals`).
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from math import log
from statistics import median
from typing import Literal, NamedTuple

from pydantic import BaseModel, ConfigDict

from cembench.core.errors import ParameterError
from cembench.results.intervals import ERROR, LOOKS, Interval, next_look, share
from cembench.results.rank_tests import centre_interval
from cembench.results.records import Record, Round, lower_median
from cembench.running.schedule import cost
from cembench.validation.finding import ValidationFinding, finding

#: Largest allowed exponent. Factoring the Laplacian of a planar mesh costs faces^1.5
#: in theory; 0.25 allows for iteration counts that grow with the mesh.
MAX_EXPONENT = 1.75
#: Largest allowed difference from the reference, whose own exponent is 1 at most at these sizes.
MAX_ABOVE_REFERENCE = 0.75
#: Minimum triangles of the largest mesh.
MIN_UP_TO = 900
#: Rounds that are measured on all sizes; later ones only on the two that count.
FIRST_ROUNDS = 2
#: Maximum number of rounds: four looks.
MAX_ROUNDS = LOOKS[3]
#: Seconds that the rounds up to the first look may take after the first ones, and the stage with
#: later looks; what looks too steep gets its first look however long that takes.
MAX_SECONDS = 60.0
#: Our CPU seconds count if they are this share of the wall clock; else the solver waits.
_LEAST_CPU = 0.1
#: Phase whose growth is shown too.
_FACTORISATION = "factorisation"

Clock = Literal["cpu", "wall"]


class GrowthAnswer(StrEnum):
    """Whether a growth is allowed."""

    fine = "fine"
    too_steep = "too_steep"
    #: The intervals contain the limits, or there are none yet.
    inconclusive = "inconclusive"


class Growth(BaseModel):
    """Seconds against triangles, and the exponent of growth between the two largest meshes.

    On smaller meshes constant costs hide the growth. Each round has its own exponent;
    `exponent` is their median, with its 95 % interval.
    """

    model_config = ConfigDict(frozen=True)

    what: str
    faces: tuple[int, ...]
    #: Medians over the rounds, by size.
    seconds: tuple[float, ...]
    exponent: float
    #: None: too few rounds for an interval.
    interval: Interval | None = None
    rounds: int = 1


class GrowthComparison(BaseModel):
    """Our growth, the difference from the reference's in the same rounds, and the answer."""

    model_config = ConfigDict(frozen=True)

    answer: GrowthAnswer
    #: Whose seconds were taken: of the processor, or the wall clock's.
    clock: Clock
    ours: Growth
    others: tuple[Growth, ...] = ()
    reference: str | None = None
    #: Our exponent less the reference's: the median over the rounds and its 95 % interval.
    above: float | None = None
    above_interval: Interval | None = None


def sizes(up_to: int) -> tuple[int, ...]:
    """Return three numbers of triangles, each three times the one before.

    Raises
    ------
    ParameterError
        `up_to` is so small that the start of a call dominates.
    """
    if up_to < MIN_UP_TO:
        raise ParameterError(
            f"up_to={up_to} is too few to fit an exponent; allowed are {MIN_UP_TO:,} triangles "
            "and more, or 0 to leave that stage out."
        )
    return up_to // 9, up_to // 3, up_to


def answer_of(exponents: Sequence[float], above: Sequence[float] | None) -> GrowthAnswer:
    """Return whether the growth is allowed, from each round's exponent and its difference.

    Too steep is what exceeds both limits for sure; fine is what keeps one of them for sure.
    `above` is None without a reference.
    """
    own = _interval(exponents)
    if own is None:
        return GrowthAnswer.inconclusive
    beside = None if above is None else _interval(above)
    if own.low > MAX_EXPONENT and (beside is None or beside.low > MAX_ABOVE_REFERENCE):
        return GrowthAnswer.too_steep
    if own.high <= MAX_EXPONENT or (beside and beside.high <= MAX_ABOVE_REFERENCE):
        return GrowthAnswer.fine
    return GrowthAnswer.inconclusive


def growth_of(
    sittings: Sequence[Sequence[Record]], ours: str, reference: str | None
) -> GrowthComparison | None:
    """Return how the seconds grow, from the records of one sitting or several.

    Every sitting has the two largest sizes that the first one has. None if our algorithm was not
    timed on two sizes in each.
    """
    mine = _timed(sittings, ours)
    if mine is None:
        return None
    theirs = _timed(sittings, reference)
    clock = _steadier(mine)
    exponents = mine.exponents(clock)
    others, above = [], None
    if reference is not None and theirs is not None and theirs.shows(clock):
        same = theirs.exponents(clock)
        above = [a - b for a, b in zip(exponents, same, strict=True)]
        others.append(theirs.growth(reference, clock))
        factored = theirs.of_phase(_FACTORISATION)
        if factored is not None:
            others.append(factored.growth(f"{reference}'s {_FACTORISATION}", "wall"))
    return GrowthComparison(
        answer=answer_of(exponents, above),
        clock=clock,
        ours=mine.growth(ours, clock),
        others=tuple(others),
        reference=reference if above else None,
        above=median(above) if above else None,
        above_interval=_interval(above) if above else None,
    )


def more_rounds(
    growth: GrowthComparison, spent: float, seconds_a_round: float, most: float = MAX_SECONDS
) -> int:
    """Return how many rounds are to be added; 0 if the answer is clear or time is used up.

    What looks too steep after the first rounds is not left there: it gets its interval.
    """
    rounds = growth.ours.rounds
    if rounds >= MAX_ROUNDS or growth.answer is not GrowthAnswer.inconclusive:
        return 0
    more = next_look(rounds, MAX_ROUNDS) - rounds
    first = growth.ours.interval is None
    if more * seconds_a_round + (0 if first else spent) <= most:
        return more
    return more if first and growth.ours.exponent > MAX_EXPONENT else 0


def seconds_a_round(records: Sequence[Record]) -> float:
    """Return the estimated seconds of another round of these records' cells."""
    return sum(cost(r.outcome.rounds) for r in records if r.outcome.rounds)


def largest_two(records: Sequence[Record], ours: str) -> list[str]:
    """Return the names of the two largest surfaces on which an algorithm was timed."""
    return [r.cell.mesh for r in _timed_on(records, ours)[-2:]]


def scales(growth: GrowthComparison | None) -> ValidationFinding:
    """Check our growth; None for too few sizes. An inconclusive answer is not a fault."""
    return finding(
        "scaling",
        "growth of the seconds",
        "it could not be timed on two sizes" if growth is None else _words(growth),
        ok=growth is not None and growth.answer is not GrowthAnswer.too_steep,
        undecided=growth is not None and growth.answer is GrowthAnswer.inconclusive,
        most=MAX_EXPONENT,
        above=MAX_ABOVE_REFERENCE,
    )


def _words(growth: GrowthComparison) -> str:
    ours = growth.ours
    text = f"seconds grow like faces^{ours.exponent:.2f}{_range(ours.interval)}"
    text += f" from {ours.faces[-2]:,} to {ours.faces[-1]:,} triangles"
    if growth.above is not None:
        text += f", {growth.above:.2f}{_range(growth.above_interval)} above "
        text += ", ".join(f"{other.what} {other.exponent:.2f}" for other in growth.others[:1])
    if growth.answer is GrowthAnswer.inconclusive:
        few = ours.interval is None
        why = f"{ours.rounds} rounds are too few" if few else f"not after {ours.rounds} rounds"
        text += f"; inconclusive ({why})"
    return text


def _range(interval: Interval | None) -> str:
    return f" ({interval.low:.2f} to {interval.high:.2f})" if interval else ""


class _Timed(NamedTuple):
    """An algorithm's rounds: `sizes` those of the first sitting, `largest` all of the two."""

    faces: tuple[int, ...]
    sizes: tuple[tuple[Round, ...], ...]
    largest: tuple[tuple[Round, ...], tuple[Round, ...]]

    def exponents(self, clock: Clock) -> list[float]:
        """Return the exponent of each round."""
        ratio = log(self.faces[-1] / self.faces[-2])
        pairs = zip(*self.largest, strict=True)
        return [log(_seconds(b, clock) / _seconds(a, clock)) / ratio for a, b in pairs]

    def shows(self, clock: Clock) -> bool:
        """Whether each round has positive seconds of this clock."""
        return all(_seconds(r, clock) > 0 for size in self.largest for r in size)

    def waits(self) -> bool:
        """Whether the processor has little to do with the seconds."""
        return any(
            median(_seconds(r, "cpu") for r in size) <= _LEAST_CPU * median(r.seconds for r in size)
            for size in self.largest
        )

    def growth(self, what: str, clock: Clock) -> Growth:
        """Return the growth with its interval."""
        exponents = self.exponents(clock)
        by_size = (*self.sizes[:-2], *self.largest)
        return Growth(
            what=what,
            faces=self.faces,
            seconds=tuple(lower_median([_seconds(r, clock) for r in size]) for size in by_size),
            exponent=median(exponents),
            interval=_interval(exponents),
            rounds=len(exponents),
        )

    def of_phase(self, phase: str) -> _Timed | None:
        """Return the same of the seconds of a phase; None where a round has none."""
        all_rounds = (r for size in (*self.sizes, *self.largest) for r in size)
        if not all(r.phases.get(phase, 0.0) > 0 for r in all_rounds):
            return None

        def only(rounds: Sequence[Round]) -> tuple[Round, ...]:
            return tuple(r.model_copy(update={"calls": (r.phases[phase],)}) for r in rounds)

        small, large = (only(size) for size in self.largest)
        return _Timed(self.faces, tuple(only(size) for size in self.sizes), (small, large))


def _timed(sittings: Sequence[Sequence[Record]], name: str | None) -> _Timed | None:
    by_sitting = [_timed_on(records, name) for records in sittings]
    if not by_sitting or any(len(timed) < 2 for timed in by_sitting):
        return None
    first = by_sitting[0]
    small, large = (
        tuple(r for timed in by_sitting for r in timed[k].outcome.rounds) for k in (-2, -1)
    )
    sizes = tuple(record.outcome.rounds for record in first)
    return _Timed(tuple(record.mesh.faces for record in first), sizes, (small, large))


def _timed_on(records: Sequence[Record], name: str | None) -> list[Record]:
    timed = (r for r in records if r.cell.algorithm == name and r.outcome.rounds)
    return sorted((r for r in timed if r.outcome.status == "ok"), key=lambda r: r.mesh.faces)


def _steadier(timed: _Timed) -> Clock:
    """Return the clock whose exponents scatter less; that does not favour either answer."""
    if not timed.shows("cpu") or timed.waits():
        return "wall"
    cpu, wall = (_scatter(timed.exponents(clock)) for clock in ("cpu", "wall"))
    return "cpu" if cpu <= wall else "wall"


def _scatter(values: Sequence[float]) -> float:
    middle = median(values)
    return median(abs(value - middle) for value in values)


def _seconds(measured: Round, clock: Clock) -> float:
    return measured.seconds if clock == "wall" else measured.cpu_seconds or 0.0


def _interval(values: Sequence[float]) -> Interval | None:
    return centre_interval(values, ERROR * share(len(values)))
