"""Tests of the claims in the paper's text on a run, one function per claim."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from cembench.report.content.claims import accuracy, efficiency, iteration, premises, start
from cembench.report.content.evidence import Evidence
from cembench.report.content.inspection import Inspection
from cembench.report.document import Claim

#: All claims in the order of the paper's text.
CLAIMS: tuple[Callable[[Evidence, Mapping[str, Inspection]], Claim], ...] = (
    premises.delaunay,
    premises.well_conditioned,
    start.distortion_near_pole,
    start.any_index,
    start.schur_complement,
    iteration.inversion_converges_better,
    iteration.energy_decreases_monotonically,
    premises.iteration_matrix,
    premises.convex_hull,
    premises.other_weights,
    premises.circular_holes,
    accuracy.no_folding,
    accuracy.angles_preserved,
    iteration.iteration_lowers_energy,
    accuracy.below_one_degree,
    efficiency.always_faster,
    efficiency.average_rates,
    efficiency.average_savings,
    efficiency.table_2_follows,
    accuracy.energy_similar,
    accuracy.deviation_similar,
    accuracy.means_slightly_better,
    efficiency.more_than_80_percent,
    efficiency.less_than_one_second,
    iteration.at_most_20_iterations,
)


def claims(evidence: Evidence, inspections: Mapping[str, Inspection]) -> list[Claim]:
    """Return all claims with their verdicts on this run."""
    return [claim(evidence, inspections) for claim in CLAIMS]
