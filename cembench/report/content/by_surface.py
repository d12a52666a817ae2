"""Tables of a run with a row for each surface and a column for each algorithm."""

from __future__ import annotations

from collections.abc import Sequence

from cembench.report.content.evidence import (
    ANGLE,
    DISK,
    AlgorithmSeries,
    Evidence,
    MeasuredSurface,
)
from cembench.report.content.printed_beside_measured import Quantity, in_policy, table_beside
from cembench.report.document import Table
from cembench.results.columns import COLUMNS


def own_table(evidence: Evidence) -> Table:
    """Return angle errors, E_C, seconds and folds of all algorithms, one row per surface."""
    policy = evidence.policies[0]
    return table_beside(
        evidence,
        "own-surfaces",
        f"All surfaces and algorithms{in_policy(evidence, policy)}",
        evidence.surfaces,
        [
            q
            for name, heading in _OWN.items()
            for q in _by_algorithm(evidence.series, name, heading, " *")
        ],
        policy=policy,
        notes=[
            f"* {s.label} does not map to the disk ({s.target}): its E_C is not comparable"
            for s in evidence.series
            if s.target != DISK
        ],
    )


def _by_algorithm(
    series: Sequence[AlgorithmSeries], name: str, heading: str, star: str = ""
) -> list[Quantity]:
    """Return a figure of each algorithm under one heading; `star` marks those not to the disk."""
    return [
        Quantity(heading, s, COLUMNS[name], title=s.label + star * (s.target != DISK))
        for s in series
    ]


#: The figures of a run over the user's own surfaces, with the headings of their groups.
_OWN = {
    ANGLE: "mean angle error, degrees",
    "conformal_energy": "E_C",
    "seconds": "seconds",
    "flipped_triangles": "folds",
}


def hardest_table(evidence: Evidence, policy: str, surfaces: Sequence[MeasuredSurface]) -> Table:
    """Return the mean angle error, or the status, by surface (rows) and algorithm (columns)."""
    frame = evidence.frame
    tried = set(frame[frame["solves"] == policy]["label"])
    series = [s for s in evidence.series if s.main and s.label in tried]
    return table_beside(
        evidence,
        "hardest",
        f"The {len(surfaces)} hardest surfaces",
        surfaces,
        _by_algorithm(series, ANGLE, "mean angle error, degrees"),
        policy=policy,
        caption="The surfaces whose best map has the largest angle errors (of maps to the disk "
        "where there are any); surfaces without a map come first.",
    )
