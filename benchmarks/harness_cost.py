"""What does the harness add: to the seconds it reports, and by itself?"""

from __future__ import annotations

import random
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from cembench.surfaces.spherical_cap import spherical_cap
from numpy.typing import NDArray

from benchmarks.pages import Section, Table
from cembench.registry import load_registry
from cembench.results.comparison import compare_ratios
from cembench.results.records import Outcome, Round
from cembench.results.store import Store
from cembench.running.environment import for_measuring
from cembench.running.local import run_tasks
from cembench.running.map_checks import Checked
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, Task, plan_cells
from cembench.running.timing import CellTimer

BARE = """
import sys
from statistics import median
from time import perf_counter
from cembench.algorithms.cem import cem
from cembench.surfaces.spherical_cap import spherical_cap

mesh = spherical_cap(int(sys.argv[1]))
cem(mesh.fresh())
seconds = []
while len(seconds) < 5 and sum(seconds) < 0.1:
    arrays = mesh.fresh()
    start = perf_counter()
    cem(arrays)
    seconds.append(perf_counter() - start)
print(sorted(seconds)[(len(seconds) - 1) // 2])
"""


LAYOUT = """
| seconds | ratio | 95 % interval | rounds |
|---|---:|---|---:|
| {seconds} | {ratio:.4f} | {interval} | {rounds} |"""
#: The half-width of the interval, relative, below which no more rounds are needed.
NARROW = 0.01
FEWEST_ROUNDS = 12


def harness_cost(*, faces: int = 100_000, rounds: int = 100, cells: int = 1000) -> Section:
    """Measure what the harness adds to the seconds it reports, and its own time a cell.

    1. CEM on a mesh in memory: the seconds that the harness reports over those of a bare call in a
       script (above 1 by what a renumbered surface costs), and those of a forked process over those
       of a fresh interpreter (to be 1). In each round all three are measured once, in random order,
       with one thread; the ratio is the median over the rounds, with its 95 % interval. Rounds go
       on until the interval is narrow enough, or there are as many as asked for.
    2. Planning and recording cells whose processes are not started; 1,000 are to be under a minute.
    """
    rows = []
    for name, ratios in measure_ratios(faces, rounds).items():
        comparison = compare_ratios(ratios)
        i = comparison.interval
        between = f"{i.low:.4f} to {i.high:.4f}" if i else "unknown"
        rows.append({"seconds": name, "ratio": comparison.ratio, "interval": between,
                     "rounds": len(ratios)})  # fmt: skip
    planning, recording = empty_cells(cells)
    each = 1000 * (planning + recording) / cells
    note = f"{cells} empty cells: planned in {planning:.1f} s, recorded in {recording:.1f} s "
    return Section(
        [Table(rows, LAYOUT), f"{note}({each:.1f} ms a cell)."], "docs/measuring_details.md"
    )


def measure_ratios(faces: int, most_rounds: int) -> dict[str, list[float]]:
    """Return the harness's seconds over those of the bare call, and forked over fresh."""
    (task,) = plan_cells(
        [load_registry().algorithm("cem")], [spherical_cap(faces)], {}, MeasurementSettings()
    )
    ratios: dict[str, list[float]] = {"reported / bare": [], "forked / fresh": []}
    shuffled = random.Random(0)
    with tempfile.TemporaryDirectory() as one, tempfile.TemporaryDirectory() as other:
        forking = CellTimer(Path(one), Options())  # in folders of their own: each keeps a map
        starting = CellTimer(Path(other), Options(), forks=False)
        checked = {timer: Checked.of(timer.check(task)[0]) for timer in (forking, starting)}

        def by(timer: CellTimer) -> float:
            measured = timer.time(task, checked[timer])
            timer.close()  # as in a run: another server each round
            if isinstance(measured, Outcome):
                sys.exit(measured.cause)
            return measured.seconds

        def bare() -> float:
            command = [sys.executable, "-c", BARE, str(faces)]
            run = subprocess.run(command, capture_output=True, env=for_measuring(1), check=True)
            return float(run.stdout)

        ways = {
            "bare": bare,
            "forked": lambda: by(forking),
            "fresh": lambda: by(starting),
        }
        for k in range(most_rounds):
            measured = {way: ways[way]() for way in shuffled.sample(list(ways), len(ways))}
            ratios["reported / bare"].append(measured["forked"] / measured["bare"])
            ratios["forked / fresh"].append(measured["forked"] / measured["fresh"])
            print(f"round {k + 1}: {measured}", file=sys.stderr)
            if k + 1 >= FEWEST_ROUNDS and all(map(is_narrow, ratios.values())):
                break
    return ratios


def is_narrow(ratios: list[float]) -> bool:
    """Is the interval of the median within :data:`NARROW` of it?"""
    comparison = compare_ratios(ratios)
    i = comparison.interval
    return i is not None and i.high - i.low < 2 * NARROW * comparison.ratio


class NoProcess(CellTimer):
    """Answers at once what a process might."""

    def check(self, task: Task) -> tuple[Outcome, NDArray[np.complex128] | None]:
        return Outcome(status="ok", uv_hash="x"), np.ones(task.mesh.n, complex)

    def time(self, task: Task, checked: Checked) -> Round | Outcome:
        return Round(calls=(1e-3,) * 5, uv_hash="x")


def empty_cells(count: int) -> tuple[float, float]:
    """Return the seconds to plan `count` cells, and to record them with all their rounds."""
    cem = load_registry().algorithm("cem")
    meshes = [spherical_cap(600 + 60 * k).renamed(f"cap-{k}") for k in range(20)]
    start = perf_counter()
    algorithms = [replace(cem, name=f"cem-{k}") for k in range(count // len(meshes))]
    tasks = plan_cells(algorithms, meshes, {}, MeasurementSettings())
    planned = perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        records = run_tasks(tasks, Store(Path(folder)), timer=NoProcess)
    assert len(records) == len(tasks)
    return planned - start, perf_counter() - planned
