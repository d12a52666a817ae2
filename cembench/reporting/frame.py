"""Records as flat rows: the one place where a table's columns come from."""

from __future__ import annotations

from typing import Any

from cembench.records import Record


def row(record: Record) -> dict[str, Any]:
    """One record as one flat row; the metrics stand under their own names."""
    cell, outcome = record.cell, record.outcome
    return {
        "mesh": cell.mesh,
        "algorithm": cell.algorithm,
        "title": record.title,
        "target": record.target,
        "parameters": cell.parameters,
        "status": outcome.status,
        "cause": outcome.cause,
        **outcome.metrics,
        "iterations": outcome.iterations,
        "seconds": outcome.median_seconds,
        "seconds_raw": list(outcome.seconds),
        "phases": outcome.phases,
        "peak_memory_bytes": outcome.peak_memory_bytes,
        "energy_history": list(outcome.energy_history),
        "extras": outcome.extras,
        "vertices": record.mesh.vertices,
        "faces": record.mesh.faces,
        "boundary_vertices": record.mesh.boundary_vertices,
        "non_delaunay_share": record.mesh.non_delaunay_share,
        "notices": list(record.mesh.notices),
        "solves": cell.solves,
        "backend": cell.backend,
        "threads": cell.threads,
        "mesh_hash": cell.mesh_hash,
        "environment": record.environment,
        "key": cell.key,
    }
