"""What does a default under a permissive licence cost: SuperLU instead of CHOLMOD?"""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from time import process_time
from typing import Any

from benchmarks.measuring import in_fresh_process, progress, read_surface
from benchmarks.pages import Section, Table

PAGE = "docs/installing.md"
LAYOUT = """
| triangles | algorithm | seconds: SuperLU / CHOLMOD | entries of the factor | maps differ by |
|---:|---|---:|---:|---:|
| {faces:,} | `{algorithm}` | {seconds:.1f} | {entries:.2f} | {distance:.0e} |
"""


def compared(surface: str, algorithm: str, rounds: int) -> dict[str, Any]:
    """Compare the two on a surface, in turns: processor seconds, entries of factors, maps."""
    import numpy as np

    from cembench.linear_algebra.cholesky import linear_algebra
    from cembench.linear_algebra.work import counting
    from cembench.registry import load_registry

    mesh, function = read_surface(surface), load_registry().algorithm(algorithm).function
    maps, entries, ratios = {}, {}, []
    for number in range(rounds + 1):  # the first one to warm up
        seconds = {}
        for backend in ("cvxopt", "superlu"):
            with linear_algebra(backend=backend), counting() as work:
                begun = process_time()
                maps[backend] = function(mesh.fresh()).uv
                seconds[backend] = process_time() - begun
            entries[backend] = work.entries
        if number:
            ratios.append(seconds["superlu"] / seconds["cvxopt"])
    return {
        "faces": mesh.m,
        "algorithm": algorithm,
        "seconds": median(ratios),
        "entries": entries["superlu"] / entries["cvxopt"],
        "distance": float(np.abs(maps["superlu"] - maps["cvxopt"]).max()),
    }


def back_ends(
    surfaces: Sequence[str] = ("10000", "100000", "500000"),
    *,
    algorithms: Sequence[str] = ("harmonic-circle", "cem", "direct-cem"),
    rounds: int = 5,
) -> Section:
    """Compare SuperLU, the back end without cvxopt, with CHOLMOD in turns.

    A surface is a mesh file, or the number of triangles of a spherical cap. Seconds are those of
    the processor, medians of ratios within rounds, after one to warm up; one thread.
    """
    pairs = [(surface, algorithm) for surface in surfaces for algorithm in algorithms]
    rows = [in_fresh_process(compared, *pair, rounds) for pair in progress(pairs)]
    return Section([Table(rows, LAYOUT)], page=PAGE)
