"""How much do the seconds of processes scatter, with memory as in timed processes and as usual?"""

from __future__ import annotations

from collections.abc import Sequence
from math import log
from pathlib import Path
from statistics import median, stdev
from typing import Any

from benchmarks.measuring import in_fresh_process, in_turns, progress, read_surface
from benchmarks.pages import Section, Table
from cembench.running.environment import ALLOCATOR_VARIABLE

#: The ways to handle memory, and what is taken out of the environment for each.
WAYS: dict[str, tuple[str, ...]] = {"usual": (ALLOCATOR_VARIABLE,), "as timed here": ()}
LAYOUT = """
| surface | memory | fastest, ms | median | slowest | spread |
|---|---|---:|---:|---:|---:|
| {surface} | {memory} | {fastest:.3g} | {median:.3g} | {slowest:.3g} | {spread:.1%} |"""


def allocator(
    surfaces: Sequence[str] = ("5000", "35000", "100000"), *, processes: int = 15, calls: int = 5
) -> Section:
    """Compare how the seconds of processes scatter with two ways to handle memory.

    Starts new processes in turns, with the allocator's settings of timed processes and without,
    each timing CEM several times on one surface after two calls to warm up. The spread is the
    standard deviation of the logarithms of the processes' medians. Nothing else should run on the
    machine. Surfaces are named as in `limit`.
    """
    rows = []
    for surface in progress(surfaces):
        pairs = [
            {way: median(in_fresh_process(measure, surface, calls, without=without))
             for way, without in WAYS.items()}
            for _ in range(processes)
        ]  # fmt: skip
        rows += [row(surface, way, [pair[way] for pair in pairs]) for way in WAYS]
    how = f"CEM, {processes} processes of each kind in turns, {calls} calls in each. "
    how += "A number is a spherical cap of so many triangles."
    return Section([Table(rows, LAYOUT), how], "docs/measuring_details.md")


def row(surface: str, way: str, seconds: list[float]) -> dict[str, Any]:
    """Return a row of the table for the medians of some processes."""
    places = {"fastest": min(seconds), "median": median(seconds), "slowest": max(seconds)}
    return {
        "surface": Path(surface).name,
        "memory": way,
        **{name: 1000 * one for name, one in places.items()},
        "spread": stdev(map(log, seconds)),
    }


def measure(surface: str, calls: int) -> list[float]:
    """Return the seconds of several calls of CEM in this process."""
    from cembench.algorithms.cem import cem

    from cembench.linear_algebra.cholesky import linear_algebra

    mesh = read_surface(surface)
    with linear_algebra():
        timings = in_turns({"cem": lambda: cem(mesh.fresh())}, calls, warm_up=2)
    return [one.total for one in timings["cem"]]
