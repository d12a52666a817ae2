"""Records as flat rows: the one place where a table's columns come from."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from cembench.results.comparison import (
    circumstances,
    compare,
    is_unstable,
    references,
    seconds_interval,
)
from cembench.results.records import Record

#: Whose times the others' are compared with, as in the paper's Table 2.
REFERENCE = "cem"


def rows(records: Sequence[Record], reference: str = REFERENCE) -> list[dict[str, Any]]:
    """All records of a run as flat rows, each compared with the reference on its surface."""
    known = references(records, reference)
    return [row(r) | _compared(r, known.get(circumstances(r.cell))) for r in records]


def _compared(record: Record, reference: Record | None) -> dict[str, Any]:
    """Speedup of the reference over this record's algorithm (Eq. 33), and the verdict on this."""
    found = None
    if reference is not None and reference.cell.algorithm != record.cell.algorithm:
        found = compare(record, reference)
    interval = found.speedup_interval if found else None
    return {
        "reference": reference.cell.algorithm if found and reference else None,
        "speedup": found.speedup if found else None,
        "speedup_low": interval.low if interval else None,
        "speedup_high": interval.high if interval else None,
        "verdict": found.verdict if found else None,
    }


def row(record: Record) -> dict[str, Any]:
    """One record as one flat row; the metrics stand under their own names.

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
        "boundaries": [boundary.model_dump() for boundary in outcome.boundaries],
        "iterations": outcome.iterations,
        "seconds": outcome.median_seconds,
        "seconds_raw": list(outcome.seconds),
        "seconds_low": interval.low if interval else None,
        "seconds_high": interval.high if interval else None,
        "seconds_min": min((min(r.calls) for r in outcome.rounds), default=None),
        "seconds_calls": [list(r.calls) for r in outcome.rounds],
        "unstable": is_unstable(record),
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
        "repeats": cell.repeats,
        "environment": record.environment,
        "started_at": record.started_at,
        "key": cell.key,
    }
