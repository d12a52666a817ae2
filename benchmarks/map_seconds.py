"""What a user waits for: `cembench map` from start to end, and `cembench.parameterize`."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from time import perf_counter

import psutil

import cembench
from benchmarks.measuring import progress
from benchmarks.pages import Section, Table

LAYOUT = """
| triangles | `map` of OBJ | of PLY | `parameterize` | with `check="fast"` | the call itself |
|---:|---:|---:|---:|---:|---:|
| {faces:,} | {obj:.2f} | {ply:.2f} | {full:.3f} | {fast:.3f} | {call:.3f} |"""


def map_seconds(
    faces: Sequence[int] = (1_000, 34_000, 276_000, 1_100_000), *, rounds: int = 3
) -> Section:
    """Measure what a user waits for: `map` as a whole process, and the call in Python.

    Surfaces are hemi-ellipsoids, the map is the default one, and `map` writes what it reads, with
    UVs. All of a round's measurements follow one another.
    """
    load = psutil.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder:
        rows = [_row(number, rounds, Path(folder)) for number in progress(faces)]
    start = median(_seconds("--help") for _ in range(rounds))
    how = (
        f"Seconds, medians of {rounds} rounds, at a load of {load:.1f} when it began. "
        f"`cembench --help` takes {start:.2f}."
    )
    return Section([Table(rows, LAYOUT), how], "docs/maps.md")


def _row(faces: int, rounds: int, folder: Path) -> dict[str, float]:
    mesh = cembench.surface("hemi-ellipsoid", faces)
    for form in ("obj", "ply"):
        cembench.write_mesh(folder / f"{faces}.{form}", mesh)
    cembench.parameterize(mesh)  # loads what every later call needs
    runs = [_round(mesh, faces, folder) for _ in range(rounds)]
    return {"faces": mesh.m} | {key: median(run[key] for run in runs) for key in runs[0]}


def _round(mesh: cembench.TriangleMesh, faces: int, folder: Path) -> dict[str, float]:
    seconds = {
        form: _seconds("map", f"{folder}/{faces}.{form}", "-o", f"{folder}/uv.{form}", "--force")
        for form in ("obj", "ply")
    }
    for check in ("full", "fast"):
        start = perf_counter()
        result = cembench.parameterize(mesh.fresh(), check=check)
        seconds[check] = perf_counter() - start
        seconds["call"] = result.seconds or 0.0
    return seconds


def _seconds(*arguments: str) -> float:
    start = perf_counter()
    command = [sys.executable, "-m", "cembench", *arguments]
    subprocess.run(command, check=True, capture_output=True)
    return perf_counter() - start
