"""How much do the seconds of processes scatter, with memory as in timed processes and as usual?

Starts new processes in turns, with the allocator's settings of :data:`ALLOCATOR` and without, each
timing CEM several times on one surface after two calls to warm up. The spread is the standard
deviation of the logarithms of the processes' medians. Nothing else should run on the machine::

    python -m benchmarks.allocator --write-docs
    python -m benchmarks.allocator surface.ply --processes 50

A number is a spherical cap with so many triangles. ``--write-docs`` puts the table into
docs/measuring.md.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from math import log
from pathlib import Path

from benchmarks.limit import from_anywhere, read_surface
from benchmarks.pages import ROOT, fill
from cembench.running.environment import ALLOCATOR_VARIABLE, for_measuring

SURFACES = ["5000", "35000", "100000"]
WAYS = ("usual", "as timed here")
WARM_UP = 2


def main() -> None:
    """Time the processes of each surface, and print or write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("surfaces", nargs="*", default=SURFACES, help="mesh files, faces of a cap")
    parser.add_argument("--processes", type=int, default=15, help="of each kind, at least two")
    parser.add_argument("--calls", type=int, default=5, help="timed in each process")
    parser.add_argument("--write-docs", action="store_true")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.one:
        print(json.dumps(timed_calls(chosen.one, chosen.calls)))
        return
    lines = ["| surface | memory | fastest, ms | median | slowest | spread |"]
    lines.append("|---|---|---:|---:|---:|---:|")
    for surface in chosen.surfaces:
        medians: dict[str, list[float]] = {name: [] for name in WAYS}
        for _ in range(chosen.processes):
            for name in WAYS:
                medians[name].append(process_median(surface, chosen.calls, usual=name == WAYS[0]))
        for name, seconds in medians.items():
            lines.append(f"| {Path(surface).name} | {name} | {told(seconds)} |")
            print(lines[-1], flush=True)
    how = f"CEM, {chosen.processes} processes of each kind in turns, {chosen.calls} calls in each. "
    how += "A number is a spherical cap of so many triangles."
    if chosen.write_docs:
        fill(ROOT / "docs/measuring.md", "allocator", "\n".join([*lines, "", how]))


def process_median(surface: str, calls: int, *, usual: bool) -> float:
    """Return the median seconds of the calls of a new process."""
    command = [sys.executable, "-m", "benchmarks.allocator", "--one", from_anywhere(surface)]
    command += ["--calls", str(calls)]
    environment = for_measuring(1)
    if usual:
        del environment[ALLOCATOR_VARIABLE]
    run = subprocess.run(
        command, capture_output=True, text=True, env=environment, cwd=ROOT, check=True
    )
    return statistics.median(json.loads(run.stdout))


def told(seconds: list[float]) -> str:
    """Return the cells of the table for the medians of some processes."""
    spread = statistics.stdev(map(log, seconds))
    places = min(seconds), statistics.median(seconds), max(seconds)
    return " | ".join([*(f"{1000 * one:.3g}" for one in places), f"{spread:.1%}"])


def timed_calls(surface: str, calls: int) -> list[float]:
    """Return the seconds of so many calls of CEM in this process."""
    from cembench.algorithms.cem import cem

    from cembench.core.clock import measure
    from cembench.linear_algebra.cholesky import linear_algebra

    mesh = read_surface(surface)
    with linear_algebra():
        found = [measure(lambda: cem(mesh.fresh()))[1].total for _ in range(WARM_UP + calls)]
    return found[WARM_UP:]


if __name__ == "__main__":
    main()
