"""The options of a run: limits, seed, budget, and what is measured again."""

from __future__ import annotations

from dataclasses import dataclass

from cembench.results.intervals import USUAL_MAX_ROUNDS
from cembench.results.records import REFERENCE, Record
from cembench.running.pairing import Pairing

#: Default limit of a call in wall-clock seconds.
DEFAULT_TIMEOUT = 600.0
#: Default time budget of a run in seconds.
USUAL_BUDGET = 1800.0


@dataclass(frozen=True)
class Options:
    """Options of a run."""

    #: A process that times has twice as long, because it makes at least two calls.
    timeout: float = DEFAULT_TIMEOUT
    #: Resident bytes of a process and all that it starts; None: no limit.
    memory_bytes: int | None = None
    #: Measure again the cells that the store holds.
    fresh: bool = False
    #: Measure again the cells that the store holds and that did not end ok.
    rerun_failed: bool = False
    #: Seed of the random order within each round.
    seed: int = 0
    #: The algorithm that the others are compared with: their ratios to it become precise.
    reference: str = REFERENCE
    #: Rounds of a cell that is measured until it is precise, at most.
    most_rounds: int = USUAL_MAX_ROUNDS
    #: Time budget in wall-clock seconds, after which only first rounds are made; None: no limit.
    #: It does not shorten a fixed number of rounds.
    budget: float | None = None
    #: Whether a budget that is not enough for the first look of all cells is spent surface by
    #: surface, so that the comparisons on the cheapest ones are complete; else cell by cell.
    whole_surfaces: bool = False
    #: Whether the cells that are compared on a surface also share a process in each round:
    #: "process", "separate", or "auto": where that promises narrower ratios in the same time.
    pairing: Pairing = "separate"
    #: How often a process is repeated if the machine was busy; the quietest run counts.
    repeat_busy: int = 0
    #: Number of checks that run in parallel, sharing the memory. Timed processes run alone.
    jobs: int = 1

    def measures_again(self, record: Record) -> bool:
        """Whether a cell with this record is measured again."""
        return self.fresh or (self.rerun_failed and record.outcome.status != "ok")
