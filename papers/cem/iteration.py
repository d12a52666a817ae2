"""Claims about the boundary iteration."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from cembench.report.content.claims import Found, Inspections
from cembench.report.content.evidence import REFERENCE, Evidence

from .accuracy import cem_records

#: A rise below this share of the energy is rounding.
ROUNDING = 1e-12


def rises(history: Sequence[float]) -> int:
    """Return the number of steps in which the energy rises."""
    return sum(_rising(history))


def becomes_decreasing(history: Sequence[float]) -> bool:
    """Whether the energy, once it falls, falls in every further step, including the last."""
    rising = _rising(history)
    return not rising[-1] and sorted(rising, reverse=True) == rising


def _rising(history: Sequence[float]) -> list[bool]:
    return [b > a * (1 + ROUNDING) for a, b in pairwise(history)]


def energy_decreases_monotonically(evidence: Evidence, inspections: Inspections) -> Found:
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
    figures = f"true on {len(become)} of {len(histories)} surfaces, in every step on {len(falling)}"
    figures += f"; steps that rise: {'; '.join(rising)}" if rising else ""
    return Found(len(become), len(histories), figures, list(histories))


def iteration_lowers_energy(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that the boundary iteration decreases E_C well."""
    found = [(s, r) for s, r in cem_records(evidence) if len(r.outcome.energy_history) > 1]
    drops = {s: 1 - h[-1] / h[0] for s, r in found if (h := r.outcome.energy_history)[0] > 0}
    falls = list(drops.values())
    held = sum(drop > 0 for drop in falls)
    figures = (
        f"lower on {held} of {len(drops)} surfaces; by {float(np.median(falls)):.1%} in the "
        f"median, from {min(falls):.1%} to {max(falls):.1%}"
        if falls
        else "No iteration of CEM in this run."
    )
    return Found(held, len(drops), figures, list(drops))


def inversion_converges_better(evidence: Evidence, inspections: Inspections) -> Found:
    """Test the claim that iteration (30) converges better than (23)."""
    variants = [s for s in evidence.series if s.algorithm == REFERENCE]
    with_it = [s for s in variants if s.parameters.get("inversion") is True]
    without = [s for s in variants if s.parameters.get("inversion") is False]
    better, tested = 0, []
    for surface in evidence.surfaces:
        pair = [evidence.find(surface, v[0]) for v in (with_it, without) if v]
        ends = [
            r.outcome.energy_history[-1]
            for r in pair
            if r and r.outcome.status == "ok" and r.outcome.energy_history
        ]
        if len(ends) == 2:
            tested.append(surface)
            better += ends[0] <= ends[1]
    figures = (
        f"true on {better} of {len(tested)} surfaces"
        if tested
        else "This run has no CEM without inversion; measure it into the same folder with "
        "`cembench run ... -a cem -p cem.inversion=False`."
    )
    return Found(better, len(tested), figures, tested)


def at_most_20_iterations(evidence: Evidence, inspections: Inspections) -> Found:
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
    figures = (
        f"at most 20 on {within} of {len(pairs)}, as printed on {same} (printed/here: {listed})"
        if pairs
        else "No model of the paper in this run."
    )
    return Found(within, len(pairs), figures, [s for s, _, _ in pairs])
