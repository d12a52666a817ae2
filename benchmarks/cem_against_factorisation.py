"""How much does CEM cost beyond what no direct method can avoid?

Unavoidable is one numeric Cholesky factorisation of the pinned Laplacian and one solve with two
columns. CEM with two iterations is measured against that, in turns, in one process with one thread;
the ratio is what to quote, since the machine's speed drifts. Each size runs in a fresh process, so
that its peak memory is its own::

    python benchmarks/cem_against_factorisation.py
    python benchmarks/cem_against_factorisation.py --mesh surface.ply --subdivide 0 2
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from pathlib import Path

from cembench.running.environment import for_measuring

ROUNDS = 5


def main() -> None:
    """Measure each size in a process of its own and print one line for it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mesh", type=Path, help="a mesh file; default: generated surfaces")
    parser.add_argument("--faces", type=int, nargs="+", default=[276_000, 1_690_000])
    parser.add_argument("--subdivide", type=int, nargs="+", help="with --mesh: how often, each")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measure_one(**json.loads(arguments.one))))
        return
    if arguments.mesh:
        jobs = [{"mesh": str(arguments.mesh), "size": k} for k in arguments.subdivide or [0]]
    else:
        jobs = [{"mesh": None, "size": faces} for faces in arguments.faces]
    print(
        f"{'faces':>9}  {'CEM s':>7}  {'floor s':>7}  {'ratio':>5}  {'peak GiB':>8}  phases of CEM"
    )
    for job in jobs:
        command = [sys.executable, __file__, "--one", json.dumps(job)]
        run = subprocess.run(command, capture_output=True, text=True, env=for_measuring(1))
        if run.returncode:
            sys.exit(run.stderr)
        found = json.loads(run.stdout)
        phases = ", ".join(f"{name} {s:.2f}" for name, s in found["phases"].items() if s >= 0.01)
        print(
            f"{found['faces']:>9,}  {found['cem']:7.3f}  {found['floor']:7.3f}  "
            f"{found['ratio']:5.2f}  {found['peak_gib']:8.2f}  {phases}"
        )


def measure_one(mesh: str | None, size: int) -> dict[str, object]:
    """Measure one surface; figures are medians over the rounds."""
    import gc

    import igl
    import numpy as np
    from cembench.algorithms.cem import cem
    from cembench.surfaces.spherical_cap import spherical_cap
    from scipy import sparse

    from cembench.conformal.laplacian import laplacian
    from cembench.core.clock import measure
    from cembench.linear_algebra.cholesky import Cholesky, linear_algebra
    from cembench.mesh.files import read_mesh
    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.running.memory import peak_memory_bytes

    if mesh is None:
        surface = spherical_cap(size)
    else:
        surface = read_mesh(mesh)
        V, F = surface.V, surface.F
        for _ in range(size):
            V, F = igl.upsample(V, F)
        surface = DiskMesh.trusted(V, F.astype(np.int64))
    order = np.concatenate([surface.interior, surface.boundary])
    k = len(surface.interior)
    rng = np.random.default_rng(0)
    ratios, totals, floors, phases = [], [], [], {}
    with linear_algebra():
        for _ in range(ROUNDS):
            gc.collect()
            _, timing = measure(
                lambda: cem(surface.fresh(), tolerance=0, max_iterations=2, stop="change")
            )
            peak = peak_memory_bytes()
            gc.collect()
            L = sparse.csr_array(laplacian(surface))[order][:, order]
            pinned = sparse.csc_array(L[:-1, :-1])
            factor, factored = measure(lambda A=pinned: Cholesky(A, leading=k))
            b = rng.standard_normal((surface.n - 1, 2))
            _, solved = measure(lambda f=factor, b=b: f.solve(b))
            del factor, L, pinned
            floors.append(factored.phases["factorisation"] + solved.total)
            totals.append(timing.total)
            ratios.append(totals[-1] / floors[-1])
            phases = timing.phases
    return {
        "faces": surface.m,
        "cem": statistics.median(totals),
        "floor": statistics.median(floors),
        "ratio": statistics.median(ratios),
        "peak_gib": (peak or 0) / 2**30,
        "phases": phases,
    }


if __name__ == "__main__":
    main()
