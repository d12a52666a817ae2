"""What does Koebe's method cost, by the number of holes and by what serves several steps?"""

from __future__ import annotations

from collections.abc import Sequence
from math import log
from statistics import linear_regression, median
from typing import Any

from benchmarks.measuring import in_fresh_process, in_turns, progress
from benchmarks.pages import Section, Table

#: The phases that condensation is to save.
FACTORING = (
    *("ordering", "symbolic", "factorisation", "dense factorisation", "condensation", "patches"),
)
LAYOUT = """
| triangles | holes | on boundaries | first sweep | each further one | factorised apart \
| factoring | apart | ratio |
|---:|---:|---:|---:|---:|---:|---:|---:|---:|
| {faces:,} | {holes} | {rim} | {koebe:.3f} | {more:.3f} | {apart:.3f} | {factoring:.3f} \
| {factoring_apart:.3f} | {ratio:.2f} |"""


def koebe_cost(
    meshes: Sequence[str] = (),
    *,
    faces: int = 20_000,
    holes: Sequence[int] = (1, 2, 4, 8, 16, 32),
    rounds: int = 5,
) -> Section:
    """Measure Koebe's method by the number of holes.

    Each line is a mesh file, or a flat disk with holes of the same size in triangles. `koebe` is
    one sweep of ``koebe-cem``, which eliminates the interior once, `more` what each further sweep
    takes; `apart` maps each of the same filled surfaces by ``cem``, with a factorisation of its
    own, which is what a sweep costs without that. Under `factoring` is the time for orderings,
    factorisations, condensation and patches alone, which does not depend on how often CEM iterates.
    One thread, medians of rounds in turns; ratios are what to quote.
    """
    jobs = [(0, 0, mesh) for mesh in meshes] or [(faces, k, None) for k in holes]
    rows = [in_fresh_process(measure, rounds, *job) for job in progress(jobs)]
    parts: list[Table | str] = [Table(rows, LAYOUT)]
    if len(rows) > 2 and not meshes:
        x, y = zip(*((log(one["holes"] + 1), log(one["koebe"])) for one in rows), strict=True)
        power = linear_regression(x, y).slope
        parts.append(f"Seconds grow as the number of boundaries to the power {power:.2f}.")
    return Section(parts, "docs/holes.md")


def measure(rounds: int, faces: int, holes: int, mesh: str | None) -> dict[str, Any]:
    """Measure one surface; figures are medians over the rounds."""
    from cembench.algorithms.cem import cem
    from cembench.algorithms.koebe_cem.koebe_cem import koebe_cem
    from cembench.surfaces.holed_disk import holed_disk

    from cembench.conformal.patches import filled
    from cembench.mesh.files import read_mesh
    from cembench.mesh.triangle_mesh import HoledMesh

    surface = read_mesh(mesh, HoledMesh) if mesh else holed_disk(faces, holes=holes)
    outer, inner = surface.outer_and_holes()
    loops = [outer, *inner]
    disks = [
        filled(surface, [loop for j, loop in enumerate(loops) if j != k]) for k in range(len(loops))
    ]

    def apart() -> None:
        for disk in disks:
            cem(disk.fresh())

    calls = {
        "koebe": lambda: koebe_cem(surface.fresh()),
        "four": lambda: koebe_cem(surface.fresh(), sweeps=4),
        "apart": apart,
    }
    timings = in_turns(calls, rounds)
    seconds = {name: median(one.total for one in many) for name, many in timings.items()}
    factoring = {
        name: median(sum(one.phases.get(phase, 0.0) for phase in FACTORING) for one in many)
        for name, many in timings.items()
    }
    return {
        "faces": surface.m,
        "holes": len(inner),
        "rim": sum(map(len, loops)),
        "koebe": seconds["koebe"],
        "more": (seconds["four"] - seconds["koebe"]) / 3,
        "apart": seconds["apart"],
        "factoring": factoring["koebe"],
        "factoring_apart": factoring["apart"],
        "ratio": factoring["koebe"] / factoring["apart"],
    }
