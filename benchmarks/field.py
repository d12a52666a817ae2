"""Every disk and free-boundary algorithm on a folder of meshes. Fills docs/algorithms.md.

One call each, for what a map is: its status and figures. With ``--seconds`` instead the table of
the cost on three surfaces: CPU seconds, each algorithm in turns with direct-cem in one process, so
that the ratio of both is what to rely on::

    python benchmarks/field.py ../meshes
    python benchmarks/field.py ../meshes --results field.json   # kept, and continued
    python benchmarks/field.py ../meshes --seconds              # on a quiet machine
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cembench.conformal.metrics import all_metrics
from cembench.core.atomic import write_text
from cembench.core.errors import CembenchError
from cembench.mesh.files import is_named_like_a_mesh, read_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import Algorithm, load_registry
from cembench.running.environment import for_measuring
from cembench.running.judge import faults

PAGE = Path(__file__).parents[1] / "docs/algorithms.md"
BEGIN, END = "<!-- table: made by benchmarks/field.py -->", "<!-- end of the field -->"
#: Two of a kind are told once.
LEFT_OUT = ("chinese_lion.mat",)
FOLDERS = (".", "stress")
#: What the cost is measured on and beside, and how often.
TIMED = ("chinese_lion.obj", "left_hand.obj", "jacksboro_dem.ply")
BESIDE, ROUNDS = "direct-cem", 3
SECONDS_BEGIN = "<!-- seconds: made by benchmarks/field.py -->"
SECONDS_END = "<!-- end of the seconds -->"


def main() -> None:
    """Measure what is not in the results yet, and write the tables into the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("meshes", type=Path, help="folder of disks; `stress` in it is read too")
    parser.add_argument("--results", type=Path, help="JSON file to continue")
    parser.add_argument("--most-faces", type=int, default=10**9, help="measure no larger ones")
    parser.add_argument("--seconds", action="store_true", help="the table of the cost alone")
    parser.add_argument("--longest", type=float, default=60, help="CPU seconds; longer: one call")
    chosen = parser.parse_args()
    # Libraries read them when they are loaded: this program starts anew with them.
    environment = for_measuring(1)
    if dict(os.environ) != environment:
        os.execve(sys.executable, [sys.executable, *sys.argv], environment)
    warnings.simplefilter("ignore")
    kept: dict[str, Any] = {}
    if chosen.results and chosen.results.is_file():
        kept = json.loads(chosen.results.read_text(encoding="utf-8"))
    known = [a for a in load_registry().algorithms.values() if a.mesh_type is DiskMesh]
    if chosen.seconds:
        costs = timed(chosen.meshes, known, chosen.longest)
        if not costs:
            sys.exit(f"{chosen.meshes} has none of {', '.join(TIMED)}: {PAGE.name} stays as it is.")
        fill(SECONDS_BEGIN, SECONDS_END, seconds_table(costs, known))
        return
    found = dict(disks(chosen.meshes))
    if not found:
        sys.exit(f"{chosen.meshes} has no disk: {PAGE.name} stays as it is.")
    for name, mesh in sorted(found.items(), key=lambda item: item[1].m):
        if mesh.m > chosen.most_faces:
            continue
        row = kept.setdefault(name, {"triangles": mesh.m, "maps": {}})
        for spec in known:
            if spec.name not in row["maps"]:
                row["maps"][spec.name] = figures(spec, mesh)
                print(name, spec.name, row["maps"][spec.name], file=sys.stderr, flush=True)
                if chosen.results:
                    write_text(chosen.results, json.dumps(kept, indent=1))
    fill(BEGIN, END, "\n\n".join(tables(kept, known)))


