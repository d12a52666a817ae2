"""Plots that are declared: what a point is, where it is, and what makes a series and a panel.

A declaration is a part of a TOML file: ``plots.toml`` here, ``figures.toml`` of a paper, or
``[plots.NAME]`` in one that ``report --tables`` names::

    [plots.error-by-size]
    title = "Angle errors by size"
    where = "target == 'disk'"
    x = { value = "faces", log = true }
    y = { value = "angle_error_mean_deg", log = true }
    tooltip = "surface"

Points are rows of the run's frame, or of one that is made of it (:mod:`cembench.report.plot_rows`);
`x`, `y` and conditions are expressions over its columns (:mod:`cembench.results.frame`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, cast

from pydantic import Field, model_validator

from cembench.core.errors import ParameterError
from cembench.core.names import slug
from cembench.report.content.evidence import AS_GOOD, DEGREES, Evidence, MeasuredSurface
from cembench.report.declarations import Declaration, filled, own, parsed, read
from cembench.report.declared import DeclaredTable, declared_table
from cembench.report.document import Item, Section, Text
from cembench.report.palette import SeriesStyle, phase_style, series_styles
from cembench.report.plot_rows import (
    ROWS,
    UNSEEN,
    Inspections,
    average,
    cost_ratios,
    front,
    power_law,
    staircase,
)
from cembench.report.plots import Axis, Kind, Plot, PlotPanel, PlotSeries, Point
from cembench.results.columns import COLUMNS
from cembench.results.expressions import with_words
from cembench.results.frame import evaluate

if TYPE_CHECKING:
    import pandas as pd


class DeclaredAxis(Declaration):
    """An axis: an expression for the values on it; its title is by default that of the column."""

    value: str = ""
    title: str | None = None
    log: bool = False
    low: float | None = None
    high: float | None = None

    @model_validator(mode="before")
    @classmethod
    def _named(cls, value: Any) -> Any:
        return {"value": value} if isinstance(value, str) else value

    def axis(self) -> Axis:
        """Return the axis as it is drawn."""
        title = self.title
        if title is None and (column := COLUMNS.get(self.value)):
            heading = column.heading or column.name
            in_heading = not column.unit or {"s": "seconds"}.get(column.unit) == heading
            title = heading if in_heading else f"{heading} ({column.unit})"
        return Axis(self.value if title is None else title, self.log, self.low, self.high)


#: Facets whose panels have one linear-algebra policy each.
_BY_POLICY = ("solves", "contest")


class DeclaredPanel(Declaration):
    """What makes one or more pairs of axes; see docs/tables.md for the keys."""

    rows: Literal["record", "iteration", "phase", "angle", "difficulty", "printed"] = "record"
    where: str = ""
    #: Which rows have a figure; of others a profile knows that they were tried.
    valid: str = "ok"
    #: Records of the run's first linear-algebra policy, of all, or the first that ended ok.
    policy: Literal["first", "all", "any"] = "first"
    #: The column whose values have panels of their own.
    facet: str = ""
    panel: str = ""
    series: str = "label"
    kind: Literal["line", "points", "both", "steps", "bars", "stack", "profile"] = "points"
    x: DeclaredAxis = DeclaredAxis()
    y: DeclaredAxis
    #: Expressions are of the rows that agree in these columns, which are at least two.
    by: tuple[str, ...] = ()
    tooltip: str = ""
    overlay: Literal["", "power-law", "front"] = ""
    #: Without a row for which this is true there is no panel.
    needs: str = ""
    #: Maximum number of series.
    most: int | None = Field(None, ge=1)
    #: Of a profile: smaller figures count as this.
    least: float = 0.0
    #: What the caption says of it.
    about: str = ""

    @model_validator(mode="after")
    def _fits(self) -> DeclaredPanel:
        if not self.y.value or not (self.x.value or self.kind == "profile"):
            raise ValueError('a plot has "x" and "y", expressions or tables with "value"')
        if self.kind == "profile" and self.policy == "all" and self.facet not in _BY_POLICY:
            raise ValueError('a profile of policy = "all" has facet = "solves" or "contest"')
        return self


class DeclaredPlot(Declaration):
    """A plot; keys of a panel that are beside `title` are those of each of its `panels`."""

    title: str
    panels: tuple[DeclaredPanel, ...] = Field(min_length=1)
    columns: int = Field(2, ge=1)
    #: Whether panels whose axes have the same title have the same range.
    shared: bool = False
    caption: str = ""
    alternative: str = ""
    #: What the caption says in place of {left_out}, with the algorithms in braces.
    left_out: str = ""
    #: The number of a paper's figure, and the models that it has panels for.
    figure: str = ""
    models: tuple[str, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _spread(cls, declared: Any) -> Any:
        if not isinstance(declared, Mapping) or not isinstance(declared.get("panels", []), list):
            return declared
        shared = {
            key: value for key, value in declared.items() if key in DeclaredPanel.model_fields
        }
        own = {key: value for key, value in declared.items() if key not in shared}
        panels = own.get("panels", [{}])
        return own | {"panels": [shared | p if isinstance(p, dict) else p for p in panels]}


def own_plots(evidence: Evidence) -> dict[str, DeclaredPlot]:
    """Return the plots that every report can have, and those of the run's paper, by name.

    A paper may add to one that every report has, with "_" for "-" in its name.
    """
    known, paper = dict(own("plots.toml")), evidence.paper
    for name, one in paper.plots.items():
        usual = name.replace("_", "-")
        known[usual] = known.get(usual, {}) | one.model_dump(exclude_unset=True)
    return parsed(known, DeclaredPlot, f"plots.toml or {paper.folder / 'figures.toml'}")


def further(
    evidence: Evidence, paths: Iterable[Path]
) -> list[tuple[Section, list[Plot | Item | None]]]:
    """Return what files declare, a section each and its tables and plots, not drawn yet.

    Raises
    ------
    ParameterError
        A file cannot be read, or a declaration is wrong or does not fit the run.
    """
    sections = []
    for number, path in enumerate(paths, start=1):
        declarations = dict(read(path))
        plots = parsed(declarations.pop("plots", {}), DeclaredPlot, f"{path}, plots")
        tables = parsed(declarations, DeclaredTable, str(path))
        items: list[Plot | Item | None] = []
        both: Iterable[tuple[str, Any]] = (*tables.items(), *plots.items())
        for name, one in both:
            called, of_plot = f"declared-{number}-{slug(name)}", isinstance(one, DeclaredPlot)
            make: Any = declared_plot if of_plot else declared_table
            gap = f"{one.title}: no record of this run is in this {'plot' if of_plot else 'table'}."
            try:
                items.append(make(evidence, name, one, called=called) or Text(gap))
            except ParameterError as error:
                raise ParameterError(f"{path}, {name}: {error}") from error
        source = "this paper" if path.parent == evidence.paper.folder else path.name
        sections.append((Section(f"declared-{number}", f"Tables of {source}"), items))
    return sections


class _Drawn(NamedTuple):
    """A panel, the number of surfaces in it, and the series left out."""

    panel: PlotPanel
    n: int
    left_out: Sequence[str] = ()
    about: str = ""


def declared_plot(
    evidence: Evidence,
    name: str,
    declared: DeclaredPlot | None = None,
    *,
    seen: Inspections = UNSEEN,
    surface: MeasuredSurface | None = None,
    called: str = "",
) -> Plot | None:
    """Return a declared plot of a run; None if there is nothing to draw.

    Parameters
    ----------
    evidence : Evidence
        The run.
    name : str
        Name of the plot.
    declared : DeclaredPlot, optional
        The plot; default: the one of :func:`own_plots` with this name.
    seen : mapping of str to Inspection
        What is known of the surfaces' maps, by hash.
    surface : MeasuredSurface, optional
        Only the records of this surface.
    called : str
        Another name for the plot's files and anchor.
    """
    spec = declared or own_plots(evidence)[name]
    drawn: list[_Drawn] = []
    for panel in spec.panels:
        frame = _rows(evidence, spec, panel, seen, surface)
        drawn += _panels(evidence, panel, frame, spec.models)
    if not drawn:
        return None
    left_out = list(dict.fromkeys(label for one in drawn for label in one.left_out))
    texts = {
        "as_good": AS_GOOD,
        "degrees": DEGREES,
        "surface": surface.full_title if surface else "",
        "counts": ", ".join(f"{d.n} of {len(evidence.surfaces)} ({d.panel.of})" for d in drawn),
        "panels": "; ".join(one.about for one in drawn),
        "left_out": with_words(spec.left_out, ", ".join(left_out)) if left_out else "",
    }
    return Plot(
        called or spec.figure.lower().replace(" ", "-") or name,
        filled(spec.title, texts),
        tuple(one.panel for one in drawn),
        filled(spec.caption, texts),
        spec.alternative,
        spec.figure,
        spec.columns,
        spec.shared,
    )


def _panels(
    evidence: Evidence, spec: DeclaredPanel, frame: pd.DataFrame, models: Sequence[str]
) -> Iterator[_Drawn]:
    """Yield a panel for each value of the facet that has something to draw."""
    facet = "model" if models else spec.facet
    for key, name in (("facet", facet), ("series", spec.series), *(("by", n) for n in spec.by)):
        if name and name not in frame:
            known = ", ".join(map(str, frame))
            raise ParameterError(f"{key} = {name!r} names no column; known: {known}.")
    named = (*evidence.policies, *evidence.contest_names, *models)
    order: dict[Any, int] = {name: k for k, name in enumerate(named)}
    values = sorted(frame[facet].unique(), key=lambda v: order.get(v, -1)) if facet else [""]
    make = _profile if spec.kind == "profile" else _points
    for value in values:
        group = frame[frame[facet] == value] if facet else frame
        if group.empty or (spec.needs and not evaluate(spec.needs, group).any()):
            continue
        if drawn := make(evidence, spec, group):
            about = group.iloc[0].to_dict() | {"n": drawn.n}
            about["origins"] = ", ".join(sorted(set(group.get("origin", ()))))
            title = filled(spec.panel, about)
            yield drawn._replace(panel=replace(drawn.panel, title=title, of=str(value)))


def _rows(
    evidence: Evidence,
    plot: DeclaredPlot,
    spec: DeclaredPanel,
    seen: Inspections,
    surface: MeasuredSurface | None,
) -> pd.DataFrame:
    """Return the rows that points are of."""
    frame = evidence.frame
    if surface is not None:
        frame = frame[frame["mesh_hash"] == surface.mesh_hash]
    if spec.rows == "printed":
        frame = ROWS[spec.rows](evidence, frame, seen)
    elif spec.policy == "first":
        frame = frame[frame["solves"] == evidence.policies[0]]
    elif spec.policy == "any":
        frame = frame.sort_values("ok", ascending=False, kind="stable")
        frame = frame.drop_duplicates(["place", "series"]).sort_index()
    if plot.models:
        frame = frame[frame["counted"] & frame["model"].isin(plot.models)]
    if spec.where:
        frame = frame[evaluate(spec.where, frame).astype(bool)]
    if spec.rows != "printed":
        frame = ROWS[spec.rows](evidence, frame, seen if spec.policy == "any" else UNSEEN)
    if spec.x.high is not None and spec.kind != "profile":
        frame = frame[evaluate(spec.x.value, frame) <= spec.x.high]
    return frame


def _profile(evidence: Evidence, spec: DeclaredPanel, frame: pd.DataFrame) -> _Drawn | None:
    """Return the performance profile of the panel's figure: a staircase for each algorithm."""
    good = evaluate(spec.valid, frame).astype(bool)
    cost = evaluate(spec.y.value, frame).astype(float).where(good).fillna(inf)
    ratios = cost_ratios(frame, cost, spec.least)
    if ratios.empty or len(ratios.columns) < 2:
        return None
    finite = ratios.to_numpy()
    last = min(spec.x.high or inf, 1.15 * float(finite[finite < inf].max()))
    families = [evidence.surfaces[place].family for place in ratios.index]
    weights = [1 / families.count(family) for family in families]
    series = tuple(
        PlotSeries(
            *(label, *staircase(ratios[label].tolist(), last, weights)),
            *("steps", evidence.styles[label]),
        )
        for label in map(str, ratios)
    )
    x = Axis(spec.x.axis().title, log=True, low=1.0, high=last)
    panel = PlotPanel(x, Axis("families (%)", low=0, high=104), series)
    left_out = [label for label in dict.fromkeys(frame["label"]) if label not in ratios]
    return _Drawn(panel, len(families), left_out, spec.about)


