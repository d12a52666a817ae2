"""What does Koebe's method cost, by the number of holes and by what serves several steps?

Each line is a flat disk with holes of the same size in triangles. `koebe` is one sweep of
``koebe-cem``, which eliminates the interior once, `more` what each further sweep takes; `apart`
maps each of the same filled surfaces by ``cem``, with a factorisation of its own, which is what a
sweep costs without that. Under `factoring` is the time for orderings, factorisations, condensation
and patches alone, which does not depend on how often CEM iterates. One thread, medians of rounds in
turns; ratios are what to quote::

    python benchmarks/koebe_cost.py
    python benchmarks/koebe_cost.py --faces 200000 --holes 1 3 --rounds 5
    python benchmarks/koebe_cost.py --mesh face.obj
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from pathlib import Path

from cembench.running.environment import for_measuring

#: The phases that condensation is to save.
FACTORING = (
    "ordering",
    "symbolic",
    "factorisation",
    "dense factorisation",
    "condensation",
    "patches",
)


def main() -> None:
    """Measure each surface in a process of its own and print one line for it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--faces", type=int, default=20_000)
    parser.add_argument("--holes", type=int, nargs="+", default=[1, 2, 4, 8, 16, 32])
    parser.add_argument("--mesh", type=Path, nargs="*", default=[], help="mesh files instead")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--one", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measure_one(**json.loads(arguments.one))))
        return
    jobs: list[dict[str, object]] = [{"mesh": str(path)} for path in arguments.mesh]
    jobs = jobs or [{"faces": arguments.faces, "holes": k} for k in arguments.holes]
    heads = ("koebe s", "more s", "apart s", "factoring", "apart", "ratio")
    print(f"{'faces':>9} {'holes':>5} {'rim':>5} " + " ".join(f"{head:>9}" for head in heads))
    found = []
    for job in jobs:
        job["rounds"] = arguments.rounds
        command = [sys.executable, __file__, "--one", json.dumps(job)]
        run = subprocess.run(command, capture_output=True, text=True, env=for_measuring(1))
        if run.returncode:
            sys.exit(run.stderr)
        row = json.loads(run.stdout)
        found.append(row)
        names = ("koebe", "more", "apart", "factoring", "factoring_apart")
        figures = " ".join(f"{row[name]:9.3f}" for name in names)
        ratio = row["factoring"] / row["factoring_apart"]
        print(f"{row['faces']:>9,} {row['holes']:>5} {row['rim']:>5} {figures} {ratio:9.2f}")
    if len(found) > 2 and not arguments.mesh:
        print(f"seconds grow as the number of boundaries to the power {_exponent(found):.2f}")


def measure_one(
    rounds: int, faces: int = 0, holes: int = 0, mesh: str | None = None
) -> dict[str, object]:
    """Measure one surface; figures are medians over the rounds."""
    from cembench.algorithms.cem import cem
    from cembench.algorithms.koebe_cem.koebe_cem import koebe_cem
    from cembench.surfaces.holed_disk import holed_disk

    from cembench.conformal.patches import filled
    from cembench.core.clock import measure
    from cembench.mesh.files import read_mesh
    from cembench.mesh.triangle_mesh import HoledMesh

    surface = read_mesh(mesh, HoledMesh) if mesh else holed_disk(faces, holes=holes)
    outer, inner = surface.outer_and_holes()
    loops = [outer, *inner]
    disks = [
        filled(surface, [loop for j, loop in enumerate(loops) if j != k]) for k in range(len(loops))
    ]
    one, four, apart = [], [], []
    for _ in range(rounds + 1):
        one.append(measure(lambda: koebe_cem(surface.fresh()))[1])
        four.append(measure(lambda: koebe_cem(surface.fresh(), sweeps=4))[1])
        apart.append([measure(lambda disk=disk: cem(disk.fresh()))[1] for disk in disks])
    koebe = statistics.median(timing.total for timing in one[1:])
    return {
        "faces": surface.m,
        "holes": len(inner),
        "rim": sum(map(len, loops)),
        "koebe": koebe,
        "more": (statistics.median(timing.total for timing in four[1:]) - koebe) / 3,
        "apart": statistics.median(sum(t.total for t in timings) for timings in apart[1:]),
        "factoring": statistics.median(_factoring(timing.phases) for timing in one[1:]),
        "factoring_apart": statistics.median(
            sum(_factoring(t.phases) for t in timings) for timings in apart[1:]
        ),
    }


def _factoring(phases: dict[str, float]) -> float:
    return sum(phases.get(name, 0.0) for name in FACTORING)


def _exponent(rows: list[dict[str, float]]) -> float:
    import numpy as np

    boundaries = [row["holes"] + 1 for row in rows]
    return float(np.polyfit(np.log(boundaries), np.log([row["koebe"] for row in rows]), 1)[0])


if __name__ == "__main__":
    main()
