"""What seams buy: the UVs that public models come with, against the best maps of cembench.

Of the public surfaces that are fetched (`cembench fetch --group all`), those whose files hold UVs.
"""

from __future__ import annotations

from collections.abc import Mapping
from statistics import median
from typing import Any

import cembench
from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.api.measurement import COMPARABLE, ISLANDS, WHOLE, Best
from cembench.conformal.texel_density import density_words
from cembench.core.errors import MeshError
from cembench.mesh.datasets import is_fetched
from cembench.registry import load_registry

LAYOUT = """
| surface | islands | folds | overlap | angle error, as made | same islands | one chart | density, as made | same islands | one chart |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|
| {name} | {islands:,} | {folds:,} | {overlap} | {made:.2f} | {again:.2f} | {chart:.2f} | {made_density} | {again_density} | {chart_density} |"""  # noqa: E501
#: Mean angle error in degrees below which UVs are those of a flat surface, which say nothing here.
FLAT = 1e-3


def measured_uvs() -> Section:
    """Measure the UVs of public models, of the same islands mapped anew, and of one chart."""
    fetched = [one for one in load_registry().datasets.values() if is_fetched(one)]
    rows = [row for one in progress(fetched) if (row := _row(one.name, one.path)) is not None]
    rows.sort(key=lambda row: row["name"])
    return Section([_words(rows, len(fetched)), Table(rows, LAYOUT)], "docs/measure.md")


def _row(name: str, path: Any) -> dict[str, Any] | None:
    """Return the figures of a file's UVs; None if it has none, or its surface is flat."""
    try:
        found = cembench.measure(path, against="best")
    except MeshError:
        return None
    chart, again = (_whole(found.best, which) for which in (WHOLE, ISLANDS))
    if chart is not None and chart.angle_error_mean_deg < FLAT:
        return None
    m = found.metrics
    inside, between = m["overlap_inside_islands"], m["overlap_between_islands"]
    overlap = None if inside is None or between is None else inside + between
    return {
        "name": name,
        "islands": m["islands"],
        "folds": m["flipped_triangles"],
        "overlap": None if overlap is None else f"{100 * overlap:.0f} %",
        "made": m["angle_error_mean_deg"],
        "again": again and again.angle_error_mean_deg,
        "chart": chart and chart.angle_error_mean_deg,
        "made_density": _density(m["texel_density_ratio"]),
        "again_density": again and _density(again.texel_density_ratio),
        "chart_density": chart and _density(chart.texel_density_ratio),
    }


def _whole(best: Mapping[str, Best], which: str) -> Best | None:
    """Return the best maps of a kind, if nearly all of the surface was mapped."""
    one = best.get(which)
    return one if one is not None and one.share >= COMPARABLE else None


def _density(ratio: float | None) -> str:
    return "no bound" if ratio is None else density_words(ratio)


def _words(rows: list[dict[str, Any]], fetched: int) -> str:
    both = [row for row in rows if None not in (row["again"], row["chart"])]
    if not both:
        raise SystemExit("no fetched surface has UVs: cembench fetch --group corpus fetches some.")
    made, again, chart = (median(row[name] for row in both) for name in ("made", "again", "chart"))
    folded = sum(row["folds"] > 0 for row in rows)
    better = sum(row["chart"] < row["made"] for row in both)
    return (
        f"**One conformal chart without seams has smaller angle errors than the UVs that "
        f"{better} of {len(both)} public models come with** (medians {chart:.2f} and {made:.2f} "
        f"degrees; the same islands mapped anew have {again:.2f}). What their seams buy is an even "
        f"texel density. {folded} of {len(rows)} have folds. These are the models among {fetched} "
        "fetched surfaces whose files hold UVs and that are not flat; density is the largest over "
        "the smallest, without a hundredth at either end; a dash: less than 95 % could be mapped."
    )