def _points(evidence: Evidence, spec: DeclaredPanel, frame: pd.DataFrame) -> _Drawn | None:
    """Return the points of a panel in series, with what is laid over them.

    With names on x, each series has an entry for each name, None where there is no figure.
    """
    points = _evaluated(spec, frame)
    if points.empty:
        return None
    named = isinstance(points["x"].iloc[0], str)
    slots = zip(points["place"], points["x"], strict=True) if named else ()
    places = sorted(dict.fromkeys(slots))
    ordered = points.sort_values("series", kind="stable")
    names = list(dict.fromkeys(ordered[spec.series]))
    if spec.kind == "stack":
        total = points.groupby(spec.series)["y"].sum()
        names.sort(key=lambda name: (name == "other", -total[name], name))
    styles = _styles(evidence, spec, ordered, names)
    series: list[PlotSeries] = []
    clouds: dict[str, list[Point]] = {}
    for name in names[: spec.most]:
        own = points[points[spec.series] == name]
        x, y, tooltips = own["x"].tolist(), own["y"].tolist(), own["tooltip"].tolist()
        clouds[name] = list(map(Point, x, y, tooltips))
        if named:
            held = dict(zip(zip(own["place"], x, strict=True), y, strict=True))
            absent = 0.0 if spec.kind == "stack" else None
            x, y = [x for _, x in places], [held.get(place, absent) for place in places]
        about = tooltips if spec.tooltip and not named else ()
        kind = "cloud" if spec.overlay == "front" else spec.kind
        named_here = spec.overlay != "front"
        series.append(PlotSeries(name, x, y, cast(Kind, kind), styles[name], about, named_here))
        if spec.overlay == "power-law" and (line := power_law(name, clouds[name], styles[name])):
            series.append(line)
    if spec.overlay == "front":
        for name, cloud in clouds.items():
            own = points[points[spec.series] == name]
            series.append(average(name, cloud, own["family"].tolist(), styles[name]))
        series.append(front(clouds))
    panel = PlotPanel(spec.x.axis(), spec.y.axis(), tuple(series))
    left_out = names[spec.most :] if spec.most else ()
    return _Drawn(panel, points["place"].nunique(), left_out, spec.about)


