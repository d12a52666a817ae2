"""What does it cost an honest algorithm that its surface is renumbered in blocks, not shifted?"""

from __future__ import annotations

import random
from collections.abc import Sequence
from math import log
from pathlib import Path
from statistics import median, stdev
from typing import Any

import numpy as np

from benchmarks.measuring import in_fresh_process, in_turns, progress, read_surface
from benchmarks.pages import Section, Table
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.results.comparison import ratio_interval
from cembench.running.rigid_motion import THEN, moved

LAYOUT = """
| surface | blocks / shifts | 95 % interval | scatter of pairs, shifts | blocks |
|---|---:|---|---:|---:|
| {surface} | {ratio:.3f} | {low:.3f} to {high:.3f} | {shifts:.1%} | {blocks:.1%} |"""


def renumbering(
    surfaces: Sequence[str] = ("5000", "35000", "100000"),
    *,
    algorithm: str = "cem",
    processes: int = 30,
    calls: int = 5,
) -> Section:
    """Compare seconds and their scatter on surfaces that are shifted and permuted in blocks.

    Each process times the algorithm on surfaces of either kind in turns, every call on another one.
    The ratio is that of both medians of a process; a pair is two processes, and their scatter the
    standard deviation of the logarithm of the ratio of their medians. As in a run, the processes
    of a pair get the same blocks; shifts are drawn by each. Nothing else should run on the machine.
    Surfaces are named as in `limit`.
    """
    rows = []
    for surface in progress(surfaces):
        timed = [
            in_fresh_process(measure, surface, algorithm, calls, f"{number // 2}")
            for number in range(processes)
        ]
        rows.append(row(surface, timed))
    how = f"{algorithm}, {processes} processes, {calls} calls of each kind in each. A number is a "
    return Section([Table(rows, LAYOUT), f"{how}spherical cap of so many triangles."])


def row(surface: str, timed: Sequence[dict[str, float]]) -> dict[str, Any]:
    """Return a row of the table for the medians of some processes."""
    ratios = [one["blocks"] / one["shifts"] for one in timed]
    interval = ratio_interval(ratios)
    low, high = (interval.low, interval.high) if interval else (min(ratios), max(ratios))
    pairs = list(zip(timed[::2], timed[1::2], strict=False))
    scatter = {kind: stdev(log(a[kind] / b[kind]) for a, b in pairs) for kind in timed[0]}
    return {
        "surface": Path(surface).name,
        "ratio": median(ratios),
        "low": low,
        "high": high,
    } | scatter


def measure(surface: str, algorithm: str, calls: int, pair: str) -> dict[str, float]:
    """Return the median seconds of calls on shifted surfaces, and on those in a pair's blocks."""
    from cembench.linear_algebra.cholesky import linear_algebra
    from cembench.registry import load_registry

    mesh, known = read_surface(surface), load_registry().algorithm(algorithm)
    chance = random.SystemRandom()
    kinds = {
        "shifts": lambda _: shifted(mesh, chance.getrandbits(60)),
        "blocks": lambda call: moved(mesh, f"{pair}-{call}{THEN}{chance.getrandbits(60):x}"),
    }
    seconds: dict[str, list[float]] = {kind: [] for kind in kinds}
    with linear_algebra():
        for k in range(calls + 1):
            for kind in chance.sample(list(kinds), len(kinds)):
                own = kinds[kind](k)
                timings = in_turns({kind: lambda own=own: known.function(own)}, 1, warm_up=0)
                seconds[kind] += [timings[kind][0].total] if k else []
    return {kind: median(one) for kind, one in seconds.items()}


def shifted(mesh: TriangleMesh, seed: int) -> TriangleMesh:
    """Return a surface whose vertices, triangles and corners are rotated cyclically."""
    rng = np.random.default_rng(seed)
    vertices, triangles, corners = map(int, rng.integers(0, (mesh.n, mesh.m, 3)))
    F = np.roll((mesh.F + vertices) % mesh.n, (triangles, corners), axis=(0, 1))
    return type(mesh).trusted(np.roll(mesh.V, vertices, axis=0), F, mesh.name)
