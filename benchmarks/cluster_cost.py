"""What does a cell cost on a cluster?"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import process_time

import psutil
from cembench.surfaces.flat_disk import flat_disk

from benchmarks.empty_algorithms import COUNT
from benchmarks.pages import Section, Table
from cembench.registry import load_registry
from cembench.results.records import Record
from cembench.results.store import Store
from cembench.running.cluster.client import run_on_cluster
from cembench.running.cluster.connect import connected, parse_cluster
from cembench.running.local import run_tasks
from cembench.running.plan import MeasurementSettings, Task, plan_cells
from cembench.running.reference_kernel import kernel_seconds

PLUGIN = str(Path(__file__).with_name("empty_algorithms.py"))
LAYOUT = """
| empty cells | ms of CPU time a cell by two workers | by the local runner | more | of which \
each surface's own reference kernels |
|---:|---:|---:|---:|---:|
| {cells} | {workers:.1f} | {local:.1f} | {more:.1f} | {kernels:.1f} |"""


def cluster_cost(*, cells: int = 2000) -> Section:
    """Measure what a cell costs on a cluster, in CPU seconds.

    Cells of algorithms that are never called go through two workers of this machine, and through
    the local runner. CPU seconds of all processes that take part depend on the machine's other work
    much less than the clock. A unit is a sitting of its own, so its rounds have their own reference
    kernel; the local runner has one for the rounds of all cells. What that makes is given too.
    """
    tasks = _tasks(cells // COUNT, "s")
    with tempfile.TemporaryDirectory() as folder, connected(parse_cluster("local:2")) as client:
        place = Path(folder)
        # What a process does once: imports, and the other worker's start.
        run_on_cluster(_tasks(4, "first"), Store(place / "first"), client)
        before = _cpu_seconds()
        records = run_on_cluster(tasks, Store(place / "cluster"), client)
        cluster = _cpu_seconds() - before
        before = _cpu_seconds()
        alone = run_tasks(tasks, Store(place / "local"))
        local = _cpu_seconds() - before
    kernels = _kernels(records, COUNT) - _kernels(alone, len(tasks))
    seconds = {"workers": cluster, "local": local, "more": cluster - local, "kernels": kernels}
    each = {name: 1000 * one / len(tasks) for name, one in seconds.items()}
    return Section([Table([{"cells": len(tasks), **each}], LAYOUT)], "docs/cluster.md")


def _tasks(surfaces: int, name: str) -> list[Task]:
    registry = load_registry([PLUGIN])
    chosen = [registry.algorithm(f"empty-{k}") for k in range(COUNT)]
    meshes = [flat_disk(600 + 10 * k).renamed(f"{name}-{k}") for k in range(surfaces)]
    return plan_cells(chosen, meshes, {}, MeasurementSettings(), [PLUGIN])


def _kernels(records: Sequence[Record], processes: int) -> float:
    """CPU seconds of the reference kernels of rounds of `processes`, by what they take now."""
    count = len({(r.sitting, r.kernel_seconds) for one in records for r in one.outcome.rounds})
    began = process_time()
    for _ in range(10):
        kernel_seconds(processes)
    return count * (process_time() - began) / 10


def _cpu_seconds() -> float:
    """CPU seconds of this process and all below it, those that have ended included."""
    this = psutil.Process()
    return sum(sum(one.cpu_times()[:4]) for one in (this, *this.children(recursive=True)))
