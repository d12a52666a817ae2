"""Claims about the boundary iteration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from cembench.report.content.claims.accuracy import cem_records
from cembench.report.content.claims.verdicts import tested_on, verdict_of
from cembench.report.content.evidence import REFERENCE, Evidence
from cembench.report.content.inspection import Inspection
from cembench.report.document import Claim

Inspections = Mapping[str, Inspection]
#: A rise below this share of the energy is rounding.
ROUNDING = 1e-12
#: The rule by default.
ENDS = (
    "Here iteration ends after the first step that does not lower E_C by at least the tolerance, "
    "or after 20."
)


def rises(history: Sequence[float]) -> int:
    """Return the number of steps in which the energy rises."""
    return sum(_rising(history))


def becomes_decreasing(history: Sequence[float]) -> bool:
    """Whether the energy, once it falls, falls in every further step, including the last."""
    rising = _rising(history)
    return not rising[-1] and sorted(rising, reverse=True) == rising


def _rising(history: Sequence[float]) -> list[bool]:
    return [b > a * (1 + ROUNDING) for a, b in pairwise(history)]


def energy_decreases_monotonically(evidence: Evidence, inspections: Inspections) -> Claim:
    """Test the claim that E_C becomes monotonically decreasing."""
    histories = {
        s: r.outcome.energy_history
        for s, r in cem_records(evidence)
        if len(r.outcome.energy_history) > 1
    }
    falling = [s for s, history in histories.items() if not rises(history)]
    become = [s for s, history in histories.items() if becomes_decreasing(history)]
    rising = [
        f"{s.title} ({rises(history)} of {len(history) - 1})"
        for s, history in histories.items()
        if s not in falling
    ]
    return Claim(
        "monotonically-decreasing",
        "the conformal energy of the map in the iterations (22), (30), (24) (25) would become "
        "monotonically decreasing",
        "Remark 3",
        "Once E_C falls in a step of CEM's iteration, it falls in all further ones. ('Become' "
        "allows a rise at first.)",
        f"true on {len(become)} of {len(histories)} surfaces, in every step on {len(falling)}"
        + (f"; steps that rise: {'; '.join(rising)}" if rising else ""),
        verdict_of(len(become), len(histories)),
        f"{tested_on(list(histories))} {ENDS}",
    )


def iteration_lowers_energy(evidence: Evidence, inspections: Inspections) -> Claim:
    """Test the claim that the boundary iteration decreases E_C well."""
    found = [(s, r) for s, r in cem_records(evidence) if len(r.outcome.energy_history) > 1]
    drops = {s: 1 - h[-1] / h[0] for s, r in found if (h := r.outcome.energy_history)[0] > 0}
    falls = list(drops.values())
    held = sum(drop > 0 for drop in falls)
    return Claim(
        "iteration-lowers-energy",
        "the proposed boundary iteration scheme (26) for CEM performs well in decreasing the "
        "conformal energy",
        "Section 5, on Fig. 8",
        "E_C is lower after the last iteration than at the start.",
        f"lower on {held} of {len(drops)} surfaces; by {float(np.median(falls)):.1%} in the "
        f"median, from {min(falls):.1%} to {max(falls):.1%}"
        if falls
        else "No iteration of CEM in this run.",
        verdict_of(held, len(drops)),
        f"{tested_on(list(drops))} How much is 'well' is left to the reader.",
    )


def inversion_converges_better(evidence: Evidence, inspections: Inspections) -> Claim:
    """Test the claim that iteration (30) converges better than (23)."""
    variants = [s for s in evidence.series if s.algorithm == REFERENCE]
    with_it = [s for s in variants if s.parameters.get("inversion") is True]
    without = [s for s in variants if s.parameters.get("inversion") is False]
    better = tested = 0
    tested_surfaces = []
    for surface in evidence.surfaces:
        pair = [evidence.find(surface, v[0]) for v in (with_it, without) if v]
        ends = [
            r.outcome.energy_history[-1]
            for r in pair
            if r and r.outcome.status == "ok" and r.outcome.energy_history
        ]
        if len(ends) == 2:
            tested += 1
            tested_surfaces.append(surface)
            better += ends[0] <= ends[1]
    return Claim(
        "inversion",
        "Numerical experiments indicate that an inversion ... would have a better convergence in "
        "the iterations (22)-(25)",
        "Remark 3",
        "CEM with the inversion (30) ends with an E_C not above that of CEM without it (23), under "
        "the same stopping rule.",
        f"true on {better} of {tested} surfaces"
        if tested
        else "This run has no CEM without inversion; measure it into the same folder with "
        "`cembench run ... -a cem -p cem.inversion=False`.",
        verdict_of(better, tested),
        tested_on(tested_surfaces),
    )


def at_most_20_iterations(evidence: Evidence, inspections: Inspections) -> Claim:
    """Test the claim of at most 20 iterations, and compare with the printed numbers."""
    pairs = []
    for surface, record in cem_records(evidence):
        row = evidence.paper.tables[1].get(surface.paper_row, {})
        printed = row.get("cem_iterations")
        if printed is not None and record.outcome.iterations is not None:
            pairs.append((surface, int(printed), record.outcome.iterations))
    within = sum(n <= 20 for _, _, n in pairs)
    same = sum(p == n for _, p, n in pairs)
    listed = ", ".join(f"{s.title} {p}/{n}" for s, p, n in pairs)
    return Claim(
        "iterations",
        "The maximal number of iterations for CEM algorithm is set to be 20",
        "Section 5 and Table 1 (#Iter.)",
        "CEM takes at most 20 iterations on every model.",
        f"at most 20 on {within} of {len(pairs)}, as printed on {same} (printed/here: {listed})"
        if pairs
        else "No model of the paper in this run.",
        verdict_of(within, len(pairs)),
        f"{tested_on([s for s, _, _ in pairs])} The paper does not state its stopping rule. "
        f"{ENDS} With 1e-5 this gives 20, 1, 18, 20, 1, 19 and 2 iterations on the seven models "
        "that are public; printed are 19, 1, 13, 20, 1, 19 and 2. On a stand-in another count is "
        "to be expected.",
    )
