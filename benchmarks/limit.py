"""How far from the limit are CEM and direct CEM, how do they grow, and where does the time go?

The *limit* is what no direct method can do without: ordering, analysis and factorisation of the
pinned Laplacian as a whole, in its own fill-reducing order, and one solve with two columns. The
second figure is the same with the boundary kept last, which the methods here need, and which is
dearer: a floor that contains the design it should judge. Per surface one fresh process with one
thread measures all in turns. Quote the ratios, medians of those within rounds::

    python -m benchmarks.limit
    python -m benchmarks.limit surface.ply surface.ply@2 --clock cpu --rounds 9 --write-docs

A number is a spherical cap with so many triangles; ``@2`` splits every triangle into four twice.
``--clock cpu`` counts the process's CPU seconds instead of those of the wall. ``--write-docs`` puts
the tables into docs/algorithms.md.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks.pages import ROOT, fill
from cembench.running.environment import for_measuring

CAPS = ["20000", "190000", "1700000"]
METHODS = ("cem, 2 iterations", "cem", "direct-cem", "direct-cem, own weights")
FLOORS = ("limit", "boundary last")
CLOCKS = {"wall": "seconds of the clock", "cpu": "CPU seconds"}
#: Phases that take a smaller share of a call are left out.
LEAST_SHARE = 0.02


def main() -> None:
    """Measure each surface in a process of its own, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("surfaces", nargs="*", default=CAPS, help="mesh files, FILE@SPLITS, faces")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--clock", choices=["wall", "cpu"], default="wall")
    parser.add_argument("--write-docs", action="store_true")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measure_one(arguments.one, arguments.rounds, arguments.clock)))
        return
    found = []
    for surface in arguments.surfaces:
        command = [sys.executable, "-m", "benchmarks.limit", "--one", from_anywhere(surface)]
        command += ["--rounds", str(arguments.rounds), "--clock", arguments.clock]
        run = subprocess.run(
            command, capture_output=True, text=True, env=for_measuring(1), cwd=ROOT
        )
        if run.returncode:
            sys.exit(run.stderr)
        found.append(json.loads(run.stdout))
        print(f"{surface}: done", file=sys.stderr)
    lines = tables(found)
    print("\n".join(lines))
    if arguments.write_docs:
        how = f"Medians of {arguments.rounds} rounds, {CLOCKS[arguments.clock]}, one thread."
        fill(ROOT / "docs/algorithms.md", "limit", "\n".join([*lines, "", how]))


def tables(found: list[dict[str, Any]]) -> list[str]:
    """Return the lines of all tables, in Markdown."""
    lines = ["| surface (boundary) | triangles | limit, s | boundary last |"]
    lines[0] += "".join(f" {name} / limit |" for name in METHODS)
    lines += ["|---" * (4 + len(METHODS)) + "|"]
    for one in found:
        seconds, ratios = one["seconds"], one["ratios"]
        cells = [f"{one['surface']} ({one['boundary']:,})", f"{one['faces']:,}"]
        cells += [f"{seconds['limit']:.4g}", f"{ratios['boundary last']:.2f}"]
        cells += [f"{ratios[name]:.2f} ({one['iterations'][name]})" for name in METHODS]
        lines.append("| " + " | ".join(cells) + " |")
    lines += ["", "In brackets: iterations.", "", "| surface | method | peak GiB | phases, % |"]
    lines.append("|---|---|---|---|")
    for one in found:
        for name in METHODS:
            total = sum(one["phases"][name].values())
            shares = {k: s / total for k, s in one["phases"][name].items()}
            shown = sorted(shares, key=lambda k: -shares[k])
            text = ", ".join(f"{k} {100 * shares[k]:.0f}" for k in shown if shares[k] > LEAST_SHARE)
            peak = one["peak_gib"][name]
            lines.append(
                f"| {one['surface']} | {name} | "
                f"{'?' if peak is None else format(peak, '.2f')} | {text} |"
            )
    if len({one["faces"] for one in found}) > 1:
        grown = ", ".join(f"{exponent(found, name):.3f} ({name})" for name in [*FLOORS, *METHODS])
        lines += ["", f"Cost grows as triangles to the power {grown}."]
    return lines


