"""Where does each algorithm spend its time, when factors are kept and when they are not?

Prints a Markdown table, a line an algorithm and policy, the phases that matter as columns. Each
line comes from a process of its own with one thread; seconds are those of the call with the
median total::

    python benchmarks/phases.py surface.ply
    python benchmarks/phases.py --faces 276000 -a cem,fdm
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from cembench.registry import load_registry
from cembench.results.store import Store
from cembench.running.local import run_tasks
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.surfaces import generate_surface, kinds_of, load_file

#: Phases that take less than this share of the total in every line go under "rest".
SHOWN = 0.05


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("mesh", type=Path, nargs="?", help="default: a spherical cap")
    parser.add_argument("--faces", type=int, default=276_000)
    parser.add_argument("-a", "--algorithms", help="comma-separated; default: all that take a disk")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--timeout", type=float, default=600.0)
    arguments = parser.parse_args()

    registry = load_registry()
    names = arguments.algorithms.split(",") if arguments.algorithms else registry.usual_algorithms
    chosen = [registry.algorithm(name) for name in names]
    if arguments.mesh:
        surface = load_file(arguments.mesh, kinds_of(chosen)).mesh
    else:
        surface = generate_surface(registry, "spherical-cap", arguments.faces)
    tasks = [
        task
        for solves in ("reuse", "backslash")
        for task in plan_cells(
            chosen, [surface], {}, MeasurementSettings(solves=solves, repeats=arguments.repeats)
        )
    ]
    with tempfile.TemporaryDirectory() as folder:
        records = run_tasks(tasks, Store(Path(folder)), Options(timeout=arguments.timeout))
    lines = [
        (task.algorithm, r.cell.solves, r.outcome) for task, r in zip(tasks, records, strict=True)
    ]
    lines.sort(key=lambda line: names.index(line[0].name))

    shown = sorted(
        {
            name
            for _, _, outcome in lines
            for name, seconds in outcome.phases.items()
            if seconds > SHOWN * sum(outcome.phases.values())
        }
    )
    heading = ["algorithm", "solves", *shown, "rest", "total"]
    print(f"{surface.name}: {surface.m:,} triangles, {surface.n:,} vertices; seconds\n")
    print("| " + " | ".join(heading) + " |")
    print("|---|---|" + "---:|" * (len(heading) - 2))
    for algorithm, solves, outcome in lines:
        if outcome.status != "ok":
            print(f"| {algorithm.title} | {solves} | {outcome.status}: {outcome.cause} |")
            continue
        total = sum(outcome.phases.values())
        figures = [outcome.phases.get(name, 0.0) for name in shown]
        cells = [f"{x:.3f}" for x in (*figures, total - sum(figures), total)]
        print("| " + " | ".join([algorithm.title, solves, *cells]) + " |")


if __name__ == "__main__":
    main()
