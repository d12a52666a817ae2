"""How round do holes become by Algorithm 2 as printed, and what does that cost in angles?"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.holed_surfaces import holed_below
from benchmarks.measuring import progress
from benchmarks.pages import Section
from cembench.conformal.metrics import angle_errors
from cembench.core.errors import AlgorithmFailed, NotPositiveDefinite
from cembench.mesh.triangle_mesh import HoledMesh
from cembench.registry import load_registry
from cembench.results.papers import find_paper
from cembench.running.surfaces import generate_surface

#: Generated surfaces beside those of the folders.
GENERATED = ("holed-cap", "ho-face-with-holes")
#: Algorithm 2 as printed, and the reading that is used elsewhere here.
READINGS: dict[str, dict[str, Any]] = {
    "printed": {"patches": "fans", "weights": "plane"},
    "usual": {},
}
OFF_CIRCLE = find_paper("cem").numbers["off_circle"]
#: What is told of a map: how far its holes are from circles, and its angle error.
NAMES = ("off", "angle")
FILE = "docs/printed_koebe.csv"
HEADER = "surface,triangles,holes,printed_off_percent,printed_angle,usual_off_percent,usual_angle"


def printed_koebe(folders: Sequence[Path], *, faces: int = 150_000) -> Section:
    """Map surfaces with holes by both readings of Algorithm 2, before holes are put on circles.

    Distances from circles are the largest, in percent of the radius.
    """
    registry = load_registry()
    surfaces: dict[str, Any] = {
        name: generate_surface(registry, name, 20_000) for name in GENERATED
    }
    surfaces |= holed_below(folders, faces)
    rows = []
    for name, mesh in progress(list(surfaces.items())):
        found = {what: mapped(mesh, reading) for what, reading in READINGS.items()}
        about = {"surface": name, "faces": mesh.m, "holes": len(mesh.loops) - 1}
        if any(found.values()):
            rows.append(about | {what: one or dict.fromkeys(NAMES) for what, one in found.items()})
    link = "[printed_koebe.csv](path:printed_koebe.csv) has each surface."
    return Section([f"{in_words(rows)} {link}"], "docs/holes.md", {FILE: as_csv(rows)})


def as_csv(rows: Sequence[dict[str, Any]]) -> str:
    """Return the figures of each surface as CSV; empty where a reading has no map."""
    lines = [HEADER]
    for row in rows:
        cells = [row["surface"], row["faces"], row["holes"]]
        for reading in READINGS:
            off, angle = (row[reading][name] for name in NAMES)
            cells += ["", ""] if off is None else [f"{off:.2g}", f"{angle:.2f}"]
        lines.append(",".join(map(str, cells)))
    return "\n".join([*lines, ""])


def mapped(mesh: HoledMesh, reading: dict[str, Any]) -> dict[str, float]:
    """Return how far holes are from circles, and the angle error; nothing if there is no map."""
    koebe = load_registry().algorithm("koebe-cem")
    try:
        made = koebe.function(mesh.fresh(), **koebe.arguments(reading))
    except (AlgorithmFailed, NotPositiveDefinite):
        return {}
    off = 100 * float(made.extras["circularity_before_rounding"])
    return {"off": off, "angle": float(angle_errors(mesh, made.uv).mean())}


def in_words(rows: Sequence[dict[str, Any]]) -> str:
    """Return on how many surfaces the holes are circles, and the price in angles."""

    def near(what: str) -> str:
        known = [row[what]["off"] for row in rows if row[what]["off"] is not None]
        close = sum(off < OFF_CIRCLE for off in known)
        return f"{close} of {len(known)} (median {median(known):.2g} % off)"

    both = [row for row in rows if all(row[what]["off"] is not None for what in READINGS)]
    price = median(row["printed"]["angle"] / row["usual"]["angle"] for row in both)
    return (
        f"Within {OFF_CIRCLE} % of a circle before they are put on one: as printed on "
        f"{near('printed')}, by the usual reading on {near('usual')}. As printed, the mean angle "
        f"error is {price:.1f} times that of the usual reading in the median."
    )
