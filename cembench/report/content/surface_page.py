"""The page of a surface: pictures of all algorithms, and all figures of merit."""

from __future__ import annotations

from collections.abc import Sequence

from cembench.conformal.metrics import Metric, metrics_shown
from cembench.report.content.evidence import DISK, Evidence, MeasuredSurface
from cembench.report.content.figures.angle_histograms import histogram
from cembench.report.content.figures.energy_by_iteration import history_panel
from cembench.report.content.figures.time_by_phase import phases_panel
from cembench.report.content.inspection import Inspection
from cembench.report.content.printed_beside_measured import significant
from cembench.report.document import (
    ORIGINS,
    Column,
    Gallery,
    Gap,
    Item,
    Section,
    Table,
    Text,
    Value,
    words,
)
from cembench.report.plots import Axis, Plot, PlotPanel
from cembench.results.external_words import seconds_words
from cembench.results.records import Record

#: Upper end of the histograms on a page, in degrees.
SHOWN = 5.0
_METRICS = metrics_shown("overview", "page")


def surface_page(
    evidence: Evidence, surface: MeasuredSurface, seen: Inspection
) -> tuple[Section, Plot | None]:
    """Return the page without its plot, which :func:`with_plot` inserts, and the plot."""
    name = evidence.name_of(surface)
    items: list[Item] = [Text(_about(surface)), *notices(evidence, surface)]
    if seen.checkerboards:
        items.append(
            Gallery(
                f"{name}-maps",
                "The surface and its image by each algorithm, under one checkerboard",
                tuple(seen.checkerboards.values()),
                "Squares stay squares where a map is conformal. Squares that would be large on the "
                "surface are divided 3 by 3 in both panels. Folded triangles are red. Images are "
                "rotated to match the upright surface.",
                seen.scene,
            )
        )
    if seen.curvature and seen.mesh:
        items.append(
            Gallery(f"{name}-surface", "Mean curvature and mesh", (seen.curvature, seen.mesh))
        )
    if not seen.kept:
        command = "repeat the command of the run: it adds the surfaces and measures nothing twice"
        items.append(Gap("Pictures", f"{seen.missing_reason}.", command))
    items.append(figures_table(evidence, surface, name))
    section = Section(f"surface-{name}", surface.title, tuple(items), page=True)
    return section, _plot(evidence, surface, seen, name)


def _about(surface: MeasuredSurface) -> str:
    about = (
        f"{surface.vertices:,} vertices, {surface.faces:,} triangles, "
        f"{surface.boundary_vertices:,} boundary vertices; {surface.non_delaunay_share:.1%} of the "
        "interior edges are not Delaunay. "
    )
    if surface.paper_row and surface.origin == "stand-in":
        return about + f"{surface.name}: a stand-in for {surface.paper_row}, not the paper's model."
    kind = ORIGINS[surface.origin][0].removeprefix("measured here on ")
    return about + f"{surface.name}: {kind}."


def notices(evidence: Evidence, surface: MeasuredSurface) -> list[Text]:
    """Return the notices about the mesh."""
    record = next(r for r in evidence.records if r.cell.mesh_hash == surface.mesh_hash)
    return [Text(f"Note: {notice}.") for notice in record.mesh.notices]


def figures_table(evidence: Evidence, surface: MeasuredSurface, name: str) -> Table:
    """Return a table of all figures of merit on one surface, one row per cell."""
    columns = [
        Column("algorithm", numeric=False),
        Column("solves", numeric=False),
        Column("status", numeric=False),
        Column("seconds", unit="s"),
        Column("±%"),
        Column("iterations"),
        *(Column(metric.heading) for metric in _METRICS),
        Column("folds before"),
        Column("memory", unit="MiB"),
    ]
    rows, causes = [], []
    for series in evidence.series:
        for policy in evidence.policies:
            record = evidence.find(surface, series, policy)
            if record is None:
                continue
            star = "" if series.target == DISK else " *"
            rows.append(_line(evidence, surface, record, series.label + star))
            if record.outcome.cause:
                causes.append(f"{series.label} ({policy}): {evidence.missing_reason(record)}")
            told = seconds_words(record)
            causes += [f"{series.label}: {told}"] if told else []
            causes += [f"{series.label} ({policy}): {note}" for note in record.outcome.notes]
    starred = sorted({s.target for s in evidence.series if s.target != DISK})
    if starred and any(row[0].text.endswith("*") for row in rows):
        causes.append(
            f"* not a map to the disk ({', '.join(starred)}): its E_C is not comparable with those "
            "of disks"
        )
    return Table(
        f"figures-{name}",
        f"{surface.title}: all figures",
        tuple(columns),
        tuple(rows),
        "Seconds are the median of the rounds, and ±% is half the width of its 95 % interval. "
        "angle° and SD° are the mean and the standard deviation of the angle errors in degrees. K "
        "is the dilatation: the ratio of a triangle's largest to its smallest stretch. |mu| is the "
        "modulus of the Beltrami coefficient, averaged over the surface's area. E_C of a disk map "
        "changes under Moebius maps of the disk. 'E_C, gauge' is E_C in the common gauge, with the "
        "area-weighted mean at 0; compare that one between methods. area SD is the standard "
        "deviation of log area ratios, for disk maps in the same gauge. 'folds before' counts the "
        "folded triangles of the map as the method made it, before the repair that all methods "
        "share. Memory is the increase during the call.",
        tuple(dict.fromkeys(causes)),
    )


