"""Maps to targets other than the disk, which are never mixed with disks unmarked."""

from __future__ import annotations

from cembench.conformal.metrics import METRICS
from cembench.report.content.evidence import DISK, Evidence
from cembench.report.content.printed_beside_measured import significant
from cembench.report.document import Column, Table, Value, words

#: Metrics that have the same meaning for every target.
_COMPARABLE = tuple(
    metric
    for metric in METRICS
    if (metric.shown == "overview" and metric.gauge_invariant)
    or metric.name in ("beltrami_area_mean", "area_distortion_sd", "overlap_share")
)


def other_targets(evidence: Evidence) -> Table | None:
    """Return a table by surface and algorithm; None if all algorithms map to the disk."""
    rows = []
    policy = evidence.policies[0]
    for surface in evidence.surfaces:
        for series in evidence.series:
            record = evidence.find(surface, series, policy)
            if series.target == DISK or record is None:
                continue
            outcome, key = record.outcome, record.cell.key
            why = evidence.missing_reason(record) if outcome.status != "ok" else ""

            def value(number: float | None, form: str, key: str = key, why: str = why) -> Value:
                if number is None:
                    return Value("-", None, "", key, why or "not measured")
                return Value(format(number, form), float(number), surface.origin, key)  # noqa: B023

            m = outcome.metrics
            energy, area = m.get("conformal_energy"), m.get("image_area")
            scaled = energy / area if energy is not None and area else None
            seconds = outcome.median_seconds
            timed = Value("-", None, "", key, why or "not timed")
            if seconds is not None:
                told = f"{significant(seconds)} {evidence.machines.of(record)}".rstrip()
                timed = Value(told, seconds, surface.origin, key)
            rows.append(
                (
                    words(surface.title),
                    words(series.label),
                    words(series.target),
                    Value(outcome.status, None, "", key, why),
                    timed,
                    value(scaled, ".4f"),
                    *(value(m.get(metric.name), metric.form) for metric in _COMPARABLE),
                )
            )
    if not rows:
        return None
    return Table(
        "other-targets",
        "Maps that do not go to the disk",
        (
            Column("surface", numeric=False),
            Column("algorithm", numeric=False),
            Column("target", numeric=False),
            Column("status", numeric=False),
            Column("seconds", unit="s"),
            Column("E_C / A"),
            *(Column(metric.heading) for metric in _COMPARABLE),
        ),
        tuple(rows),
        f"E_C is divided by the area of the image, whose size is free here. Angles can be compared "
        f"with those of disks, but a free boundary makes the problem easier. Solves: {policy}.",
    )
