"""Every disk and free-boundary algorithm on a folder of meshes. Fills docs/algorithms.md.

One call each, for what a map is: its status and figures, no seconds, which a busy machine spoils::

    python benchmarks/field.py ../meshes
    python benchmarks/field.py ../meshes --results field.json   # kept, and continued
"""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cembench.conformal.gauge import gauge_measure, moved_to_gauge
from cembench.conformal.metrics import all_metrics
from cembench.core.atomic import write_text
from cembench.core.errors import CembenchError
from cembench.mesh.files import read_mesh
from cembench.mesh.reading import is_named_like_a_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import Algorithm, load_registry
from cembench.running.judge import faults

PAGE = Path(__file__).parents[1] / "docs/algorithms.md"
BEGIN, END = "<!-- table: made by benchmarks/field.py -->", "<!-- end of the field -->"
#: Two of a kind are told once.
LEFT_OUT = ("chinese_lion.mat",)
FOLDERS = (".", "stress")


def main() -> None:
    """Measure what is not in the results yet, and write the tables into the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("meshes", type=Path, help="folder of disks; `stress` in it is read too")
    parser.add_argument("--results", type=Path, help="JSON file to continue")
    parser.add_argument("--most-faces", type=int, default=10**9, help="measure no larger ones")
    chosen = parser.parse_args()
    warnings.simplefilter("ignore")
    kept: dict[str, Any] = {}
    if chosen.results and chosen.results.is_file():
        kept = json.loads(chosen.results.read_text(encoding="utf-8"))
    known = [a for a in load_registry().algorithms.values() if a.mesh_type is DiskMesh]
    found = dict(disks(chosen.meshes))
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
    text = "\n\n".join(tables(kept, known))
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    write_text(PAGE, f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.partition(END)[2]}")


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
    """Status, mean angle error and E_C of one map; E_C of disks also in a common gauge."""
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
    }
    if spec.target == "disk" and not found:
        centred = moved_to_gauge(uv, gauge_measure(mesh, "area", mesh.boundary))
        row["centred"] = all_metrics(mesh, centred)["conformal_energy"]
    return row


def tables(kept: dict[str, Any], known: list[Algorithm]) -> Iterator[str]:
    """Mean angle error of both targets, then E_C: of free boundaries, and of disks in one gauge."""
    for target, figure, heading in (
        ("disk", "mean", "**Disk: mean angle error, degrees**"),
        ("disk", "centred", "**Disk: E_C with the area-weighted mean at 0**"),
        ("free boundary", "mean", "**Free boundary: mean angle error, degrees**"),
        ("free boundary", "energy", "**Free boundary: E_C, the image scaled to area pi**"),
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
    """A figure, the number of folds of an invalid map, a dash; nothing where it was not tried."""
    if not one:
        return ""
    if one.get("status") == "ok":
        return f"{one[figure]:.4g}"
    return f"{one['folds']} folds" if one.get("folds") else "-"


if __name__ == "__main__":
    main()