def _evaluated(spec: DeclaredPanel, frame: pd.DataFrame) -> pd.DataFrame:
    """Return the rows that have a point, with its `x`, `y` and `tooltip`."""
    import pandas as pd

    valid = frame[evaluate(spec.valid, frame).astype(bool)].reset_index(drop=True)
    groups = [valid] if len(valid) else []
    if spec.by:
        keys = ["place" if name == "surface" else name for name in spec.by]
        groups = [group for _, group in valid.groupby(keys, sort=False) if len(group) > 1]
    parts = [pd.DataFrame({"x": [], "y": [], "tooltip": []}, dtype=object)]
    for group in groups:
        x, y = evaluate(spec.x.value, group), evaluate(spec.y.value, group)
        tooltip = evaluate(spec.tooltip, group) if spec.tooltip else ""
        part = pd.DataFrame({"x": x, "y": y, "tooltip": tooltip}, index=group.index)
        parts.append(part if isinstance(y, pd.Series) else part.iloc[:1])
    rows = pd.concat(parts[1:] or parts)
    points = valid.loc[rows.index].assign(**{str(name): rows[name] for name in rows})
    points = points[points["x"].notna() & points["y"].notna()]
    try:
        return points.astype({"y": float})
    except (TypeError, ValueError) as error:
        raise ParameterError(f"y = {spec.y.value!r} is not a number: {error}.") from error


def _styles(
    evidence: Evidence, spec: DeclaredPanel, frame: pd.DataFrame, names: Sequence[str]
) -> Mapping[str, SeriesStyle]:
    if spec.series == "phase":
        return {name: phase_style(name) for name in names}
    if spec.series != "label":
        return series_styles(names)
    algorithms = dict(zip(frame["label"], frame["algorithm"], strict=True))
    usual = series_styles(list(algorithms.values()))
    return {name: evidence.styles.get(name, usual[algorithms[name]]) for name in names}
