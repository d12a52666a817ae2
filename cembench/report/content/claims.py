"""The claims of a paper with their verdicts on a run.

The paper's folder holds what does not depend on a run: its words, their place, the test in words,
and its test: an expression, or a check, a function (evidence, inspections) -> :class:`Found`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cembench.report.content.evidence import Evidence, MeasuredSurface
from cembench.report.content.inspection import Inspection
from cembench.report.document import Claim, Verdict
from cembench.results.frame import evaluate
from cembench.results.papers import StatedClaim

#: The surfaces' inspections by the hash of the mesh.
Inspections = Mapping[str, Inspection]


@dataclass(frozen=True)
class Found:
    """What a check found: in how many of the cases tested a claim held, and the figures in words.

    Parameters
    ----------
    held, tested : int
        Number of cases, surfaces as a rule.
    figures : str
        Result of the test, with n.
    surfaces : sequence of MeasuredSurface or None
        The surfaces behind the verdict; None if they are not to be told.
    lacking : int
        Number of cases that were timed in too few rounds: they decide nothing.
    remark : str
        What follows the claim's own remark.

    """

    held: int
    tested: int
    figures: str
    surfaces: Sequence[MeasuredSurface] | None = None
    lacking: int = 0
    remark: str = ""

    @property
    def verdict(self) -> Verdict:
        """The verdict: holds everywhere, in part, nowhere, or was not tested.

        A single round does not show how much the next one would differ.
        """
        if self.tested == 0:
            return "too few rounds" if self.lacking else "not tested here"
        if self.held == self.tested:
            return "holds"
        return "holds in part" if self.held else "does not hold here"


def claims(evidence: Evidence, inspections: Inspections) -> list[Claim]:
    """Return all claims of the run's paper with their verdicts, in the order of its text."""
    told = []
    for one in evidence.paper.claims:
        found: Found = (
            by_expression(evidence, one)
            if one.holds
            else evidence.paper.check(one)(evidence, inspections)
        )
        where = None if found.surfaces is None else tested_on(found.surfaces)
        remark = " ".join(filter(None, (where, one.remark, found.remark)))
        told.append(
            Claim(one.name, one.quote, one.place, one.test, found.figures, found.verdict, remark)
        )
    return told


def by_expression(evidence: Evidence, claim: StatedClaim) -> Found:
    """Return on how many of the paper's models an expression holds for maps by its algorithms.

    Surfaces where one of them has no valid map are left out; the policy is the run's first.
    """
    frame = evidence.frame
    chosen = frame["ok"] & frame["main"] & (frame["solves"] == evidence.policies[0])
    chosen &= frame["paper_row"].isin(evidence.paper.models)
    frame = frame[chosen & frame["algorithm"].isin(claim.algorithms)]
    held, failed, surfaces = 0, [], []
    for place, group in frame.groupby("place"):
        if set(group["algorithm"]) != set(claim.algorithms):
            continue
        surfaces.append(evidence.surfaces[int(str(place))])
        if bool(evaluate(claim.holds, group)):
            held += 1
        else:
            failed.append(surfaces[-1].title)
    told = f"true on {held} of {len(surfaces)} surfaces"
    told += f"; not on {', '.join(failed)}" if failed else ""
    return Found(held, len(surfaces), told, surfaces)


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
