"""Plots as data, drawn by matplotlib and by Plotly.

A :class:`Plot` holds the contents of a plot, independent of the renderer. :func:`write_plot` draws
it with matplotlib (PNG, SVG, PDF), writes its data (CSV), and describes it for Plotly, all from the
same values. The same plot gives the same bytes.
"""

from __future__ import annotations

import csv
import io
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Literal, NamedTuple

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure as Canvas
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from PIL import Image

from cembench.core.atomic import write_bytes, write_text
from cembench.report.document import Figure, Item
from cembench.report.palette import PLAIN, SeriesStyle
from cembench.report.shared_drawing import draw

#: How a series is drawn: points, joined points, a staircase, bars side by side or stacked, faint
#: points, or large marks with intervals.
Kind = Literal["line", "points", "both", "steps", "bars", "stack", "cloud", "mean"]


@dataclass(frozen=True)
class PlotSeries:
    """A series of values; `x` are numbers or names, `words` the tooltip of each point.

    Stacked series have names as `x`.
    """

    name: str
    x: Sequence[float | str]
    y: Sequence[float | None]
    kind: Kind
    look: SeriesStyle = PLAIN
    words: Sequence[str] = ()
    #: Whether it is in the legend; one of several series with the same name is enough.
    named: bool = True
    #: Of a mean: the ends of its intervals in x and in y, where it has them.
    ends: tuple[tuple[float, float], tuple[float, float]] | None = None


class Point(NamedTuple):
    """A point with its tooltip."""

    x: float
    y: float
    words: str = ""


def through(
    name: str, points: Sequence[Point], kind: Kind, look: SeriesStyle = PLAIN, *, named: bool = True
) -> PlotSeries:
    """Return a series of points with their tooltips."""
    x, y = [p.x for p in points], [p.y for p in points]
    return PlotSeries(name, x, y, kind, look, [p.words for p in points], named)


@dataclass(frozen=True)
class Axis:
    """An axis: its label with unit, and its scale."""

    title: str
    log: bool = False
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class PlotPanel:
    """One pair of axes."""

    x: Axis
    y: Axis
    series: tuple[PlotSeries, ...]
    title: str = ""
    #: What it is of, in a plot with a panel for each of some: a model, a policy.
    of: str = ""


@dataclass(frozen=True)
class Plot:
    """Panels side by side, at most `columns` in a row, under one legend."""

    name: str
    title: str
    panels: tuple[PlotPanel, ...]
    caption: str = ""
    alternative: str = ""
    paper: str = ""
    columns: int = 2
    #: Whether panels whose axes have the same title have the same range.
    shared: bool = False

    @property
    def across(self) -> int:
        """Number of panels in a row; three make a row of their own, with no empty place."""
        n = len(self.panels)
        return n if n == 3 else min(self.columns, n)


#: The files of a plot: its formats, the first of which is the one to show.
FORMS = ("png", "svg", "pdf")
#: Size of a panel in inches; resolution of the PNG in dots per inch.
WIDTH, HEIGHT, DPI = 4.6, 3.3, 130
#: A logarithmic axis that spans less than this factor has ticks at 2 and 5 too.
DECADES = 300
#: A logarithmic axis that spans less than this factor is labelled as a linear one is.
SHORT = 5
#: From here on, and below, ticks of a logarithmic axis are written as powers of ten.
LARGE, SMALL = 10_000_000, 1e-5
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
#: Maximum number of ticks on an axis of integers.
TICKS = 8
#: Inches that a character of a legend's name takes, what is beside a name, and a line.
NAME_INCHES, MARK_INCHES, LINE_INCHES = 0.065, 0.6, 0.175
#: Reproducible output: fixed salt for identifiers, no date. Text in SVG stays text.
_STYLE: Any = {
    "svg.hashsalt": "cembench",
    "svg.fonttype": "none",
    "font.family": ["DejaVu Sans"],
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e3e7eb",
    "grid.linewidth": 0.6,
    "axes.edgecolor": "#6b7683",
    "axes.axisbelow": True,
    "text.parse_math": False,
}
_NO_DATE = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


def write_plot(plot: Plot, folder: Path) -> Figure:
    """Draw a plot into ``folder/figures``; return the report's figure with its files and data."""
    place = folder / "figures"
    draw(_draw_into, plot, place)
    write_text(place / f"{plot.name}.csv", data_of(plot))
    return Figure(
        name=plot.name,
        title=plot.title,
        files=tuple(PurePosixPath("figures", f"{plot.name}.{form}") for form in FORMS),
        caption=plot.caption,
        data=PurePosixPath("figures", f"{plot.name}.csv"),
        plot=plotly_of(plot),
        alternative=plot.alternative,
        paper=plot.paper,
    )


