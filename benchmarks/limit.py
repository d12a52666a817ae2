"""How far from the limit are CEM and direct CEM, and how do they grow?"""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

from benchmarks.measuring import (
    exponent,
    in_fresh_process,
    in_turns,
    medians,
    progress,
    read_surface,
)
from benchmarks.pages import Section, Table

METHODS = ("cem, 2 iterations", "cem", "direct-cem", "direct-cem, own weights")
FLOORS = ("limit", "boundary last")
CLOCKS = {"wall": "seconds of the clock", "cpu": "CPU seconds"}
RATIOS = f"""
| surface (boundary) | triangles | limit, s | boundary last |{
    "".join(f" {name} / limit |" for name in METHODS)
}
{"|---" * (4 + len(METHODS))}|
| {{surface}} ({{boundary:,}}) | {{faces:,}} | {{seconds[limit]:.4g}} | {{ratios[boundary last]:.2f}} |{
    "".join(f" {{ratios[{name}]:.2f}} ({{iterations[{name}]}}) |" for name in METHODS)
}"""  # noqa: E501


def limit(
    surfaces: Sequence[str] = ("20000", "190000", "1700000"),
    *,
    rounds: int = 5,
    clock: Literal["wall", "cpu"] = "wall",
) -> Section:
    """Compare CEM and direct CEM with what no direct method can do without.

    The *limit* is ordering, analysis and factorisation of the pinned Laplacian as a whole, in its
    own fill-reducing order, and one solve with two columns. The second figure is the same with the
    boundary kept last, which the methods here need, and which is dearer: a floor that contains the
    design it should judge. Per surface one fresh process with one thread measures all in turns.
    Quote the ratios, medians of those within rounds. Where the time goes is the study `phases`.

    A surface is a mesh file, FILE@2 with every triangle split into four twice, or a number: a
    spherical cap with so many triangles. With `--clock cpu` the process's CPU seconds are counted.
    """
    rows = [in_fresh_process(measure, one, rounds, clock) for one in progress(surfaces)]
    how = f"Medians of {rounds} rounds, {CLOCKS[clock]}, one thread."
    return Section([*tables(rows), how], "docs/speed.md")


def tables(rows: list[dict[str, Any]]) -> list[Table | str]:
    """Return the ratios, and how the cost grows."""
    parts: list[Table | str] = [Table(rows, RATIOS), "In brackets: iterations."]
    if len({one["faces"] for one in rows}) > 1:
        grown = ", ".join(f"{exponent(rows, name):.3f} ({name})" for name in [*FLOORS, *METHODS])
        parts.append(f"Cost grows as triangles to the power {grown}.")
    return parts


def measure(name: str, rounds: int, clock: str) -> dict[str, Any]:
    """Measure one surface; seconds are medians over rounds, ratios medians of ratios in a round."""
    import numpy as np
    from cembench.algorithms.cem import cem
    from cembench.algorithms.direct_cem.disk import direct_cem

    from cembench.conformal.laplacian import by_rows, laplacian
    from cembench.linear_algebra.cholesky import Cholesky, linear_algebra
    from cembench.linear_algebra.lower_triangle import permuted_lower

    mesh = read_surface(name)
    order = np.concatenate([mesh.interior, mesh.boundary])[:-1]
    pinned = permuted_lower(by_rows(laplacian(mesh)), order)
    b = np.random.default_rng(0).standard_normal((len(order), 2))
    calls = {
        "limit": lambda: Cholesky(pinned, lower=True).solve(b),
        "boundary last": lambda: Cholesky(pinned, leading=len(mesh.interior), lower=True).solve(b),
        "cem, 2 iterations": lambda: cem(
            mesh.fresh(), tolerance=0, max_iterations=2, stop="change"
        ),
        "cem": lambda: cem(mesh.fresh()),
        "direct-cem": lambda: direct_cem(mesh.fresh()),
        "direct-cem, own weights": lambda: direct_cem(mesh.fresh(), delaunay=False),
    }
    with linear_algebra():
        # The first call warms up.
        iterations = {key: getattr(call(), "iterations", None) for key, call in calls.items()}
        seconds = time.process_time if clock == "cpu" else time.perf_counter
        timings = in_turns(calls, rounds, clock=seconds, warm_up=0)
    return {
        "surface": Path(name).name,
        "faces": mesh.m,
        "boundary": len(mesh.boundary),
        **medians(timings, over="limit"),
        "iterations": iterations,
    }
