"""What a declared plot has its points from, and what is computed of them.

Each function of :data:`ROWS` takes a part of a run's frame and returns another frame, with a row
for each iteration, phase, bin of a histogram, or printed figure, beside the columns of the records.
Power laws, a front, and performance profiles are drawn besides the points.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import inf
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from cembench.report.content.evidence import Evidence
from cembench.report.content.inspection import BIN, Inspection, angles_of
from cembench.report.document import Table, Value, entry, missing, words
from cembench.report.given_tables import given_table
from cembench.report.palette import PLAIN, SeriesStyle
from cembench.report.plots import PlotSeries, Point, through
from cembench.results.expressions import with_words
from cembench.results.families import average_interval
from cembench.results.multiple_testing import geometric
from cembench.results.papers import Paper
from cembench.results.power_law import FEWEST, fit

if TYPE_CHECKING:
    import pandas as pd


#: What is known of the maps of surfaces, by hash.
Inspections = Mapping[str, Inspection]
UNSEEN: Inspections = MappingProxyType({})


def _records(evidence: Evidence, frame: pd.DataFrame, seen: Inspections) -> pd.DataFrame:
    return frame


def _iterations(evidence: Evidence, frame: pd.DataFrame, seen: Inspections) -> pd.DataFrame:
    """Return E_C (`energy`) at the start (`iteration` 0) and after each iteration."""
    other = [bool(extras) and "energy_of" in extras for extras in frame["extras"]]
    longer = frame[~np.array(other, dtype=bool)].explode("energy_history")
    longer = longer[longer["energy_history"].notna()]
    number = longer.groupby(level=0).cumcount()
    return longer.assign(iteration=number, energy=longer["energy_history"].astype(float))


def _phases(evidence: Evidence, frame: pd.DataFrame, seen: Inspections) -> pd.DataFrame:
    """Return means over surfaces by algorithm and phase: `share` in percent, `phase_seconds`.

    Algorithms whose time is not divided, such as plug-ins, have no row.
    """
    import pandas as pd

    rows: list[dict[str, Any]] = []
    timed = frame[[bool(set(phases or ()) - {"other"}) for phases in frame["phases"]]]
    for _, group in timed.groupby(["solves", "series"], sort=False):
        about = group.iloc[0].to_dict()
        calls, n = list(group["phases"]), len(group)
        for phase in dict.fromkeys(name for phases in calls for name in phases):
            seconds = [phases.get(phase, 0.0) for phases in calls]
            total = [sum(phases.values()) or 1.0 for phases in calls]
            share = sum(100 * s / t for s, t in zip(seconds, total, strict=True)) / n
            means = {"share": share, "phase_seconds": sum(seconds) / n}
            name = {"phase": phase, "label_and_n": f"{about['label']} (n={n})"}
            rows.append(about | name | means | {"place": about["series"]})
    return pd.DataFrame(rows, columns=[*frame, "phase", "label_and_n", "share", "phase_seconds"])


def _angles(evidence: Evidence, frame: pd.DataFrame, seen: Inspections) -> pd.DataFrame:
    """Return the share of the `corners` in percent by `angle`, the middle of a bin in degrees."""
    import pandas as pd

    parts = []
    for key, of_surface, label in zip(
        frame["key"], frame["mesh_hash"], frame["label"], strict=True
    ):
        held = seen.get(of_surface)
        angles = held.angles.get(label) if held else angles_of(evidence, evidence.by_key[key])
        if angles is None:
            continue
        middles = ((np.arange(len(angles.shares)) + 0.5) * BIN).round(6)
        bins = frame[frame["key"] == key]
        bins = bins.loc[bins.index.repeat(len(middles))]
        bins = bins.assign(angle=middles, corners=100 * angles.shares)
        parts.append(bins.assign(below_one_degree=angles.below_one))
    return pd.concat(parts) if parts else frame.iloc[:0].assign(angle=(), corners=())


def _difficulty(evidence: Evidence, frame: pd.DataFrame, seen: Inspections) -> pd.DataFrame:
    """Return the records on surfaces with a map to the disk: `factor_span`, `boundary_crowding`."""
    known = evidence.difficulties
    frame = frame[frame["mesh_hash"].isin(list(known))]
    of = [known[key] for key in frame["mesh_hash"]]
    return frame.assign(
        factor_span=[one.span for one in of], boundary_crowding=[one.crowding for one in of]
    )


def printed(evidence: Evidence, *_: Any) -> pd.DataFrame:
    """Return what the paper printed, a row for each model and algorithm, as columns of the frame.

    `measured` says whether the run has a surface for the model; figures that the paper does not
    print are missing. `seconds_table` is the number of
    the table that the seconds are in, and so on.
    """
    import pandas as pd

    paper, rows = evidence.paper, []
    if not _figures(paper):
        return evidence.frame.iloc[:0].assign(measured=False)
    there = {surface.paper_row for surface in evidence.models}
    for place, model in enumerate(paper.models):
        for k, algorithm in enumerate(paper.algorithms):
            series = evidence.series_of(algorithm)
            label = series.label if series else algorithm.upper()
            row = {"surface": model, "model": model, "place": place, "faces": paper.faces(model)}
            row |= {"algorithm": algorithm, "label": label, "series": k, "main": True}
            row |= {"measured": model in there, "ok": True, "printed": True}
            for table, about in paper.printed.items():
                for one in about.figures:
                    value = (
                        paper.tables[table].get(model, {}).get(with_words(one.printed, algorithm))
                    )
                    row |= {one.column: value if one.only in ("", algorithm) else None}
                    row |= {f"{one.column}_table": table}
            rows.append(row)
    frame = pd.DataFrame(rows).astype(dict.fromkeys(_figures(paper), float))
    figures = evidence.frame.select_dtypes("number").columns
    return frame.reindex(columns=frame.columns.union(figures, sort=False))


def _figures(paper: Paper) -> set[str]:
    return {one.column for table in paper.printed.values() for one in table.figures}


#: The functions by what a row is.
ROWS: Mapping[str, Callable[[Evidence, pd.DataFrame, Inspections], pd.DataFrame]] = {
    "record": _records,
    "iteration": _iterations,
    "phase": _phases,
    "angle": _angles,
    "difficulty": _difficulty,
    "printed": printed,
}


def power_law(label: str, points: Sequence[Point], style: SeriesStyle) -> PlotSeries | None:
    """Return the line of a power law through points; None if there is none to fit."""
    law = fit([point[:2] for point in points])
    if law is None:
        return None
    ends = [min(p.x for p in points), max(p.x for p in points)]
    line = list(map(law.at, ends))
    tooltips = [f"{label}: exponent {law.exponent:.2f}"] * 2
    return PlotSeries(f"{label}, fitted", ends, line, "line", style, tooltips, named=False)


def average(
    label: str, cloud: Sequence[Point], families: Sequence[str], style: SeriesStyle
) -> PlotSeries:
    """Return the geometric mean of a cloud, with 95 % intervals over families if there are six."""
    sides = list(zip(*[point[:2] for point in cloud], strict=True))
    x, y = (float(geometric(np.array(side, dtype=float))) for side in sides)
    intervals = [average_interval(side, families) for side in sides]
    ends = None
    if intervals[0] and intervals[1]:
        ends = ((intervals[0].low, intervals[0].high), (intervals[1].low, intervals[1].high))
    words = [f"{label}: average over {len(cloud)} surfaces"]
    return PlotSeries(label, [x], [y], "mean", style, words, ends=ends)


def front(clouds: Mapping[str, Sequence[Point]]) -> PlotSeries:
    """Return the geometric means of clouds of points that none of the others beats in x and y."""
    means = []
    for label, cloud in clouds.items():
        x, y = geometric(np.array([point[:2] for point in cloud]).T)
        means.append(Point(float(x), float(y), label))

    def beats(one: Point, other: Point) -> bool:
        return one.x <= other.x and one.y <= other.y and one[:2] != other[:2]

    best = sorted(m for m in means if not any(beats(other, m) for other in means))
    return through("not beaten on average", best, "line", PLAIN)


def cost_ratios(frame: pd.DataFrame, cost: pd.Series, least: float = 0.0) -> pd.DataFrame:
    """Return costs over the smallest ones: a row for each surface, a column for each algorithm.

    Only surfaces that all of these algorithms were tried on, and one mapped, are in it. Variants
    are left out if they were tried on fewer surfaces than the algorithms' main choices.

    Parameters
    ----------
    frame : DataFrame
        Records, with `place` (of the surface), `label` and `main`.
    cost : Series
        Their costs, infinite where there is no good map.
    least : float
        Smaller costs count as this.
    """
    table = frame.assign(cost=cost).pivot(index="place", columns="label", values="cost")
    labels = frame.sort_values("series", kind="stable")[["label", "main"]].drop_duplicates("label")
    tried = table.notna().sum()
    fewest = tried[labels["label"][labels["main"]]].min() if labels["main"].any() else 0
    shown = [
        label for label, main in labels.itertuples(index=False) if main or tried[label] >= fewest
    ]
    table = table[shown].dropna().clip(lower=least)
    table = table[table.min(axis=1) < inf]
    return table.div(table.min(axis=1), axis=0)


def staircase(
    ratios: Sequence[float], last: float, weights: Sequence[float]
) -> tuple[list[float], list[float]]:
    """Return the performance profile of ratios: x up to `last`, and the share in percent.

    It is the weighted share of surfaces on which a cost is at most tau times the best one there
    (Dolan and More, 2002). Infinite ratios, where there is no good map, keep a curve below 100 %.

    >>> staircase([1.0, 2.0, inf, inf], 4.0, [1, 1, 1, 1])
    ([1.0, 1.0, 2.0, 4.0], [25.0, 25.0, 50.0, 50.0])
    """
    ordered = sorted(pair for pair in zip(ratios, weights, strict=True) if pair[0] <= last)
    x = [1.0, *(ratio for ratio, _ in ordered), last]
    return x, [100 * sum(w for r, w in ordered if r <= tau) / sum(weights) for tau in x]


def exponents_table(evidence: Evidence) -> Table:
    """Return a table of the fitted exponents, printed and measured, with standard errors and n."""
    rows = []
    there, measured = printed(evidence), evidence.frame
    for series in evidence.disk_series:
        of_paper = there[(there["algorithm"] == series.algorithm) & series.main]
        cells = [words(series.label), *_fit_cells(of_paper)]
        own = measured[measured["ok"] & (measured["label"] == series.label)]
        for policy in evidence.policies:
            cells += _fit_cells(own[own["solves"] == policy])
        rows.append(tuple(cells))
    groups = ["printed", *(f"here, {policy}" for policy in evidence.policies)]
    return given_table("exponents", rows, {"fewest": FEWEST}, each={"measured": groups})


def _fit_cells(timed: pd.DataFrame) -> list[Value]:
    law = fit(timed[timed["seconds"] > 0][["faces", "seconds"]].to_numpy(float).tolist())
    if law is None:
        return [missing(f"fewer than {FEWEST} sizes"), missing("no fit")]
    text = f"{law.exponent:.2f} ± {law.error:.2f}"
    return [Value(text, law.exponent, "derived"), entry(law.n, "d", "")]
