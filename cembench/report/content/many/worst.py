"""The worst map of each algorithm, and the hardest surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf

import numpy as np

from cembench.report.content.evidence import ANGLE, Evidence, MeasuredSurface, figure
from cembench.report.content.inspection import Inspection
from cembench.report.content.many.difficulty import best_record
from cembench.report.content.many.success import records_of
from cembench.report.document import Column, Gallery, Table, Value, count, missing, words

#: Number of surfaces shown.
HARDEST = 10


def hardest(evidence: Evidence, policy: str) -> tuple[MeasuredSurface, ...]:
    """Return the surfaces with the largest angle errors of the best map, worst first.

    Surfaces without any map come first.
    """

    def error(surface: MeasuredSurface) -> float:
        best = best_record(evidence, surface, policy)
        found = None if best is None else best.outcome.metrics.get(ANGLE)
        return inf if found is None else float(found)

    return tuple(sorted(evidence.surfaces, key=error, reverse=True)[:HARDEST])


def spread_table(evidence: Evidence, policy: str) -> Table:
    """Return the median, 90th percentile and maximum of angle errors, one row per algorithm."""
    rows = []
    for series in evidence.series:
        found = [
            (float(error), record)
            for record in records_of(evidence, series, policy)
            if record.outcome.status == "ok"
            and (error := record.outcome.metrics.get(ANGLE)) is not None
        ]
        if not found:
            continue
        errors = [error for error, _ in found]
        worst, where = max(found, key=lambda pair: pair[0])
        figures = (np.median(errors), np.percentile(errors, 90))
        rows.append(
            (
                words(series.label),
                count(len(found)),
                *(Value(f"{value:.2f}", float(value), "derived") for value in figures),
                Value(f"{worst:.2f}", worst, "derived", where.cell.key),
                words(where.cell.mesh),
            )
        )
    columns = (
        Column("algorithm", numeric=False),
        Column("maps"),
        *(Column(name, "mean angle error", "degrees") for name in ("median", "90 %", "worst")),
        Column("on", "mean angle error", numeric=False),
    )
    return Table(
        "spread",
        "Angle errors over the surfaces",
        columns,
        tuple(rows),
        "For valid maps only: compare the counts before the errors.",
    )


def hardest_table(evidence: Evidence, policy: str, surfaces: tuple[MeasuredSurface, ...]) -> Table:
    """Return the mean angle error, or the status, by surface (rows) and algorithm (columns)."""
    tried = [s for s in evidence.series if s.main and records_of(evidence, s, policy)]
    rows = []
    for surface in surfaces:
        cells = []
        for series in tried:
            record = evidence.find(surface, series, policy)
            error = figure(evidence, surface, series, policy, ANGLE)
            if record is None:
                cells.append(missing("not tried"))
            elif error is None or error == inf:
                cells.append(Value(record.outcome.status, why=evidence.missing_reason(record)))
            else:
                cells.append(Value(f"{error:.2f}", error, surface.origin, record.cell.key))
        rows.append(
            (words(surface.title), Value(f"{surface.faces:,}", surface.faces, "derived"), *cells)
        )
    return Table(
        "hardest",
        f"The {len(surfaces)} hardest surfaces",
        (
            Column("surface", numeric=False),
            Column("triangles"),
            *(Column(s.label, "mean angle error", "degrees") for s in tried),
        ),
        tuple(rows),
        "The surfaces whose best map has the largest angle errors (of maps to the disk where there "
        "are any); surfaces without a map come first.",
    )


def hardest_gallery(
    evidence: Evidence,
    policy: str,
    surfaces: tuple[MeasuredSurface, ...],
    inspections: Mapping[str, Inspection],
) -> Gallery | None:
    """Return the best map of each of these surfaces; None if the run saved no surface."""
    figures = []
    for surface in surfaces:
        seen = inspections.get(surface.mesh_hash)
        best = best_record(evidence, surface, policy)
        labels = [s.label for s in evidence.series if best and evidence.find(surface, s) is best]
        drawn = [seen.checkerboards[name] for name in labels if seen and name in seen.checkerboards]
        figures += drawn[:1]
    if not figures:
        return None
    return Gallery(
        "hardest-maps",
        "The hardest surfaces, each with its best map",
        tuple(figures),
        "The surface and its image under one checkerboard; folded triangles are red.",
    )
