"""Every disk and free-boundary algorithm on a folder of meshes."""

from __future__ import annotations

import csv
import io
import json
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.conformal.metrics import all_metrics
from cembench.core.atomic import write_text
from cembench.core.errors import CembenchError
from cembench.mesh.files import is_named_like_a_mesh, read_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import Algorithm, load_registry
from cembench.running.map_promises import faults

#: Two of a kind are measured once.
LEFT_OUT = ("chinese_lion.mat",)
FOLDERS = (".", "stress")
#: The figure whose tables the page of the algorithms has; the others are in a file beside it.
SHOWN, FILE = "mean", "docs/field.csv"
#: The tables of each target: figure and heading; E_C of disks in one gauge.
TABLES = {
    "disk": {
        "mean": "**Disk: mean angle error, degrees**",
        "mu": "**Disk: mean of |mu| over the surface's area**",
        "centred": "**Disk: E_C with the area-weighted mean at 0**",
        "area": "**Disk: SD of log area ratios, in that gauge**",
    },
    "free boundary": {
        "mean": "**Free boundary: mean angle error, degrees**",
        "mu": "**Free boundary: mean of |mu| over the surface's area**",
        "energy": "**Free boundary: E_C, the image scaled to area pi**",
        "area": "**Free boundary: SD of log area ratios**",
    },
}


def field(folder: Path, *, results: Path | None = None, most_faces: int = 10**9) -> Section:
    """Call every algorithm for disks once on the meshes of a folder.

    For what a map is: its status and figures. `stress` in the folder is read too. With --results,
    a JSON file, what it has is not measured again. The cost is the study `field_seconds`.
    """
    warnings.simplefilter("ignore")
    measured: dict[str, Any] = {}
    if results and results.is_file():
        measured = json.loads(results.read_text(encoding="utf-8"))
    meshes = sorted(disks(folder), key=lambda item: item[1].m)
    if not meshes:
        sys.exit(f"{folder} has no disk.")
    meshes = [(name, mesh) for name, mesh in meshes if mesh.m <= most_faces]
    for name, mesh in progress(meshes):
        row = measured.setdefault(name, {"triangles": mesh.m, "maps": {}})
        for spec in algorithms():
            if spec.name not in row["maps"]:
                row["maps"][spec.name] = figures(spec, mesh)
                if results:
                    write_text(results, json.dumps(measured, indent=1))
    shown: list[Table | str] = []
    others = []
    for figure, heading, table in tables(measured, algorithms()):
        if figure == SHOWN:
            shown.extend([heading, table])
        else:
            others.append((heading.strip("*"), table))
    return Section(shown, "docs/algorithms.md", {FILE: lines_of(others)})


def lines_of(chosen: list[tuple[str, Table]]) -> str:
    """Return tables as CSV, a line for each surface and algorithm."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["figure", "surface", "triangles", "algorithm", "value"])
    for heading, table in chosen:
        for row in table.rows:
            names = [name for name in row if name not in ("surface", "triangles") and row[name]]
            about = [heading, row["surface"], row["triangles"]]
            writer.writerows([*about, name, row[name]] for name in names)
    return text.getvalue()


def algorithms() -> list[Algorithm]:
    """Return the algorithms that take a disk."""
    return [one for one in load_registry().algorithms.values() if one.mesh_type is DiskMesh]


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
    wrong = faults(spec, mesh, uv)
    row = {
        "status": "invalid" if wrong else "ok",
        "faults": [fault.detail for fault in wrong],
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


def tables(measured: dict[str, Any], known: list[Algorithm]) -> Iterator[tuple[str, str, Table]]:
    """Yield what compares between methods, of both targets: figure, heading and table."""
    ordered = sorted(measured.items(), key=lambda item: item[1]["triangles"])
    for target, headings in TABLES.items():
        names = [spec.name for spec in known if spec.target == target]
        layout = (
            f"| surface | triangles | {' | '.join(names)} |\n|---|{'---:|' * (len(names) + 1)}\n"
        )
        layout += f"| {{surface}} | {{triangles:,}} | {' | '.join(f'{{{one}}}' for one in names)} |"
        for figure, heading in headings.items():
            rows = [
                {"surface": surface, "triangles": row["triangles"]}
                | {name: cell(row["maps"].get(name, {}), figure) for name in names}
                for surface, row in ordered
            ]
            yield figure, heading, Table(rows, layout)


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
