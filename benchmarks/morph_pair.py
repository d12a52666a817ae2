"""How long does a morph of two surfaces of 200 k triangles take, and how much memory?

In a fresh process with as many threads as asked for: maps (CEM), then alignment, registration and
transport together, then each of 48 frames, without drawing. The stand-ins for Liu's faces are made
first if the cache does not hold them, which takes minutes and is not counted::

    python benchmarks/morph_pair.py
    python benchmarks/morph_pair.py --surfaces liu-wry-face-stand-in liu-smile-face-stand-in
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from time import perf_counter

from cembench.running.environment import for_measuring

ROUNDS, FRAMES = 5, 48


def main() -> None:
    """Measure in a process of its own and print what came out."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    usual = ["liu-wry-face-stand-in", "liu-smile-face-stand-in"]
    parser.add_argument("--surfaces", nargs="+", default=usual)
    parser.add_argument("--faces", type=int, help="triangles; default: the rows' own")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--one", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.one:
        print(json.dumps(measure(**json.loads(arguments.one))))
        return
    job = {"names": arguments.surfaces, "faces": arguments.faces}
    command = [sys.executable, __file__, "--one", json.dumps(job)]
    environment = for_measuring(arguments.threads)
    run = subprocess.run(command, capture_output=True, text=True, env=environment)
    if run.returncode:
        sys.exit(run.stderr)
    found = json.loads(run.stdout)
    print("faces          " + ", ".join(f"{faces:,}" for faces in found["faces"]))
    print(f"maps           {found['maps']:.3f} s")
    print(f"registration   {found['registration']:.3f} s (alignment, (34), transport)")
    print(f"a frame        {found['frame']:.4f} s")
    print(f"metrics        {found['metrics']:.3f} s")
    print(f"peak memory    {found['peak_gib']:.2f} GiB")
    print(f"lambdas        {found['lambdas']}")


def measure(names: list[str], faces: int | None) -> dict[str, object]:
    """Figures are medians over the rounds; the peak is that of the whole process."""
    import numpy as np

    from cembench.registry import load_registry
    from cembench.running.memory import peak_memory_bytes
    from cembench.running.surfaces import generate_surface
    from cembench.workflows.morphing.landmarks import common_landmarks
    from cembench.workflows.morphing.morph import morph

    registry = load_registry()
    meshes = [generate_surface(registry, name, faces) for name in names]
    known = [registry.surface(n).landmarks(m) for n, m in zip(names, meshes, strict=True)]
    landmarks = common_landmarks(meshes, known)
    cem = registry.algorithm("cem").function
    seconds: dict[str, list[float]] = {"maps": [], "registration": [], "frame": [], "metrics": []}
    for _ in range(ROUNDS):
        began = perf_counter()
        maps = [cem(mesh.fresh()).uv for mesh in meshes]
        seconds["maps"].append(perf_counter() - began)
        began = perf_counter()
        found = morph([mesh.fresh() for mesh in meshes], maps, landmarks)
        seconds["registration"].append(perf_counter() - began)
        began = perf_counter()
        frames = np.stack([found.at(time) for time in np.linspace(0, 1, FRAMES)])
        seconds["frame"].append((perf_counter() - began) / len(frames))
        began = perf_counter()
        found.metrics(FRAMES)
        seconds["metrics"].append(perf_counter() - began)
    return {
        "faces": [mesh.m for mesh in meshes],
        **{name: statistics.median(values) for name, values in seconds.items()},
        "peak_gib": (peak_memory_bytes() or 0) / 2**30,
        "lambdas": [[round(lam, 3) for lam in r.lambdas] for r in found.registrations],
    }


if __name__ == "__main__":
    main()
