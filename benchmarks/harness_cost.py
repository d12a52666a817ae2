"""What does the harness add: to the seconds it tells, and by itself?

1. CEM on a mesh in memory: the seconds that the harness tells over those of a bare call in a
   script, in turns, each in a fresh process with one thread. To be within 2 %.
2. Planning and recording 1,000 cells whose processes are not started. To be under a minute.

::

    python benchmarks/harness_cost.py
    python benchmarks/harness_cost.py --faces 20000 --rounds 20
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from cembench.comparison import compare_ratios
from cembench.records import Outcome, Round
from cembench.registry import load_registry
from cembench.running.environment import with_threads
from cembench.running.local import Launcher, Options, run_tasks
from cembench.running.plan import How, Task, plan_cells
from cembench.store import Store
from meshes_gen.spherical_cap import spherical_cap

BARE = """
import sys
from statistics import median
from time import perf_counter
from algorithms.cem import cem
from meshes_gen.spherical_cap import spherical_cap

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


def main() -> None:
    """Print both figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--faces", type=int, default=100_000)
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--cells", type=int, default=1000)
    chosen = parser.parse_args()
    ratios = told_over_bare(chosen.faces, chosen.rounds)
    found = compare_ratios(ratios)
    sure = f"{found.interval.low:.3f} to {found.interval.high:.3f}" if found.interval else "unknown"
    print(f"told / bare: {median(ratios):.3f}, 95 % interval {sure}, {len(ratios)} rounds")
    planning, recording = empty_cells(chosen.cells)
    print(f"{chosen.cells} empty cells: planned in {planning:.1f} s, recorded in {recording:.1f} s")


def told_over_bare(faces: int, rounds: int) -> list[float]:
    """Seconds that the harness tells of CEM over those of the bare call, by round."""
    (task,) = plan_cells([load_registry().algorithm("cem")], [spherical_cap(faces)], {}, How())
    ratios = []
    with tempfile.TemporaryDirectory() as folder:
        launcher = Launcher(Path(folder), Options())

        def told() -> float:
            found = launcher.time(task)
            if isinstance(found, Outcome):
                sys.exit(found.cause)
            return found.seconds

        def bare() -> float:
            command = [sys.executable, "-c", BARE, str(faces)]
            run = subprocess.run(command, capture_output=True, env=with_threads(1), check=True)
            return float(run.stdout)

        for k in range(rounds):
            if k % 2:
                ours, theirs = told(), bare()
            else:
                theirs, ours = bare(), told()
            ratios.append(ours / theirs)
    return ratios


class NoProcess(Launcher):
    """Answers at once what a process might."""

    def check(self, task: Task) -> tuple[Outcome, NDArray[np.complex128] | None]:
        return Outcome(status="ok", uv_hash="x"), np.ones(task.mesh.n, complex)

    def time(self, task: Task) -> Round | Outcome:
        return Round(calls=(1e-3,) * 5, uv_hash="x")


def empty_cells(count: int) -> tuple[float, float]:
    """Seconds to plan so many cells, and to record them with all their rounds."""
    cem = load_registry().algorithm("cem")
    meshes = [replace(spherical_cap(600 + 60 * k), name=f"cap-{k}") for k in range(20)]
    start = perf_counter()
    algorithms = [replace(cem, name=f"cem-{k}") for k in range(count // len(meshes))]
    tasks = plan_cells(algorithms, meshes, {}, How())
    planned = perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        records = run_tasks(tasks, Store(Path(folder)), launcher=NoProcess)
    assert len(records) == len(tasks)
    return planned - start, perf_counter() - planned


if __name__ == "__main__":
    main()