def drawn(items: Iterable[Plot | Item | None], folder: Path) -> list[Item]:
    """Return a report's items with plots as figures, drawn into ``folder/figures``."""
    return [write_plot(one, folder) if isinstance(one, Plot) else one for one in items if one]


def _draw_into(plot: Plot, place: Path) -> None:
    for form, content in _drawn(plot).items():
        write_bytes(place / f"{plot.name}.{form}", content)


def data_of(plot: Plot) -> str:
    """Return the plotted values as CSV, one line per point."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["panel", "series", "x", "y", "about"])
    for panel in plot.panels:
        for series in panel.series:
            words = series.words or [""] * len(series.x)
            for x, y, about in zip(series.x, series.y, words, strict=True):
                writer.writerow([panel.title, series.name, _plain(x), _plain(y), about])
    return text.getvalue()


def _plain(value: Any) -> Any:
    return float(value) if isinstance(value, np.floating) else value


def picture_of(plot: Plot) -> bytes:
    """Return a plot as a PNG file."""
    return _drawn(plot, ("png",))["png"]


def _drawn(plot: Plot, forms: Sequence[str] = FORMS) -> dict[str, bytes]:
    """Return the contents of the files by format, PNG first."""
    columns = plot.across
    rows = -(-len(plot.panels) // columns)
    tall = max((_width_of_names(panel) for panel in plot.panels), default=0.0)
    with rc_context(_STYLE), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # a box is drawn instead
        single = 1.35 if columns == 1 else 1.0
        width = columns * WIDTH * single
        series = (one for panel in plot.panels for one in panel.series)
        names = list(dict.fromkeys(one.name for one in series if one.named))
        across = _legend_columns(names, width)
        legend = LINE_INCHES * max(-(-len(names) // across), 2)
        size = (width, rows * (HEIGHT + tall) + legend)
        canvas = Canvas(figsize=size, dpi=DPI, facecolor="white")
        FigureCanvasAgg(canvas)
        for k, panel in enumerate(plot.panels):
            _draw_panel(canvas.add_subplot(rows, columns, k + 1), panel)
        if plot.shared:
            _share(canvas.axes)
        _draw_legend(canvas, across)
        ConstrainedLayoutEngine().execute(canvas)  # once: a canvas would repeat it in each format
        contents = {}
        for form in forms:
            buffer = io.BytesIO()
            canvas.savefig(buffer, format=form, metadata=_NO_DATE[form])
            contents[form] = buffer.getvalue()
    return contents | {"png": _with_few_colours(contents["png"])}


def _with_few_colours(png: bytes) -> bytes:
    """Return the same picture with a colour palette, less than half as large."""
    buffer = io.BytesIO()
    with Image.open(io.BytesIO(png)) as picture:
        few = picture.convert("RGB").quantize(96, dither=Image.Dither.NONE)
        few.save(buffer, "PNG", optimize=True, dpi=(DPI, DPI))
    return buffer.getvalue()


def _width_of_names(panel: PlotPanel) -> float:
    """Return the inches needed for vertical names below the axis."""
    names = [x for series in panel.series for x in series.x if isinstance(x, str)]
    return min(0.055 * max(map(len, names), default=0), 1.3) if len(set(names)) > 4 else 0.0


def _draw_panel(axes: Axes, panel: PlotPanel) -> None:
    names = list(dict.fromkeys(x for s in panel.series for x in s.x if isinstance(x, str)))
    bars = [s for s in panel.series if s.kind == "bars"]
    bottom = np.zeros(len(names))
    for series in panel.series:
        x = np.array([names.index(v) if isinstance(v, str) else v for v in series.x], dtype=float)
        y = np.array([np.nan if v is None else v for v in series.y], dtype=float)
        label = series.name if series.named else "_"
        look = series.look
        if series.kind == "bars":
            wide = (x[1] - x[0] if not names and len(x) > 1 else 0.8) / len(bars)
            shift = (bars.index(series) - (len(bars) - 1) / 2) * wide
            axes.bar(x + shift, y, wide, label=label, color=look.colour, linewidth=0)
        elif series.kind == "stack":
            below = bottom[x.astype(int)]
            axes.bar(x, np.nan_to_num(y), 0.75, below, label=label, color=look.colour)
            bottom[x.astype(int)] += np.nan_to_num(y)
        else:
            style: dict[str, Any] = {"color": look.colour, "label": label, "linewidth": 1.5}
            alone = series.kind in ("points", "cloud", "mean")
            style["linestyle"] = "" if alone else look.dash[0]
            if series.kind == "steps":
                style["drawstyle"] = "steps-post"
            if series.kind in ("points", "both"):
                style |= {"marker": look.marker[0], "markersize": 4.5}
            elif series.kind == "cloud":
                style |= {"marker": look.marker[0], "markersize": 3.5, "alpha": 0.5, "mew": 0}
            elif series.kind == "mean":
                style |= {"marker": look.marker[0], "markersize": 9, "mec": "white", "zorder": 3}
                if series.ends:
                    axes.hlines(y, *series.ends[0], colors=look.colour, lw=1.5)
                    axes.vlines(x, *series.ends[1], colors=look.colour, lw=1.5)
            axes.plot(x, y, **style)
    _draw_axes(axes, panel, names)


def _share(panels: Sequence[Axes]) -> None:
    """Give axes with the same title the range of all of them."""
    for title, ends in (
        (Axes.get_xlabel, (Axes.get_xlim, Axes.set_xlim)),
        (Axes.get_ylabel, (Axes.get_ylim, Axes.set_ylim)),
    ):
        for name in {title(panel) for panel in panels}:
            alike = [panel for panel in panels if title(panel) == name]
            lows, highs = zip(*map(ends[0], alike), strict=True)
            for panel in alike if name else ():
                ends[1](panel, min(lows), max(highs))


def _draw_axes(axes: Axes, panel: PlotPanel, names: Sequence[str]) -> None:
    axes.set_title(panel.title, fontsize=9.5)
    axes.set_xlabel(panel.x.title)
    axes.set_ylabel(panel.y.title)
    if panel.x.log:
        axes.set_xscale("log")
    if panel.y.log:
        axes.set_yscale("log")
    axes.set_xlim(panel.x.low, panel.x.high)
    axes.set_ylim(panel.y.low, panel.y.high)
    for scale, axis, ends in (
        (panel.x, axes.xaxis, axes.get_xlim()),
        (panel.y, axes.yaxis, axes.get_ylim()),
    ):
        if scale.log:
            few, short = ends[1] < DECADES * ends[0], ends[1] < SHORT * ends[0]
            subs = (1, 2, 5) if few else (1,)
            axis.set_major_locator(
                MaxNLocator(5, steps=(1, 2, 5, 10)) if short else LogLocator(subs=subs)
            )
            axis.set_major_formatter("{x:g}" if short else FuncFormatter(lambda v, _: _tick(v)))
            axis.set_minor_formatter(NullFormatter())
    if _counts(panel):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    if names:
        upright = len(names) > 4
        axes.set_xticks(range(len(names)), names, rotation=90 if upright else 0, fontsize=8)
        axes.grid(visible=False, axis="x")


def _tick(value: float) -> str:
    """Return a readable label for a power of ten, or 2 or 5 times one."""
    if value >= LARGE or value < SMALL:
        exponent = int(np.floor(np.log10(value) + 1e-9))
        factor = round(value / 10.0**exponent)
        times = f"{factor}\N{MULTIPLICATION SIGN}" if factor > 1 else ""
        return f"{times}10{str(exponent).translate(_RAISED)}"
    return f"{value:,.0f}" if value >= 1 else f"{value:.8f}".rstrip("0")


def _draw_legend(canvas: Canvas, columns: int) -> None:
    entries: dict[str, Any] = {}
    for axes in canvas.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            entries.setdefault(label, handle)
    if entries:
        style: Any = {"loc": "outside lower center", "frameon": False, "fontsize": 8.5}
        canvas.legend(list(entries.values()), list(entries), ncols=columns, **style)


def _legend_columns(names: Sequence[str], inches: float) -> int:
    """Return the most columns in which a legend of these names is not wider than that.

    >>> [_legend_columns(names, 6.0) for names in (["CEM", "LDM"], ["a name of twenty-one"] * 9)]
    [2, 3]
    """

    def width(columns: int) -> float:
        parts = np.array_split([len(name) for name in names], columns)
        return sum(NAME_INCHES * int(part.max()) + MARK_INCHES for part in parts)

    return next((n for n in range(len(names), 1, -1) if width(n) <= inches), 1)


def plotly_of(plot: Plot) -> dict[str, Any]:
    """Return the plot as a Plotly figure: ``data`` and ``layout``, ready for JSON."""
    columns = plot.across
    rows = -(-len(plot.panels) // columns)
    data: list[dict[str, Any]] = []
    layout: dict[str, Any] = {
        "grid": {"rows": rows, "columns": columns, "pattern": "independent"},
        "barmode": "group",
        "legend": {"orientation": "h", "y": -0.2 / rows},
        "margin": {"l": 60, "r": 15, "t": 40, "b": 60},
        "height": 340 * rows + 90,
        "annotations": [],
    }
    shown: set[str] = set()
    for k, panel in enumerate(plot.panels):
        suffix = "" if k == 0 else str(k + 1)
        values = [(series.x, series.y) for series in panel.series]
        across, up = ([v for one in side for v in one] for side in zip(*values, strict=True))
        layout[f"xaxis{suffix}"] = _plotly_axis(panel.x, across) | _whole_ticks(panel)
        layout[f"yaxis{suffix}"] = _plotly_axis(panel.y, up)
        for side, axis in (("x", panel.x), ("y", panel.y)):
            same = [p for p in plot.panels[:k] if getattr(p, side).title == axis.title]
            if plot.shared and same and axis.title:
                first = plot.panels.index(same[0])
                layout[f"{side}axis{suffix}"]["matches"] = f"{side}{first + 1 if first else ''}"
        if panel.title:
            axes = {"xref": f"x{suffix} domain", "yref": f"y{suffix} domain"}
            titled = {"text": panel.title, "showarrow": False, **axes, "x": 0.5, "y": 1.1}
            layout["annotations"].append(titled)
        for series in panel.series:
            if series.kind == "stack":
                layout["barmode"] = "stack"
            trace = _plotly_trace(series) | {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}
            trace["legendgroup"] = series.name
            trace["showlegend"] = series.named and series.name not in shown
            shown.add(series.name)
            data.append(trace)
    return {"data": data, "layout": layout}


def _plotly_axis(axis: Axis, values: Sequence[Any]) -> dict[str, Any]:
    """Describe an axis; a logarithmic one has the labels that it has in the still picture."""
    described: dict[str, Any] = {"title": {"text": axis.title}, "automargin": True}
    known = [v for v in values if not isinstance(v, str) and v and v > 0]
    if axis.log:
        described |= {"type": "log", "dtick": 1, "exponentformat": "power"}
    if axis.log and known and (span := max(known) / min(known)) < DECADES:
        low_high = axis.low or min(known), axis.high or max(known)
        locate = MaxNLocator(5, steps=(1, 2, 5, 10)) if span < SHORT else LogLocator(subs=(1, 2, 5))
        ticks = [float(v) for v in locate.tick_values(*low_high) if v > 0]
        texts = [f"{v:g}" if span < SHORT else _tick(v) for v in ticks]
        described |= {"tickmode": "array", "tickvals": ticks, "ticktext": texts}
    if axis.low is not None or axis.high is not None:
        ends = [axis.low, axis.high]
        described["range"] = [np.log10(e).item() if e and axis.log else e for e in ends]
        if None in described["range"]:
            described["autorange"] = "max" if axis.high is None else "min"
    return described


def _counts(panel: PlotPanel) -> bool:
    """Whether a panel's x are integers, such as iterations, which need no ticks at halves."""
    return not panel.x.log and all(isinstance(x, int) for s in panel.series for x in s.x)


