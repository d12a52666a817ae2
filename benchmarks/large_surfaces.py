"""What METIS and a second thread give on large surfaces: a table for docs/algorithms.md.

Every line is a fresh process that calls one algorithm once, after a small surface has warmed up the
libraries. Seconds are those of the clock, since CPU seconds would add the threads up::

    python -m benchmarks.large_surfaces
    python -m benchmarks.large_surfaces surface.ply@2 1000000 -a direct-cem --rounds 3 --write-docs

Surfaces are named as in ``benchmarks.limit``.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from itertools import product
from pathlib import Path
from typing import Any

from benchmarks.limit import from_anywhere, read_surface
from benchmarks.pages import ROOT, fill
from cembench.linear_algebra.backends import available_backends
from cembench.running.environment import for_measuring

BACKENDS = ("cvxopt", "cvxopt-metis")
THREADS = (1, 2)
PHASES = ("ordering", "symbolic", "factorisation")


def main() -> None:
    """Measure every surface with each order and number of threads, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("surfaces", nargs="*", default=["1000000"])
    parser.add_argument("-a", "--algorithm", default="direct-cem")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--write-docs", action="store_true")
    parser.add_argument("--one", nargs=2, metavar=("SURFACE", "BACKEND"), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measure_one(*arguments.one, arguments.algorithm)))
        return
    lines = [
        "| surface | triangles | order of rows | threads | seconds | ordering, analysis, "
        "factorisation | entries of the factor, M | peak GiB |",
        "|---|---:|---|---:|---:|---:|---:|---:|",
    ]
    ways = list(product([b for b in BACKENDS if b in available_backends()], THREADS))
    for surface in arguments.surfaces:
        found: dict[tuple[str, int], list[dict[str, Any]]] = {way: [] for way in ways}
        for _ in range(arguments.rounds):
            for way in ways:
                found[way].append(in_fresh_process(surface, arguments.algorithm, *way))
        lines += [line(surface, *way, runs) for way, runs in found.items()]
        print(f"{surface}: done", file=sys.stderr)
    print("\n".join(lines))
    if arguments.write_docs:
        told = f"Medians of {arguments.rounds} processes with one call of `{arguments.algorithm}`."
        fill(ROOT / "docs/algorithms.md", "large_surfaces", "\n".join([*lines, "", told]))


def line(surface: str, backend: str, threads: int, runs: list[dict[str, Any]]) -> str:
    """Return a row of the table."""
    name = Path(surface).name if not surface.isdigit() else "spherical cap"
    seconds, factoring = (
        statistics.median(run[key] for run in runs) for key in ("seconds", "factoring")
    )
    order = "METIS" if backend == "cvxopt-metis" else "AMD"
    last = runs[-1]
    return (
        f"| {name} | {last['faces']:,} | {order} | {threads} | {seconds:.3g} | {factoring:.3g} | "
        f"{last['entries'] / 1e6:.0f} | {last['peak_gib']:.2f} |"
    )


def in_fresh_process(surface: str, algorithm: str, backend: str, threads: int) -> dict[str, Any]:
    """Return what one call costs, in a process of its own."""
    command = [
        sys.executable,
        "-m",
        "benchmarks.large_surfaces",
        "--one",
        from_anywhere(surface),
        backend,
    ]
    command += ["--algorithm", algorithm]
    environment = for_measuring(threads)
    run = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=ROOT)
    if run.returncode:
        sys.exit(run.stderr)
    answer: dict[str, Any] = json.loads(run.stdout)
    return answer


def measure_one(surface: str, backend: str, algorithm: str) -> dict[str, Any]:
    """Call an algorithm once on a surface, and tell seconds, fill and memory."""
    from cembench.core.clock import measure
    from cembench.linear_algebra.cholesky import linear_algebra
    from cembench.linear_algebra.work import counting
    from cembench.registry import load_registry
    from cembench.running.memory import memory_of_call

    call = load_registry().algorithm(algorithm).function
    mesh = read_surface(surface)
    with linear_algebra(backend=backend), counting() as work:
        call(read_surface("2000"))
        (_, timing), memory = memory_of_call(lambda: measure(lambda: call(mesh)))
    return {
        "faces": mesh.m,
        "seconds": timing.total,
        "factoring": sum(timing.phases.get(phase, 0.0) for phase in PHASES),
        "entries": work.entries,
        "peak_gib": (memory.peak or 0) / 2**30,
    }


if __name__ == "__main__":
    main()