def exponent(found: list[dict[str, Any]], name: str) -> float:
    """Slope of log seconds against log triangles."""
    x = [math.log(one["faces"]) for one in found]
    y = [math.log(one["seconds"][name]) for one in found]
    return statistics.linear_regression(x, y).slope


def measure_one(name: str, rounds: int, clock: str) -> dict[str, Any]:
    """Measure one surface; seconds are medians over rounds, ratios medians of ratios in a round."""
    import gc
    import time

    import numpy as np
    from cembench.algorithms.cem import cem
    from cembench.algorithms.direct_cem.disk import direct_cem

    from cembench.conformal.laplacian import by_rows, laplacian
    from cembench.core.clock import measure
    from cembench.linear_algebra.cholesky import Cholesky, linear_algebra
    from cembench.linear_algebra.lower_triangle import permuted_lower
    from cembench.running.memory import memory_of_call

    mesh = read_surface(name)
    order = np.concatenate([mesh.interior, mesh.boundary])[:-1]
    pinned = permuted_lower(by_rows(laplacian(mesh)), order)
    b = np.random.default_rng(0).standard_normal((len(order), 2))
    calls = {
        "limit": lambda: Cholesky(pinned, lower=True).solve(b),
        "boundary last": lambda: Cholesky(pinned, leading=len(mesh.interior), lower=True).solve(b),
        "cem, 2 iterations": lambda: cem(
            mesh.fresh(), tolerance=0, max_iterations=2, stop="change"
        ),
        "cem": lambda: cem(mesh.fresh()),
        "direct-cem": lambda: direct_cem(mesh.fresh()),
        "direct-cem, own weights": lambda: direct_cem(mesh.fresh(), delaunay=False),
    }
    seconds: dict[str, list[float]] = {key: [] for key in calls}
    peaks, phases, iterations = {}, {}, {}
    with linear_algebra():
        for key, call in calls.items():  # the first call warms up, and shows its memory
            result, memory = memory_of_call(call)
            peaks[key] = None if memory.peak is None else memory.peak / 2**30
            iterations[key] = getattr(result, "iterations", None)
            del result
        for _ in range(rounds):
            for key, call in calls.items():
                gc.collect()
                begun = time.process_time()
                timing = measure(call)[1]
                used = time.process_time() - begun
                seconds[key].append(used if clock == "cpu" else timing.total)
                phases[key] = timing.phases
    return {
        "surface": Path(name).name,
        "faces": mesh.m,
        "boundary": len(mesh.boundary),
        "seconds": {key: statistics.median(times) for key, times in seconds.items()},
        "ratios": {
            key: statistics.median(a / c for a, c in zip(times, seconds["limit"], strict=True))
            for key, times in seconds.items()
        },
        "peak_gib": peaks,
        "phases": phases,
        "iterations": iterations,
    }


def from_anywhere(name: str) -> str:
    """Return what :func:`read_surface` is to be given in a process in another folder."""
    return name if name.isdigit() else str(Path(name).absolute())


def read_surface(name: str) -> Any:
    """Read ``FILE``, ``FILE@SPLITS``, or make a spherical cap with so many triangles."""
    import igl
    import numpy as np
    from cembench.surfaces.spherical_cap import spherical_cap

    from cembench.mesh.files import read_mesh
    from cembench.mesh.triangle_mesh import DiskMesh

    if name.isdigit():
        return spherical_cap(int(name))
    path, _, splits = name.partition("@")
    mesh = read_mesh(path)
    V, F = mesh.V, mesh.F
    for _ in range(int(splits or 0)):
        V, F = igl.upsample(V, F)
    return DiskMesh.trusted(V, F.astype(np.int64)) if splits else mesh


if __name__ == "__main__":
    main()
