"""How far from the limit are CEM and direct CEM, how do they grow, and where does the time go?"""

from __future__ import annotations

import time
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any, Literal

from benchmarks.measuring import (
    exponent,
    in_fresh_process,
    in_turns,
    medians,
    progress,
    read_surface,
)
from benchmarks.pages import Section, Table

if TYPE_CHECKING:
    from cembench.core.clock import Timing

METHODS = ("cem, 2 iterations", "cem", "direct-cem", "direct-cem, own weights")
FLOORS = ("limit", "boundary last")
CLOCKS = {"wall": "seconds of the clock", "cpu": "CPU seconds"}
FACTORISATION = ("ordering", "symbolic", "factorisation")
NUMBERS = ("factorisation", "solves")
#: Phases that take a smaller share of a call are left out.
LEAST_SHARE = 0.02
RATIOS = f"""
| surface (boundary) | triangles | limit, s | boundary last |{
    "".join(f" {name} / limit |" for name in METHODS)
}
{"|---" * (4 + len(METHODS))}|
| {{surface}} ({{boundary:,}}) | {{faces:,}} | {{seconds[limit]:.4g}} | {{ratios[boundary last]:.2f}} |{
    "".join(f" {{ratios[{name}]:.2f}} ({{iterations[{name}]}}) |" for name in METHODS)
}"""  # noqa: E501
PHASES = """
| surface | method | peak GiB | phases, % |
|---|---|---|---|
| {surface} | {method} | {peak_gib:.2f} | {phases} |"""

#: Direct CEM with CEM's weights over other methods, and over the work that each of them needs.
DIRECT = """
| surface | own weights, s | / cem, 2 iterations | / cem | / one factorisation | cem, 2 iterations \
/ numbers and solve |
|---|---:|---:|---:|---:|---:|
| {surface} | {seconds[direct-cem, own weights]:.4g} | {direct[cem, 2 iterations]:.2f} \
| {direct[cem]:.2f} | {direct[factorisation]:.2f} | {over_numbers:.2f} |"""


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
    Quote the ratios, medians of those within rounds. Direct CEM with the weights that CEM has is
    also compared with CEM and with one factorisation (ordering, analysis, numbers), and CEM with
    the numeric factorisation and the solve alone, all with the boundary last.

    A surface is a mesh file, FILE@2 with every triangle split into four twice, or a number: a
    spherical cap with so many triangles. With `--clock cpu` the process's CPU seconds are counted.
    """
    rows = [in_fresh_process(measure, one, rounds, clock) for one in progress(surfaces)]
    how = f"Medians of {rounds} rounds, {CLOCKS[clock]}, one thread."
    return Section([*tables(rows), how], "docs/speed.md")


def tables(rows: list[dict[str, Any]]) -> list[Table | str]:
    """Return the ratios, the phases of each method, and how the cost grows."""
    phases = [
        {
            "surface": one["surface"],
            "method": name,
            "peak_gib": one["peak_gib"][name],
            "phases": _shares(one["phases"][name]),
        }
        for one in rows
        for name in METHODS
    ]
    parts = [Table(rows, RATIOS), "In brackets: iterations.", Table(phases, PHASES)]
    parts.append(Table(rows, DIRECT))
    if len({one["faces"] for one in rows}) > 1:
        grown = ", ".join(f"{exponent(rows, name):.3f} ({name})" for name in [*FLOORS, *METHODS])
        parts.append(f"Cost grows as triangles to the power {grown}.")
    return parts


def _shares(phases: dict[str, float]) -> str:
    shares = {name: seconds / sum(phases.values()) for name, seconds in phases.items()}
    largest = sorted(shares, key=lambda name: -shares[name])
    return ", ".join(f"{k} {100 * shares[k]:.0f}" for k in largest if shares[k] > LEAST_SHARE)


def _of_phases(timing: Timing, names: Collection[str]) -> Timing:
    phases = {name: timing.phases.get(name, 0.0) for name in names}
    return replace(timing, total=sum(phases.values()), phases=phases)


def measure(name: str, rounds: int, clock: str) -> dict[str, Any]:
    """Measure one surface; seconds are medians over rounds, ratios medians of ratios in a round."""
    import numpy as np
    from cembench.algorithms.cem import cem
    from cembench.algorithms.direct_cem.disk import direct_cem

    from cembench.conformal.laplacian import by_rows, laplacian
    from cembench.linear_algebra.cholesky import Cholesky, linear_algebra
    from cembench.linear_algebra.lower_triangle import permuted_lower
    from cembench.running.memory import memory_of_call

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
    peaks, iterations = {}, {}
    with linear_algebra():
        for key, call in calls.items():  # the first call warms up, and shows its memory
            result, memory = memory_of_call(call)
            peaks[key] = None if memory.peak is None else memory.peak / 2**30
            iterations[key] = getattr(result, "iterations", None)
            del result
        seconds = time.process_time if clock == "cpu" else time.perf_counter
        timings = in_turns(calls, rounds, clock=seconds, warm_up=0)
    direct, two = "direct-cem, own weights", "cem, 2 iterations"
    numbers, factorisation = (
        [_of_phases(one, names) for one in timings["boundary last"]]
        for names in (NUMBERS, FACTORISATION)
    )
    over_direct = medians({**timings, "factorisation": factorisation}, over=direct)["ratios"]
    return {
        "surface": Path(name).name,
        "faces": mesh.m,
        "boundary": len(mesh.boundary),
        **medians(timings, over="limit"),
        "direct": {key: 1 / ratio for key, ratio in over_direct.items()},
        "over_numbers": median(
            a.total / b.total for a, b in zip(timings[two], numbers, strict=True)
        ),
        "peak_gib": peaks,
        "phases": {key: many[-1].phases for key, many in timings.items()},
        "iterations": iterations,
    }
