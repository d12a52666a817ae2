"""What a validation looked at: the triangles of each stage, and quality at every size it timed.

Iteration limits, fixed tolerances and single precision may leave the maps of a small surface good
and those of a large one bad, so E_C is compared at each size of the scaling stage too.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from math import log

from cembench.results.regressions import NO_ENERGY, TIE
from cembench.validation.correctness import ENERGY_ORDER
from cembench.validation.finding import Stage, ValidationFinding, finding
from cembench.validation.quality import BaselineComparison, Pair

#: From one size to the next E_C has to fall like that of a conformal map, or by at most this order
#: less than the reference's, whose own tolerances may end its convergence.
BELOW_REFERENCE = 0.5

#: Fewest and most triangles of the surfaces that a stage has maps of.
LookedAt = Mapping[Stage, tuple[int, int]]


def keeps_its_quality(compared: BaselineComparison) -> ValidationFinding:
    """Check that E_C falls from size to size, on its own or as much as the reference's does."""
    mapped = [pair for pair in _by_size(compared) if pair.energy_ratio is not None]
    orders = [_orders(smaller, larger) for smaller, larger in pairwise(mapped)]
    bad = [own for own, other in orders if own < ENERGY_ORDER and own < other - BELOW_REFERENCE]
    measured = ratios_by_size(compared)
    if bad:
        measured += f"; from one size to the next E_C changes like h^{min(bad):.2f}"
    return finding(
        "scaling",
        "E_C at every size",
        measured,
        ok=not bad,
        undecided=not orders,
        least=ENERGY_ORDER,
        below=BELOW_REFERENCE,
    )


def ratios_by_size(compared: BaselineComparison) -> str:
    """Return our energies over the baseline's at each size, as a clause."""
    pairs = _by_size(compared)
    ratios = ["no ratio" if (r := p.energy_ratio) is None else f"{r:.2f}" for p in pairs]
    faces = [f"{pair.faces:,}" for pair in pairs]
    of = f"times {compared.title}'s at"
    return f"{compared.energy_name} {', '.join(ratios)} {of} {', '.join(faces)} triangles"


def is_higher_at_last(compared: BaselineComparison) -> bool:
    """Whether our energy is higher at the largest size that both map, by more than a tie."""
    ratios = [r for pair in _by_size(compared) if (r := pair.energy_ratio) is not None]
    return bool(ratios) and ratios[-1] > 1 + TIE


def looked_at_sentence(looked_at: LookedAt) -> str:
    """Return which sizes each stage has seen."""
    parts = [
        f"{stage} {low:,} to {high:,}" if low < high else f"{stage} {low:,}"
        for stage, (low, high) in looked_at.items()
    ]
    return f"Looked at, in triangles: {', '.join(parts)}."


def _by_size(compared: BaselineComparison) -> list[Pair]:
    return sorted(compared.pairs, key=lambda pair: pair.faces)


def _orders(smaller: Pair, larger: Pair) -> tuple[float, float]:
    """Return the orders in h at which our energy and the baseline's fall between two sizes."""
    finer = log(larger.faces / smaller.faces) / 2
    own = log(_energy(smaller.energy) / _energy(larger.energy)) / finer
    return own, own + log((larger.energy_ratio or 1.0) / (smaller.energy_ratio or 1.0)) / finer


def _energy(energy: float | None) -> float:
    """Return an energy, but no less than what is rounding."""
    return max(energy or 0.0, NO_ENERGY)
