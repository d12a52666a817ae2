"""What a declared plot has its points from: a run's frame, or one that is made of it.

Each function takes a part of a run's frame and returns another frame, with a row for each
iteration, phase, bin of a histogram, or printed figure, beside the columns of the records.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from cembench.report.content.evidence import Evidence
from cembench.report.content.inspection import BIN, Inspection, angles_of
from cembench.results.papers import Paper

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
    """Return means over surfaces by algorithm and phase: `share` in percent, `phase_seconds`."""
    import pandas as pd

    rows: list[dict[str, Any]] = []
    timed = frame[frame["phases"].astype(bool)]
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
        found = held.angles.get(label) if held else angles_of(evidence, evidence.by_key[key])
        if found is None:
            continue
        middles = ((np.arange(len(found.shares)) + 0.5) * BIN).round(6)
        bins = frame[frame["key"] == key]
        bins = bins.loc[bins.index.repeat(len(middles))]
        bins = bins.assign(angle=middles, corners=100 * found.shares)
        parts.append(bins.assign(below_one_degree=found.below_one))
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

    `measured` says whether the run has a surface for the model. `seconds_table` is the number of
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
                    value = paper.tables[table].get(model, {}).get(one.printed.format(algorithm))
                    row |= {one.column: value if one.only in ("", algorithm) else None}
                    row |= {f"{one.column}_table": table}
            rows.append(row)
    return pd.DataFrame(rows).astype(dict.fromkeys(_figures(paper), float))


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
