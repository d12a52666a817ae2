"""What seams buy: the UVs that public models come with, against the best maps of cembench.

Of the public surfaces that `cembench fetch --group corpus` fetched, those whose files hold UVs.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
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
| model | islands | folds | overlap | angle error made | islands anew | one chart | density made | islands anew | one chart |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|
| {name} | {islands:,} | {folds:,} | {overlap} | {made:.2f} | {again:.2f} | {chart:.2f} | {uneven_made} | {uneven_again} | {uneven_chart} |"""  # noqa: E501
#: Mean angle error in degrees below which UVs are those of a flat surface, which say nothing here.
FLAT = 1e-3


def measured_uvs() -> Section:
    """Measure the UVs of public models, of the same islands mapped anew, and of one chart."""
    fetched = [one for one in load_registry().datasets.values() if is_fetched(one)]
    rows = [row for one in progress(fetched) if (row := _row(one.name, one.path)) is not None]
    whole = [row for row in rows if None not in (row["again"], row["chart"])]
    if not whole:
        raise SystemExit("no fetched surface has UVs: cembench fetch --group corpus fetches some.")
    whole.sort(key=lambda row: row["name"])
    return Section([_words(whole, len(rows)), Table(whole, LAYOUT)], "docs/measure.md")


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
    density = {
        "made": m["texel_density_ratio"],
        "again": again and again.texel_density_ratio,
        "chart": chart and chart.texel_density_ratio,
    }
    return {
        "name": name,
        "islands": m["islands"],
        "folds": m["flipped_triangles"],
        "overlap": None if overlap is None else f"{100 * overlap:.0f} %",
        "made": m["angle_error_mean_deg"],
        "again": again and again.angle_error_mean_deg,
        "chart": chart and chart.angle_error_mean_deg,
        "density": {which: ratio or inf for which, ratio in density.items()},
        **{f"uneven_{which}": density_words(ratio or inf) for which, ratio in density.items()},
    }


def _whole(best: Mapping[str, Best], which: str) -> Best | None:
    """Return the best maps of a kind, if nearly all of the surface was mapped."""
    one = best.get(which)
    return one if one is not None and one.share >= COMPARABLE else None


def _words(rows: list[dict[str, Any]], all_with_uvs: int) -> str:
    made, again, chart = (median(row[name] for row in rows) for name in ("made", "again", "chart"))
    uneven_made, uneven_chart = (
        density_words(median(row["density"][name] for row in rows)) for name in ("made", "chart")
    )
    better = sum(row["chart"] < row["made"] for row in rows)
    return (
        f"**The UVs of {better} of {len(rows)} public models have larger angle errors than one "
        f"conformal chart without their seams** (medians {made:.2f} and {chart:.2f} degrees; the "
        f"same islands mapped anew have {again:.2f}). What the seams buy is an even texel density: "
        f"its largest over its smallest has the median {uneven_made}, in one chart {uneven_chart}. "
        f"{sum(row['folds'] > 0 for row in rows)} of {len(rows)} have folds. Of {all_with_uvs} "
        "public surfaces with UVs that are not flat, these are the ones of which at least 95 % "
        "could be mapped both ways."
    )
