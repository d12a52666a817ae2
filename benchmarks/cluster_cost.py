"""What does a cell cost on a cluster? ``python -m benchmarks.cluster_cost``.

Cells of algorithms that are never called go through two workers of this machine, and through the
local runner. Told are CPU seconds of all processes that take part: they hang on what else the
machine does much less than the clock.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import psutil
from cembench.surfaces.flat_disk import flat_disk

from benchmarks.empty_algorithms import COUNT
from cembench.registry import load_registry
from cembench.results.store import Store
from cembench.running.cluster.client import run_on_cluster
from cembench.running.cluster.connect import connected, parse_cluster
from cembench.running.local import run_tasks
from cembench.running.plan import MeasurementSettings, Task, plan_cells

PLUGIN = str(Path(__file__).with_name("empty_algorithms.py"))


def main() -> None:
    """Print milliseconds of CPU time a cell, on a cluster and without."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=2000)
    count = parser.parse_args().cells
    tasks = _tasks(count // COUNT, "s")
    with tempfile.TemporaryDirectory() as folder, connected(parse_cluster("local:2")) as client:
        place = Path(folder)
        # What a process does once: imports, and the other worker's start.
        run_on_cluster(_tasks(4, "first"), Store(place / "first"), client)
        before = _cpu_seconds()
        run_on_cluster(tasks, Store(place / "there"), client)
        there = _cpu_seconds() - before
        before = _cpu_seconds()
        run_tasks(tasks, Store(place / "here"))
        here = _cpu_seconds() - before
    cells = len(tasks)
    print(
        f"{cells} empty cells: {1000 * there / cells:.1f} ms of CPU time a cell by two workers, "
        f"{1000 * here / cells:.1f} ms by the local runner, {1000 * (there - here) / cells:.1f} ms "
        "more"
    )


def _tasks(surfaces: int, name: str) -> list[Task]:
    registry = load_registry([PLUGIN])
    chosen = [registry.algorithm(f"empty-{k}") for k in range(COUNT)]
    meshes = [flat_disk(600 + 10 * k).renamed(f"{name}-{k}") for k in range(surfaces)]
    return plan_cells(chosen, meshes, {}, MeasurementSettings(), [PLUGIN])


def _cpu_seconds() -> float:
    """CPU seconds of this process and all below it, those that have ended included."""
    this = psutil.Process()
    return sum(sum(one.cpu_times()[:4]) for one in (this, *this.children(recursive=True)))


if __name__ == "__main__":
    main()
