"""Verdicts on claims: when one is given, and the surfaces it is based on."""

from __future__ import annotations

from collections.abc import Sequence

from cembench.report.content.evidence import Evidence, MeasuredSurface
from cembench.report.document import Verdict

OURS = (
    "All algorithms are this project's implementations on one linear algebra; the paper timed the "
    "MATLAB programs of their authors on a laptop."
)


def verdict_of(held: int, tested: int) -> Verdict:
    """Return the verdict: holds everywhere, in part, nowhere, or was not tested."""
    if tested == 0:
        return "not tested here"
    if held == tested:
        return "holds"
    return "holds in part" if held else "does not hold here"


def timed_verdict(held: int, tested: int, lacking: int) -> Verdict:
    """Return a verdict based on seconds, of figures that have an interval.

    A single round does not show how much the next one would differ, so `lacking` figures, with too
    few rounds for an interval, decide nothing: :func:`lacking_words` says how many there are.
    """
    return "too few rounds" if lacking and not tested else verdict_of(held, tested)


def lacking_words(lacking: int, tested: int) -> str:
    """Return on how many surfaces there are too few rounds for an interval; "" if on none.

    >>> lacking_words(2, 6)
    '; too few rounds on 2 more'
    """
    return f"; too few rounds on {lacking}{' more' * bool(tested)}" if lacking else ""


def tested_on(surfaces: Sequence[MeasuredSurface]) -> str:
    """Return a sentence on the kinds of surfaces behind a verdict."""
    kinds = {
        "model": "the paper's own models",
        "stand-in": "stand-ins for the paper's models",
        "surface": "surfaces that are not in the paper",
    }
    counts = {kind: sum(s.origin == kind for s in surfaces) for kind in kinds}
    said = [f"{count} on {kinds[kind]}" for kind, count in counts.items() if count]
    if not said:
        return "Nothing in this run to test it on."
    words = f"Surfaces tested: {', '.join(said)}."
    if not counts["model"]:
        words += " None is a model of the paper itself: the verdict is about the algorithms here."
    return words


def under(policy: str, evidence: Evidence) -> str:
    """Return the policy of a figure if the run has several, else ""."""
    return f" ({policy})" if len(evidence.policies) > 1 else ""