def _whole_ticks(panel: PlotPanel) -> dict[str, Any]:
    numbers = [x for s in panel.series for x in s.x if isinstance(x, int)]
    if not numbers or not _counts(panel):
        return {}
    return {"tick0": 0, "dtick": max(1, -(-(max(numbers) - min(numbers)) // TICKS))}


def _plotly_trace(series: PlotSeries) -> dict[str, Any]:
    trace: dict[str, Any] = {
        "name": series.name,
        "x": [_plain(x) for x in series.x],
        "y": [_plain(y) for y in series.y],
    }
    if series.words:
        trace |= {"text": list(series.words), "hovertemplate": "%{text}<br>%{x}, %{y}"}
    look = series.look
    if series.kind in ("bars", "stack"):
        return trace | {"type": "bar", "marker": {"color": look.colour}}
    marked = dict.fromkeys(("points", "cloud", "mean"), "markers") | {"both": "lines+markers"}
    mode = marked.get(series.kind, "lines")
    trace |= {"type": "scatter", "mode": mode}
    trace["line"] = {"color": look.colour, "dash": look.dash[1]}
    if series.kind == "steps":
        trace["line"]["shape"] = "hv"
    trace["marker"] = {"color": look.colour, "symbol": look.marker[1]}
    if series.kind == "cloud":
        trace["marker"] |= {"opacity": 0.5, "size": 5}
    if series.kind == "mean":
        trace["marker"] |= {"size": 12}
    if series.ends:
        values = series.x[0], series.y[0]
        for side, value, (low, high) in zip("xy", values, series.ends, strict=True):
            middle = float(value or 0)
            trace[f"error_{side}"] = {
                **{"type": "data", "symmetric": False, "color": look.colour, "thickness": 1.5},
                **{"array": [high - middle], "arrayminus": [middle - low]},
            }
    return trace
