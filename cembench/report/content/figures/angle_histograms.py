"""Histograms of the angular distortions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cembench.report.content.evidence import Evidence
from cembench.report.content.figures.energy_by_iteration import model_gap
from cembench.report.content.inspection import BIN, LAST, Angles, Inspection
from cembench.report.document import Gap
from cembench.report.palette import SeriesStyle, series_styles
from cembench.report.plots import Axis, Plot, PlotPanel, PlotSeries

#: Degree threshold of the paper's figure.
SHOWN = 4.0


def angle_histograms(
    evidence: Evidence, inspections: Mapping[str, Inspection]
) -> tuple[Plot | None, list[Gap]]:
    """Return the plot of the paper's models in the run, and a gap for each missing one."""
    series = evidence.series_of(evidence.reference)
    panels, gaps = [], []
    wanted = evidence.paper.plotted("angle_histograms")
    for model in wanted.models:
        surface = evidence.surface_for_model(model)
        seen = inspections[surface.mesh_hash] if surface else None
        angles = seen.angles.get(series.label) if seen and series else None
        if angles and surface:
            panels.append(_panel(f"{model} ({surface.origin})", angles, evidence.reference))
        elif seen and not seen.kept:
            gaps.append(Gap(f"{wanted.figure}: {model}", seen.missing_reason))
        else:
            gaps.append(model_gap(evidence, model, wanted.figure))
    if not panels:
        return None, gaps
    plot = Plot(
        wanted.anchor,
        "Histograms of the angular distortion of CEM's maps",
        tuple(panels),
        f"Share of the corners in bins of {BIN:g} degrees, recomputed from the stored maps. Each "
        f"heading gives the share below one degree. Bars above {SHOWN:g} degrees are left out.",
        "Bars that are highest near zero degrees and fall off quickly.",
        wanted.figure,
    )
    return plot, gaps


def _panel(title: str, angles: Angles, name: str) -> PlotPanel:
    bars = histogram(name.upper(), angles, series_styles([name])[name], SHOWN)
    heading = f"{title}: {angles.below_one:.1%} below 1°"
    return PlotPanel(
        Axis("angular distortion (degrees)", low=0, high=SHOWN),
        Axis("corners (%)"),
        (bars,),
        heading,
    )


def histogram(
    name: str, angles: Angles, look: SeriesStyle, shown: float = LAST, kind: str = "bars"
) -> PlotSeries:
    """Return the bins up to `shown` degrees, in percent of all corners."""
    count = round(shown / BIN)
    middles = (np.arange(count) + 0.5) * BIN
    shares = 100 * angles.shares[:count]
    x, y = [round(float(v), 6) for v in middles], [float(v) for v in shares]
    return PlotSeries(name, x, y, "bars" if kind == "bars" else "line", look)
