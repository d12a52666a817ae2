"""What METIS gives on large surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.measuring import in_fresh_process, progress, read_surface
from benchmarks.pages import Section, Table
from cembench.linear_algebra.backends import available_backends

ORDERS = {"cvxopt": "AMD", "cvxopt-metis": "METIS"}
PHASES = ("ordering", "symbolic", "factorisation")
LAYOUT = """
| surface | triangles | order of rows | seconds | ordering, analysis, factorisation \
| entries of the factor, M | peak GiB |
|---|---:|---|---:|---:|---:|---:|
| {surface} | {faces:,} | {order} | {seconds:.3g} | {factoring:.3g} \
| {million_entries:.0f} | {peak_gib:.2f} |"""


def large_surfaces(
    surfaces: Sequence[str] = ("1000000",), *, algorithm: str = "direct-cem", rounds: int = 3
) -> Section:
    """Measure what METIS gives on large surfaces.

    Every round is a fresh process that calls one algorithm once, after a small surface has warmed
    up the libraries. Surfaces are named as in `limit`.
    """
    orders = [one for one in ORDERS if one in available_backends()]
    rows = []
    for surface in progress(surfaces):
        runs = [
            {one: in_fresh_process(measure, surface, one, algorithm) for one in orders}
            for _ in range(rounds)
        ]
        rows += [row(surface, order, [one[order] for one in runs]) for order in orders]
    how = f"Medians of {rounds} processes with one call of `{algorithm}`."
    return Section([Table(rows, LAYOUT), how], "docs/speed.md")


def row(surface: str, backend: str, runs: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the medians of a surface's processes with one order of rows."""
    return {
        "surface": "spherical cap" if surface.isdigit() else Path(surface).name,
        "order": ORDERS[backend],
        **runs[-1],
        **{key: median(run[key] for run in runs) for key in ("seconds", "factoring")},
    }


def measure(surface: str, backend: str, algorithm: str) -> dict[str, Any]:
    """Call an algorithm once on a surface; return its seconds, fill and memory."""
    from cembench.core.clock import measure as timed
    from cembench.linear_algebra.cholesky import linear_algebra
    from cembench.linear_algebra.work import counting
    from cembench.registry import load_registry
    from cembench.running.memory import memory_of_call

    call = load_registry().algorithm(algorithm).function
    mesh = read_surface(surface)
    with linear_algebra(backend=backend), counting() as work:
        call(read_surface("2000"))
        (_, timing), memory = memory_of_call(lambda: timed(lambda: call(mesh)))
    return {
        "faces": mesh.m,
        "seconds": timing.total,
        "factoring": sum(timing.phases.get(phase, 0.0) for phase in PHASES),
        "million_entries": work.entries / 1e6,
        "peak_gib": (memory.peak or 0) / 2**30,
    }
