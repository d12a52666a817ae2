"""The first table of a run over the user's own surfaces: figures by surface and algorithm."""

from __future__ import annotations

from cembench.conformal.metrics import METRICS
from cembench.report.content.evidence import ANGLE, DISK, AlgorithmSeries, Evidence
from cembench.report.content.printed_beside_measured import (
    Number,
    Quantity,
    in_policy,
    significant,
    table_beside,
)
from cembench.report.document import Table
from cembench.results.records import Record

_METRIC = {metric.name: metric for metric in METRICS}
#: The figures in the table, with the headings of their groups; all but the seconds are metrics.
_SHOWN = {
    ANGLE: "mean angle error, degrees",
    "conformal_energy": "E_C",
    "seconds": "seconds",
    "flipped_triangles": "folds",
}


def own_table(evidence: Evidence) -> Table:
    """Return angle errors, E_C, seconds and folds of all algorithms, one row per surface."""
    policy = evidence.policies[0]
    quantities = [
        _quantity(name, heading, series)
        for name, heading in _SHOWN.items()
        for series in evidence.series
    ]
    others = [s for s in evidence.series if s.target != DISK]
    return table_beside(
        evidence,
        "own-surfaces",
        f"All surfaces and algorithms{in_policy(evidence, policy)}",
        evidence.surfaces,
        quantities,
        policy=policy,
        notes=[
            f"* {s.label} does not map to the disk ({s.target}): its E_C is not comparable"
            for s in others
        ],
    )


def _quantity(name: str, heading: str, series: AlgorithmSeries) -> Quantity:
    metric = _METRIC.get(name)
    title = series.label if series.target == DISK else f"{series.label} *"

    def measured(record: Record) -> Number:
        outcome = record.outcome
        return outcome.metrics.get(name) if metric else outcome.median_seconds

    def show(number: float) -> str:
        return metric.text(number) if metric else significant(number)

    return Quantity(heading, series, measured, show, title=title, timed=metric is None)
