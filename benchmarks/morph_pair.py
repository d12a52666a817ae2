"""How long does a morph of two surfaces of 200 k triangles take, and how much memory?"""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from typing import Any

from benchmarks.measuring import in_fresh_process, in_turns
from benchmarks.pages import Section, Table

ROUNDS, FRAMES = 5, 48
LAYOUT = """
| faces | maps, s | registration, s | a frame, s | metrics, s | peak GiB | lambdas |
|---|---:|---:|---:|---:|---:|---|
| {faces} | {maps:.3f} | {registration:.3f} | {frame:.4f} | {metrics:.3f} | {peak_gib:.2f} \
| {lambdas} |"""


def morph_pair(
    surfaces: Sequence[str] = ("liu-wry-face-stand-in", "liu-smile-face-stand-in"),
    *,
    faces: int | None = None,
    threads: int = 2,
) -> Section:
    """Measure a morph of two surfaces: by default, of 200,000 triangles each.

    In a fresh process with as many threads as asked for: maps (CEM), then alignment, (34) and
    transport together ("registration"), then each of 48 frames, without drawing. The stand-ins for
    Liu's faces are made first if the cache does not hold them, which takes minutes and is not
    counted.
    """
    row = in_fresh_process(measure, list(surfaces), faces, threads=threads)
    row["faces"] = ", ".join(f"{m:,}" for m in row["faces"])
    return Section([Table([row], LAYOUT)])


def measure(names: list[str], faces: int | None) -> dict[str, Any]:
    """Return medians over the rounds; the peak is that of the whole process."""
    import numpy as np

    from cembench.morphing.landmarks import common_landmarks
    from cembench.morphing.morph import morph
    from cembench.registry import load_registry
    from cembench.running.memory import peak_memory_bytes
    from cembench.running.surfaces import generate_surface

    registry = load_registry()
    meshes = [generate_surface(registry, name, faces) for name in names]
    known = [registry.surface(n).landmarks(m) for n, m in zip(names, meshes, strict=True)]
    landmarks = common_landmarks(meshes, known)
    cem = registry.algorithm("cem").function
    maps = [cem(mesh.fresh()).uv for mesh in meshes]
    pair = morph([mesh.fresh() for mesh in meshes], maps, landmarks)
    calls = {
        "maps": lambda: [cem(mesh.fresh()) for mesh in meshes],
        "registration": lambda: morph([mesh.fresh() for mesh in meshes], maps, landmarks),
        "frame": lambda: np.stack([pair.at(time) for time in np.linspace(0, 1, FRAMES)]),
        "metrics": lambda: pair.metrics(FRAMES),
    }
    timings = in_turns(calls, ROUNDS, warm_up=0)
    seconds = {name: median(one.total for one in many) for name, many in timings.items()}
    return {
        "faces": [mesh.m for mesh in meshes],
        **seconds,
        "frame": seconds["frame"] / FRAMES,
        "peak_gib": (peak_memory_bytes() or 0) / 2**30,
        "lambdas": [[round(lam, 3) for lam in r.lambdas] for r in pair.registrations],
    }
