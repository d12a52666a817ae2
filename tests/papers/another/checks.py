"""Checks of a paper's claims."""

from cembench.report.content.claims import Found
from cembench.report.content.evidence import figure


def lower_energy(evidence, inspections):
    """Compare the energies on each model of the run."""
    pair = [evidence.series_of(name) for name in evidence.paper.algorithms]
    found = [
        [figure(evidence, surface, s, "reuse", "conformal_energy") for s in pair]
        for surface in evidence.models
    ]
    held = sum(cem <= other for other, cem in found)
    return Found(held, len(found), f"on {held} of {len(found)}", evidence.models)


def named(evidence, inspections):
    """Look for a title."""
    return Found(sum(bool(s.title) for s in evidence.models), len(evidence.models), "as it says")
