"""How often, how well and how fast algorithms map the real disks."""

from __future__ import annotations

from collections import Counter, defaultdict
from pathlib import Path
from statistics import mean

import matplotlib as mpl
import numpy as np

from benchmarks.measuring import png
from benchmarks.pages import ROOT, Section
from cembench.report.content.standings import FLOOR
from cembench.results.families import family_means, share_interval
from cembench.results.report_records import text_rows

mpl.use("Agg")
import matplotlib.pyplot as plt

TARGETS = {"disk": "#0072B2", "free boundary": "#D55E00"}
#: Ranges are drawn between these shares of the surfaces.
SHARES = (10, 50, 90)


def by_algorithm(report: Path) -> dict[str, list[dict[str, str]]]:
    """Return the rows of disks' maps, to the disk or free, by the algorithm's title."""
    values = defaultdict(list)
    rows = list(text_rows(report))
    disks = {row["mesh"] for row in rows if row["target"] == "disk"}
    for row in rows:
        if row["target"] in TARGETS and row["mesh"] in disks:
            values[row["title"]].append(row)
    return dict(values)


def family_of(row: dict[str, str]) -> str:
    """Return the object that a row's surface shows."""
    return row.get("family") or row["mesh"]


def over_best(
    rows: dict[str, list[dict[str, str]]], column: str, least: float = 0.0
) -> dict[str, list[tuple[float, float]]]:
    """Return each valid map's figure over the smallest on its surface, by algorithm.

    Beside it is its weight: a family's is divided among its surfaces. Smaller figures than `least`
    count as this: on a flat surface the best error is rounding.
    """
    families = {r["mesh_hash"]: family_of(r) for some in rows.values() for r in some}
    valid = {
        name: {r["mesh_hash"]: max(float(r[column]), least) for r in some if r["status"] == "ok"}
        for name, some in rows.items()
    }
    best: dict[str, float] = {}
    for figures in valid.values():
        for surface, figure in figures.items():
            best[surface] = min(figure, best.get(surface, np.inf))
    counts = {name: Counter(families[s] for s in figures) for name, figures in valid.items()}
    return {
        name: [(f / best[s], 1 / counts[name][families[s]]) for s, f in figures.items()]
        for name, figures in valid.items()
    }


def _percentiles(weighted: list[tuple[float, float]]) -> list[float]:
    values, weights = zip(*weighted, strict=True)
    return list(np.percentile(values, SHARES, weights=weights, method="inverted_cdf"))


def real_picture(*, report: Path = ROOT / "reports/real") -> Section:
    """Draw how often, how well and how fast algorithms map the real disks, from a kept report."""
    rows = by_algorithm(report)
    errors = over_best(rows, "angle_error_mean_deg", FLOOR)
    seconds = over_best(rows, "seconds")
    names = sorted(rows, key=lambda name: -_percentiles(errors[name])[1])
    colours = [TARGETS[rows[name][0]["target"]] for name in names]
    figure, axes = plt.subplots(1, 3, figsize=(9, 4.6), sharey=True, layout="constrained")
    for y, (name, colour) in enumerate(zip(names, colours, strict=True)):
        shares = family_means(
            [r["status"] == "ok" for r in rows[name]], list(map(family_of, rows[name]))
        )
        likely = share_interval(mean(shares), len(shares))
        axes[0].plot([100 * likely.low, 100 * likely.high], [y, y], color=colour, lw=1.2)
        axes[0].plot(100 * mean(shares), y, "o", color=colour, ms=5)
        for axis, figures in ((axes[1], errors), (axes[2], seconds)):
            least, middle, most = _percentiles(figures[name])
            axis.plot([least, most], [y, y], color=colour, lw=1.2)
            axis.plot(middle, y, "o", color=colour, ms=5)
    axes[0].set_yticks(range(len(names)), names, fontsize=8)
    titles = ("valid maps, % (95 % interval)", "mean angle error, times the best",
              "seconds, times the fastest")  # fmt: skip
    for axis, title in zip(axes, titles, strict=True):
        axis.set_title(title, fontsize=9)
        axis.grid(axis="x", alpha=0.3)
        axis.tick_params(axis="x", labelsize=8)
        axis.spines[["top", "right"]].set_visible(False)
    for axis in axes[1:]:
        axis.set_xscale("log")
        axis.xaxis.set_major_formatter("{x:g}")
    for target, colour in TARGETS.items():
        axes[0].plot([], [], "o", color=colour, ms=5, label=target)
    axes[0].legend(fontsize=8, loc="lower left")
    return Section([], files={"docs/real.png": png(figure, dpi=110)})
