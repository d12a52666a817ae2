"""Records as flat rows, the source of all table columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cembench.results.comparison import (
    Comparison,
    circumstances,
    compare,
    compare_cpu,
    is_unstable,
    references,
    seconds_interval,
)
from cembench.results.many import corrected
from cembench.results.records import Record

#: Default reference algorithm for speedups, as in the paper's Table 2.
REFERENCE = "cem"


def rows(records: Sequence[Record], reference: str = REFERENCE) -> list[dict[str, Any]]:
    """Return all records of a run as flat rows, each compared with the reference on its surface.

    `verdict` is for each comparison alone; `verdict_corrected` is corrected for all rows (Holm),
    and so is `p`.
    """
    compared = against_reference(records, reference)
    together = iter(corrected([found for _, found in compared if found is not None]))
    told = []
    for record, (base, found) in zip(records, compared, strict=True):
        cpu = compare_cpu(record, base) if base is not None and found is not None else None
        both = next(together) if found is not None else None
        told.append(row(record) | _compared(base, found, both, cpu))
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
    """Return the columns of the speedup of the reference (Eq. 33) and its verdicts."""
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
    """Return a record as a flat row; metrics are under their own names.

    `seconds_raw` holds the figure of each round, `seconds_calls` every timed call by round.
    """
    cell, outcome = record.cell, record.outcome
    interval = seconds_interval(record)
    return {
        "mesh": cell.mesh,
        "algorithm": cell.algorithm,
        "title": record.title,
        "target": record.target,
        "external": record.external.kind if record.external else None,
        "external_name": record.external.name if record.external else None,
        "external_version": outcome.program.version if outcome.program else None,
        "parameters": cell.parameters,
        "status": outcome.status,
        "cause": outcome.cause,
        **outcome.metrics,
        "folded_before_repair": outcome.folded_before_repair,
        "boundaries": [boundary.model_dump() for boundary in outcome.boundaries],
        "iterations": outcome.iterations,
        "seconds": outcome.median_seconds,
        "seconds_raw": list(outcome.seconds),
        "seconds_low": interval.low if interval else None,
        "seconds_high": interval.high if interval else None,
        "seconds_min": min((min(r.calls) for r in outcome.rounds), default=None),
        "seconds_calls": [list(r.calls) for r in outcome.rounds],
        "unstable": is_unstable(record),
        "ended": outcome.ended,
        "cpu_seconds": outcome.cpu_seconds,
        "busy_rounds": sum(bool(r.neighbours and r.neighbours.busy) for r in outcome.rounds),
        "start_seconds": outcome.start_seconds,
        "own_seconds": outcome.own_seconds,
        "solve_seconds": outcome.solve_seconds if record.is_program else None,
        "input_bytes": outcome.program.input_bytes if outcome.program else None,
        "output_bytes": outcome.program.output_bytes if outcome.program else None,
        "phases": outcome.phases,
        "factorisations": outcome.work.numeric if outcome.work else None,
        "analyses": outcome.work.symbolic if outcome.work else None,
        "right_hand_sides": outcome.work.right_hand_sides if outcome.work else None,
        "matrix_order": outcome.work.order if outcome.work else None,
        "factor_entries": outcome.work.entries if outcome.work else None,
        "peak_memory_bytes": outcome.peak_memory_bytes,
        "memory_increase_bytes": outcome.memory_increase_bytes,
        "notes": [str(note) for note in outcome.notes],
        "energy_history": list(outcome.energy_history),
        "extras": outcome.extras,
        "vertices": record.mesh.vertices,
        "faces": record.mesh.faces,
        "boundary_vertices": record.mesh.boundary_vertices,
        "non_delaunay_share": record.mesh.non_delaunay_share,
        "notices": [str(notice) for notice in record.mesh.notices],
        "origin": record.mesh.origin,
        "paper_row": record.mesh.paper_row or None,
        "solves": cell.solves,
        "backend": cell.backend,
        "threads": cell.threads,
        "mesh_hash": cell.mesh_hash,
        "repeats": cell.repeats or None,
        "precision": cell.precision,
        "rounds": len(outcome.rounds),
        "environment": record.environment,
        "started_at": record.started_at,
        "key": cell.key,
    }