def fill(begin: str, end: str, text: str) -> None:
    """Put a text between two marks of the page."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(begin)
    write_text(PAGE, f"{before}{begin}\n\n{text}\n\n{end}{rest.partition(end)[2]}")


def timed(folder: Path, known: list[Algorithm], longest: float) -> dict[str, dict[str, Any]]:
    """CPU seconds of each algorithm, and of the one beside it, on the surfaces that are there."""
    found: dict[str, dict[str, Any]] = {}
    (beside,) = (spec for spec in known if spec.name == BESIDE)
    for name in TIMED:
        if not (folder / name).is_file():
            continue
        mesh = read_mesh(folder / name)
        row = found.setdefault(name, {"triangles": mesh.m})
        for spec in known:
            row[spec.name] = cost(spec, beside, mesh, longest)
            print(name, spec.name, row[spec.name], file=sys.stderr, flush=True)
    return found


def cost(
    spec: Algorithm, beside: Algorithm, mesh: DiskMesh, longest: float
) -> dict[str, float] | None:
    """Median CPU seconds after a call to warm up, and over those of the other; None: it refused."""
    pairs = []
    for k in range(ROUNDS + 1):
        try:
            pair = (cpu_seconds(spec, mesh), cpu_seconds(beside, mesh))
        except CembenchError:
            return None
        if k or pair[0] > longest:
            pairs.append(pair)
        if pair[0] > longest:
            break
    seconds = statistics.median(ours for ours, _ in pairs)
    return {"seconds": seconds, "ratio": statistics.median(a / b for a, b in pairs)}


def cpu_seconds(spec: Algorithm, mesh: DiskMesh) -> float:
    """CPU seconds of one call."""
    fresh = mesh.fresh()
    started = time.process_time()
    spec.function(fresh, **spec.arguments({}))
    return time.process_time() - started


def seconds_table(costs: dict[str, dict[str, Any]], known: list[Algorithm]) -> str:
    """A row an algorithm: CPU seconds and their ratio to direct-cem's on each surface."""
    heads = "".join(f" {name}, s | / {BESIDE} |" for name in costs)
    lines = [f"| algorithm | target |{heads}", f"|---|---|{'---:|' * (2 * len(costs))}"]
    for spec in known:
        cells = []
        for row in costs.values():
            one = row.get(spec.name)
            cells += ["-", "-"] if one is None else [f"{one['seconds']:.3g}", f"{one['ratio']:.2f}"]
        lines.append(f"| `{spec.name}` | {spec.target} | {' | '.join(cells)} |")
    return "\n".join(lines)


def disks(folder: Path) -> Iterator[tuple[str, DiskMesh]]:
    """The disks of a folder and of `stress` in it."""
    for sub in FOLDERS:
        for path in sorted((folder / sub).glob("*")):
            if is_named_like_a_mesh(path) and path.name not in LEFT_OUT:
                try:
                    yield path.name, read_mesh(path)
                except CembenchError:
                    continue


def figures(spec: Algorithm, mesh: DiskMesh) -> dict[str, Any]:
    """Status and figures of one map."""
    try:
        uv = spec.function(mesh.fresh(), **spec.arguments({})).uv
    except CembenchError as error:
        return {"status": "failed", "cause": str(error)}
    metrics = all_metrics(mesh, uv)
    found = faults(spec, mesh, uv)
    row = {
        "status": "invalid" if found else "ok",
        "faults": [fault.detail for fault in found],
        "mean": metrics["angle_error_mean_deg"],
        "energy": metrics["conformal_energy"],
        "folds": metrics["flipped_triangles"],
        "mu": metrics["beltrami_area_mean"],
        "area": metrics["area_distortion_sd"],
        "overlap": metrics["overlap_share"],
    }
    if "common_gauge_energy" in metrics:
        row["centred"] = metrics["common_gauge_energy"]
    return row


def tables(kept: dict[str, Any], known: list[Algorithm]) -> Iterator[str]:
    """What compares between methods, of both targets; E_C of disks in one gauge."""
    for target, figure, heading in (
        ("disk", "mean", "**Disk: mean angle error, degrees**"),
        ("disk", "mu", "**Disk: mean of |mu| over the surface's area**"),
        ("disk", "centred", "**Disk: E_C with the area-weighted mean at 0**"),
        ("disk", "area", "**Disk: SD of log area ratios, in that gauge**"),
        ("free boundary", "mean", "**Free boundary: mean angle error, degrees**"),
        ("free boundary", "mu", "**Free boundary: mean of |mu| over the surface's area**"),
        ("free boundary", "energy", "**Free boundary: E_C, the image scaled to area pi**"),
        ("free boundary", "area", "**Free boundary: SD of log area ratios**"),
    ):
        names = [spec.name for spec in known if spec.target == target]
        lines = [
            f"| surface | triangles | {' | '.join(names)} |",
            f"|---|{'---:|' * (len(names) + 1)}",
        ]
        for name, row in sorted(kept.items(), key=lambda item: item[1]["triangles"]):
            cells = [cell(row["maps"].get(one, {}), figure) for one in names]
            lines.append(f"| {name} | {row['triangles']:,} | {' | '.join(cells)} |")
        yield heading
        yield "\n".join(lines)


def cell(one: dict[str, Any], figure: str) -> str:
    """A figure, the number of folds of an invalid map, a dash; nothing where it was not tried.

    A star marks an image that overlaps itself.
    """
    if not one:
        return ""
    if one.get("status") == "ok":
        star = "*" if one.get("overlap") else ""
        return f"{one[figure]:.4g}{star}" if figure in one else ""
    return f"{one['folds']} folds" if one.get("folds") else "-"


if __name__ == "__main__":
    main()