def _line(
    evidence: Evidence, surface: MeasuredSurface, record: Record, label: str
) -> tuple[Value, ...]:
    outcome, row, key = record.outcome, evidence.row(record), record.cell.key
    why = evidence.missing_reason(record)

    def value(number: float | None, text: str, lacking: str = "not measured") -> Value:
        if number is None:
            reason = why if outcome.status != "ok" else lacking
            return Value("-", None, "", key, reason)
        return Value(text, float(number), surface.origin, key)

    seconds = outcome.median_seconds
    low, high = row["seconds_low"], row["seconds_high"]
    half = None if low is None or not seconds else 50 * (high - low) / seconds
    mark = f"{'!' if row['unstable'] else ''} {evidence.machines.of(record)}".rstrip()
    cells = [
        words(label),
        words(record.cell.solves),
        Value(outcome.status, None, "", key, outcome.cause or ""),
        value(seconds, significant(seconds or 0.0) + mark),
        value(half, f"{half or 0:.0f}", "fewer than six rounds"),
        value(outcome.iterations, str(outcome.iterations)),
    ]
    for metric in _METRICS:
        number = outcome.metrics.get(metric.name)
        lacking = "infinite" if metric.name in outcome.metrics else _absent(record, metric)
        cells.append(value(number, metric.text(number), lacking))
    folded = outcome.folded_before_repair
    cells.append(value(folded, str(folded), "not counted by the algorithm"))
    memory = outcome.memory_increase_bytes
    mib = None if memory is None else memory / 2**20
    cells.append(value(mib, f"{mib or 0:,.0f}"))
    return tuple(cells)


def _absent(record: Record, metric: Metric) -> str:
    """Return why a record lacks a figure: the map has none, or the record is older."""
    free = record.target in ("free boundary", "atlas")
    if free and metric.name == "common_gauge_energy":
        return "the map does not go to the disk"
    return "not measured"


def _plot(evidence: Evidence, surface: MeasuredSurface, seen: Inspection, name: str) -> Plot | None:
    """Return the plot of histograms, energies by iteration and phases, as available."""
    panels: list[PlotPanel] = []
    curves = [
        histogram(s.label, seen.angles[s.label], evidence.styles[s.label], SHOWN, "line")
        for s in evidence.series
        if s.label in seen.angles
    ]
    if curves:
        axis = Axis("angular distortion (degrees)", low=0, high=SHOWN)
        panels.append(PlotPanel(axis, Axis("corners (%)", low=0), tuple(curves), "angles"))
    history = history_panel(evidence, surface, "energy against iterations")
    phases = phases_panel(evidence, surface, evidence.policies[0])
    panels += [panel for panel in (history, phases) if panel]
    if not panels:
        return None
    return Plot(
        f"{name}-plots",
        f"{surface.title}: angles, energy and time",
        tuple(panels),
        _caption(panels),
        "Curves of the angular distortion for each algorithm, and bars of the time by phase.",
        columns=3,
    )


def _caption(panels: Sequence[PlotPanel]) -> str:
    about = {
        "angles": "share of the corners by angular distortion, in bins of a tenth of a degree",
        "energy against iterations": "conformal energy after each iteration of CEM",
    }
    parts = [about.get(panel.title, "seconds by phase of the measured call") for panel in panels]
    return "From left to right: " + "; ".join(parts) + "."
