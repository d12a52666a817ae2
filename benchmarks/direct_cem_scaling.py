"""What does direct-cem cost beside CEM, and does it grow as the factorisation does?

Per size one fresh process measures, in turns, direct-cem, CEM with 2 iterations, CEM as it stops by
itself, and the one factorisation that each of them needs (ordering, analysis, numbers). Quote the
ratios, which are taken within rounds; exponents are fitted to the medians over all sizes::

    python benchmarks/direct_cem_scaling.py
    python benchmarks/direct_cem_scaling.py --faces 20000 80000 --rounds 3
    python benchmarks/direct_cem_scaling.py --mesh surface.ply
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import subprocess
import sys
from pathlib import Path

from cembench.running.environment import for_measuring

FACES = [20_000, 60_000, 190_000, 580_000, 1_700_000]
#: A size is measured so long at least, or in so many rounds: short calls need more of them.
LEAST_SECONDS, MOST_ROUNDS = 10, 25
NAMES = ("direct-cem", "cem, 2 iterations", "cem", "factorisation")


def main() -> None:
    """Measure every size in a process of its own, print a line for it, and fit exponents."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mesh", type=Path, nargs="+", help="mesh files; default: spherical caps")
    parser.add_argument("--faces", type=int, nargs="+", default=FACES)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--one", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measure_one(**json.loads(arguments.one))))
        return
    jobs = [str(path) for path in arguments.mesh or []] or arguments.faces
    print(f"{'faces':>9}  {'boundary':>8}  {'direct s':>8}  {'/ cem(2)':>8}  {'/ cem':>6}  /factor")
    found = []
    for job in jobs:
        given = json.dumps({"surface": job, "rounds": arguments.rounds})
        command = [sys.executable, __file__, "--one", given]
        run = subprocess.run(command, capture_output=True, text=True, env=for_measuring(1))
        if run.returncode:
            sys.exit(run.stderr)
        one = json.loads(run.stdout)
        found.append(one)
        print(
            f"{one['faces']:>9,}  {one['boundary']:>8,}  {one['seconds']['direct-cem']:8.3f}  "
            + f"{one['ratios']['cem, 2 iterations']:8.2f}  {one['ratios']['cem']:6.2f}  "
            + f"{one['ratios']['factorisation']:7.2f}"
        )
    if len(found) > 1:
        exponents = {name: exponent(found, name) for name in NAMES}
        print("cost grows as faces ** " + ", ".join(f"{e:.3f} ({n})" for n, e in exponents.items()))
        more = exponents["direct-cem"] - exponents["factorisation"]
        print(f"direct-cem less factorisation: {more:+.3f}")
        means = {
            name: statistics.geometric_mean(one["ratios"][name] for one in found)
            for name in NAMES[1:]
        }
        print("geometric means: " + ", ".join(f"{m:.3f} (/ {n})" for n, m in means.items()))


def exponent(found: list[dict[str, object]], name: str) -> float:
    """Slope of log seconds against log faces."""
    x = [math.log(one["faces"]) for one in found]
    y = [math.log(one["seconds"][name]) for one in found]
    return statistics.linear_regression(x, y).slope


def measure_one(surface: str | int, rounds: int) -> dict[str, object]:
    """Measure one surface; seconds are medians over rounds, ratios medians of ratios in a round."""
    import gc
    import time

    import numpy as np
    from cembench.algorithms.cem import cem
    from cembench.algorithms.direct_cem.disk import direct_cem
    from cembench.surfaces.spherical_cap import spherical_cap
    from scipy import sparse

    from cembench.conformal.laplacian import laplacian
    from cembench.core.clock import measure
    from cembench.linear_algebra.cholesky import Cholesky, linear_algebra
    from cembench.mesh.files import read_mesh

    mesh = spherical_cap(surface) if isinstance(surface, int) else read_mesh(surface)
    order = np.concatenate([mesh.interior, mesh.boundary])
    L = sparse.csr_array(laplacian(mesh))[order][:, order]
    pinned = sparse.csc_array(L[:-1, :-1])
    calls = {
        "direct-cem": lambda: direct_cem(mesh.fresh(), delaunay=False),
        "cem, 2 iterations": lambda: cem(
            mesh.fresh(), tolerance=0, max_iterations=2, stop="change"
        ),
        "cem": lambda: cem(mesh.fresh()),
        "factorisation": lambda: Cholesky(pinned, leading=len(mesh.interior)),
    }
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    with linear_algebra():
        until, done = time.monotonic() + LEAST_SECONDS, 0
        while done <= rounds or (done <= MOST_ROUNDS and time.monotonic() < until):
            for name, call in calls.items():
                gc.collect()
                total = measure(call)[1].total
                if done:  # the first round warms up
                    seconds[name].append(total)
            done += 1
    first = seconds["direct-cem"]
    return {
        "faces": mesh.m,
        "boundary": len(mesh.boundary),
        "seconds": {name: statistics.median(times) for name, times in seconds.items()},
        "ratios": {
            name: statistics.median(a / b for a, b in zip(first, times, strict=True))
            for name, times in seconds.items()
        },
    }


if __name__ == "__main__":
    main()
