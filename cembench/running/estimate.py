"""Estimate the seconds and the memory of a run before it starts.

The seconds of a call are taken from an earlier record of the same cell, or else from a power law in
the number of triangles through the algorithm's records. Without records, the usual costs of
built-in algorithms are used (:mod:`cembench.running.usual_costs`), and for other algorithms those
of the paper's slowest one, which they seldom exceed.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import geometric_mean
from typing import Literal

from cembench.results.power_law import PowerLaw, fit
from cembench.results.records import Cell, Record
from cembench.running.fork_server import can_fork
from cembench.running.measure import LONG_CALL
from cembench.running.usual_costs import FACES, ROUGH_BYTES_A_FACE, USUAL

Basis = Literal["recorded", "other sizes", "rough"]

#: Seconds to start a process, load libraries and read the mesh.
START_SECONDS = 0.5
#: The same for a process forked from one with the libraries loaded, including its end.
FORK_SECONDS = 0.1
#: Duration of a timing process in calls: the warm-up, and one call or more; a long call is made
#: once.
CALLS_A_ROUND = 2.5
#: Seconds per triangle of a check besides its call: computing metrics.
CHECK_SECONDS_A_FACE = 2e-6
#: Bytes of an empty process, if nothing is recorded.
ROUGH_BYTES = 150e6
#: From this number of triangles on, memory is estimated before a call is tried.
LARGE = 500_000
#: Typical rounds until a cell is precise, on a quiet machine.
USUAL_ROUNDS = 20
#: Substitute for an unknown algorithm.
SLOWEST = "qiem"
#: Exponent of growth if there are records of only one size.
_USUAL_EXPONENT = 1.2


@dataclass(frozen=True)
class Estimate:
    """Estimate for a cell: seconds of a call and of all processes, and peak bytes."""

    call_seconds: float
    seconds: float
    memory_bytes: float
    basis: Basis
    #: The seconds of the check and of the rounds that are made whatever the budget is.
    least_seconds: float = 0.0


def estimate(cell: Cell, faces: int, records: Iterable[Record]) -> Estimate:
    """Return the estimated cost of a cell, based on these records."""
    known = [
        (float(r.mesh.faces), r.outcome.median_seconds, r.outcome.peak_memory_bytes, r.cell)
        for r in records
        if r.cell.algorithm == cell.algorithm
        and r.cell.solves == cell.solves
        and r.outcome.median_seconds
    ]
    same = [k for k in known if k[3].mesh_hash == cell.mesh_hash]
    points = [(size, seconds) for size, seconds, _, _ in same or known if seconds]
    law = law_through(points) if points else _usual_law(cell)
    basis: Basis = "recorded" if same else "other sizes" if known else "rough"
    call = law.at(faces)
    peaks = [(size, float(peak)) for size, _, peak, _ in same or known if peak]
    # Proportional to the triangles above an empty process, and a record's at least.
    memory = max(
        (peak + max(0.0, peak - ROUGH_BYTES) * max(0.0, faces / size - 1) for size, peak in peaks),
        default=_usual_bytes(cell.algorithm, faces),
    )
    check = START_SECONDS + call + CHECK_SECONDS_A_FACE * faces
    start = FORK_SECONDS if can_fork(cell.threads) else START_SECONDS
    calls = CALLS_A_ROUND if call < LONG_CALL else 1
    round_ = start + calls * call
    least = (cell.repeats or 1) * round_
    rounds = (cell.repeats or USUAL_ROUNDS) * round_
    return Estimate(call, check + rounds, memory, basis, check + least)


def expected_bytes(algorithm: str, faces: int) -> float | None:
    """Return the memory of a built-in algorithm's call on a large surface; None if not known.

    Below :data:`LARGE` triangles memory depends on more than their number, and is seldom short.
    """
    if faces < LARGE or algorithm not in USUAL:
        return None
    return _usual_bytes(algorithm, faces)


def _usual_bytes(algorithm: str, faces: int) -> float:
    *_, a_face = USUAL.get(algorithm, (ROUGH_BYTES_A_FACE,))
    return ROUGH_BYTES + a_face * faces


def planned_seconds(costs: Sequence[Estimate], budget: float | None) -> float:
    """Return the seconds of all cells, with further rounds only within the budget."""
    everything = sum(cost.seconds for cost in costs)
    if budget is None:
        return everything
    return max(sum(cost.least_seconds for cost in costs), min(everything, budget))


def law_through(points: Sequence[tuple[float, float]]) -> PowerLaw:
    """Return the power law fitted to (faces, seconds), with the usual exponent for one size."""
    faces, seconds = map(geometric_mean, zip(*points, strict=True))
    usual = PowerLaw(seconds / faces**_USUAL_EXPONENT, _USUAL_EXPONENT)
    return fit(points, fewest=2) or usual


def _usual_law(cell: Cell) -> PowerLaw:
    """Return the power law of a built-in algorithm, or of the paper's slowest for others."""
    reused, anew, _ = USUAL.get(cell.algorithm, USUAL[SLOWEST])
    seconds, exponent = reused if cell.solves == "reuse" else anew
    return PowerLaw(seconds / FACES**exponent, exponent)
