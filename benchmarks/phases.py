"""Where does each algorithm spend its time, when factors are kept and when they are not?"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks.pages import Section, Table
from cembench.registry import load_registry
from cembench.results.store import Store
from cembench.running.local import run_tasks
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.surfaces import generate_surface, kinds_of, load_file

#: Phases that take less than this share of the total in every line go under "rest".
SHOWN = 0.05


def phases(
    mesh: Sequence[Path] = (),
    *,
    faces: int = 276_000,
    algorithms: Sequence[str] = (),
    repeats: int = 3,
    timeout: float = 600.0,
) -> Section:
    """Tabulate where each algorithm spends its time, under both policies of solving.

    On a mesh, or else a spherical cap; by default, all algorithms that take a disk. Each line comes
    from a process of its own with one thread; seconds are those of the call with the median total.
    """
    registry = load_registry()
    chosen = [registry.algorithm(name) for name in algorithms or registry.usual_algorithms]
    if mesh:
        surface = load_file(mesh[0], kinds_of(chosen)).mesh
    else:
        surface = generate_surface(registry, "spherical-cap", faces)
    tasks = [
        task
        for algorithm in chosen
        for solves in ("reuse", "backslash")
        for task in plan_cells(
            [algorithm], [surface], {}, MeasurementSettings(solves=solves, repeats=repeats)
        )
    ]
    with tempfile.TemporaryDirectory() as folder:
        records = run_tasks(tasks, Store(Path(folder)), Options(timeout=timeout))
    ended = [one.outcome.phases for one in records]
    shown = sorted(
        {name for one in ended for name, s in one.items() if s > SHOWN * sum(one.values())}
    )
    rows = []
    for task, record in zip(tasks, records, strict=True):
        outcome, total = record.outcome, sum(record.outcome.phases.values())
        row = {"title": task.algorithm.title, "solves": record.cell.solves}
        if outcome.status == "ok":
            seconds = {f"phase{k}": outcome.phases.get(name, 0.0) for k, name in enumerate(shown)}
            row |= {**seconds, "rest": total - sum(seconds.values()), "total": total}
        else:
            row |= dict.fromkeys([*(f"phase{k}" for k in range(len(shown))), "rest", "total"])
            row["solves"] += f" ({outcome.status}: {outcome.cause})"
        rows.append(row)
    cells = "".join(f" {{phase{k}:.3f}} |" for k in range(len(shown)))
    layout = f"""
| algorithm | solves |{"".join(f" {name} |" for name in shown)} rest | total |
|---|---|{"---:|" * (len(shown) + 2)}
| {{title}} | {{solves}} |{cells} {{rest:.3f}} | {{total:.3f}} |"""
    about = f"{surface.name}: {surface.m:,} triangles, {surface.n:,} vertices; seconds of the call "
    about += f"with the median total of {repeats}."
    return Section([about, Table(rows, layout)], "docs/speed.md")
