"""Records as flat rows, the source of all table columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cembench.results.columns import EXPORTED, FIGURES
from cembench.results.comparison import (
    Comparison,
    circumstances,
    compare,
    compare_cpu,
    paired_ratios,
    references,
)
from cembench.results.multiple_testing import corrected
from cembench.results.records import REFERENCE, Record

_METRICS = frozenset(metric.name for metric in FIGURES)


def rows(records: Sequence[Record], reference: str = REFERENCE) -> list[dict[str, Any]]:
    """Return all records of a run as flat rows, each compared with the reference on its surface.

    `verdict` is for each comparison alone; `verdict_corrected` is corrected for all rows (Holm),
    and so is `p`. `ratios` are those to the reference's seconds that decide, one for each round.
    """
    compared = against_reference(records, reference)
    together = iter(corrected([found for _, found in compared if found is not None]))
    told = []
    for record, (base, found) in zip(records, compared, strict=True):
        cpu = compare_cpu(record, base) if base is not None and found is not None else None
        both = next(together) if found is not None else None
        ratios = paired_ratios(record, base) if base is not None and found is not None else []
        told.append(row(record) | _compared(base, found, both, cpu) | {"ratios": ratios})
    return told


def against_reference(
    records: Sequence[Record], reference: str = REFERENCE
) -> list[tuple[Record | None, Comparison | None]]:
    """Return the reference and the comparison for each record; None if there is none."""
    known = references(records, reference)
    told: list[tuple[Record | None, Comparison | None]] = []
    for record in records:
        base = known.get(circumstances(record.cell))
        other = base is not None and base.cell.algorithm != record.cell.algorithm
        told.append((base, compare(record, base) if other and base is not None else None))
    return told


def _compared(
    reference: Record | None,
    found: Comparison | None,
    together: Comparison | None,
    cpu: Comparison | None,
) -> dict[str, Any]:
    """Return the columns of the speedup of the reference and its verdicts."""
    interval = found.speedup_interval if found else None
    cpu_interval = cpu.interval if cpu else None
    return {
        "reference": reference.cell.algorithm if found and reference else None,
        "speedup": found.speedup if found else None,
        "speedup_low": interval.low if interval else None,
        "speedup_high": interval.high if interval else None,
        "verdict": found.verdict if found else None,
        "verdict_corrected": together.verdict if together else None,
        "p": together.p if together else None,
        "cpu_ratio": cpu.ratio if cpu else None,
        "cpu_ratio_low": cpu_interval.low if cpu_interval else None,
        "cpu_ratio_high": cpu_interval.high if cpu_interval else None,
    }


def row(record: Record) -> dict[str, Any]:
    """Return a record as a flat row (:mod:`cembench.results.columns`).

    A metric that the record does not have is left out; one that is infinite is None. `seconds_raw`
    holds the figure of each round, `seconds_calls` every timed call by round.
    """
    metrics = record.outcome.metrics
    found = {
        column.name: column.of(record)
        for column in EXPORTED
        if column.name in metrics or column.name not in _METRICS
    }
    return found | metrics
