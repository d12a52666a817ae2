"""Plots that are declared: their points, and what is said of wrong declarations."""

import csv
import io
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from cembench.core.errors import ParameterError
from cembench.report.declarations import parsed
from cembench.report.declared_plots import (
    DeclaredPlot,
    declared_plot,
    further,
    own_plots,
)
from cembench.report.document import Text
from cembench.report.plot_rows import cost_ratios, front
from cembench.report.plots import Point, data_of
from cembench.report.write_report import write_report

DOCS = Path(__file__).parents[2] / "docs/tables.md"
LEAST = 'title = "A"\nx = "faces"\ny = "seconds"\n'


def declared(text, name="a"):
    return parsed(tomllib.loads(f"[{name}]\n{text}"), DeclaredPlot, "mine.toml")[name]


@pytest.fixture
def examples(tmp_path):
    """The examples of the page on tables, as one file."""
    file = tmp_path / "mine.toml"
    file.write_text("\n".join(re.findall(r"```toml\n(.*?)```", DOCS.read_text(), re.S)))
    return file


def test_the_examples_of_the_page_are_in_the_report(small_run, examples, tmp_path, quick_drawing):
    folder = tmp_path / "report"
    report = write_report(small_run, folder, "cembench report run", tables=[examples])
    *_, by_size, against = report.sections[-1].items
    assert by_size.plot["layout"]["xaxis"]["title"]["text"] == "faces"
    assert by_size.plot["layout"]["yaxis"]["title"]["text"] == "angle° (degrees)"
    assert {t["name"] for t in by_size.plot["data"]} >= {"CEM", "Harmonic"}
    assert [a["text"] for a in against.plot["layout"]["annotations"]] == [
        "solves: reuse",
        "solves: backslash",
    ]
    assert (folder / "figures/declared-1-error-by-size.csv").is_file()
    assert "Angle errors by size" in (folder / "report.md").read_text()


def test_names_without_a_point_are_neither_in_the_legend_nor_on_the_axis(evidence):
    where = "valid = \"(algorithm == 'cem') & (surface == 'Chinese Vase')\"\n"
    plot = declared_plot(evidence, "a", declared(LEAST.replace('"faces"', '"surface"') + where))
    (series,) = plot.panels[0].series
    assert (series.name, list(series.x)) == ("CEM", ["Chinese Vase"])


def test_points_are_the_figures_of_the_records(evidence):
    plot = declared_plot(evidence, "a", declared(LEAST + "where = \"algorithm == 'cem'\""))
    (series,) = plot.panels[0].series
    records = (r for r in evidence.records if r.cell.algorithm == "cem")
    times = {r.mesh.faces: r.outcome.median_seconds for r in records if r.cell.solves == "reuse"}
    assert dict(zip(series.x, series.y, strict=True)) == times
    rows = list(csv.DictReader(io.StringIO(data_of(plot))))
    assert [float(row["y"]) for row in rows] == series.y


def test_names_on_x_have_an_entry_in_each_series(evidence):
    plot = declared_plot(evidence, "a", declared('title = "A"\nx = "surface"\ny = "seconds"'))
    curves = {series.name: series for series in plot.panels[0].series}
    assert {tuple(series.x) for series in curves.values()} == {
        ("Chinese Vase", "Liu's Neutral Face", "flat-disk")
    }
    assert curves["QIEM"].y[0] is None  # it failed there
    assert curves["LDM"].y[2] is None  # it was not tried there


def test_expressions_by_surface_are_of_its_records(evidence):
    text = 'title = "A"\nby = ["surface"]\nx = "faces"\ny = "seconds / smallest(seconds)"'
    plot = declared_plot(evidence, "a", declared(text))
    by_faces = {}
    for series in plot.panels[0].series:
        for x, y in zip(series.x, series.y, strict=True):
            by_faces.setdefault(x, []).append(y)
    assert all(min(values) == 1 for values in by_faces.values())


def test_nothing_to_draw_is_said(evidence, tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(f'[plots.none]\n{LEAST}where = "seconds < 0"')
    ((_, items),) = further(evidence, [file])
    assert items == [Text("A: no record of this run is in this plot.")]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('title = "A"\nx = "faces"', "a / panels / 0 / y: Field required"),
        ('title = "A"\ny = "faces"', 'has "x" and "y"'),
        (LEAST + "colour = 1", "a: 'colour' is not known here; allowed are title, "),
        (LEAST + "panels = 3", "a: 'x' is not known here; allowed are title, panels, "),
        (LEAST + 'kind = "pie"', "a / panels / 0 / kind: Input should be 'line'"),
        (LEAST + 'kind = "profile"\npolicy = "all"', 'has facet = "solves"'),
    ],
)
def test_a_wrong_declaration_says_where_and_what_is_allowed(text, said):
    with pytest.raises(ParameterError) as caught:
        declared(text)
    assert str(caught.value).startswith("mine.toml, a")
    assert said in str(caught.value)


def test_plots_that_are_no_tables_are_an_error():
    with pytest.raises(ParameterError, match="write each declaration as a table"):
        parsed(3, DeclaredPlot, "mine.toml")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            LEAST + 'panel = "{n} {colour}"',
            r"cannot be filled in \(KeyError: 'colour'\); known in braces",
        ),
        (LEAST + 'caption = "{colour}"', "known in braces are as_good, counts"),
        (LEAST + 'facet = "colour"', "facet = 'colour' names no column; known: mesh"),
        (LEAST + 'series = "colour"', "series = 'colour' names no column; known: mesh"),
        (LEAST + 'by = ["colour"]', "by = 'colour' names no column; known: mesh"),
        ('title = "A"\nx = "faces"\ny = "mesh"', "y = 'mesh' is not a number"),
    ],
)
def test_what_does_not_fit_the_run_is_an_error(evidence, text, said):
    with pytest.raises(ParameterError, match=said):
        declared_plot(evidence, "a", declared(text))


def test_a_failure_counts_as_infinitely_slow_in_a_profile(evidence):
    plot = declared_plot(evidence, "performance-profile")
    panel = plot.panels[0]
    assert panel.title == "solves: reuse, n = 2"  # LDM was not tried on the third
    curves = {series.name: series.y for series in panel.series}
    assert max(curves["QIEM"]) == 50
    assert max(curves["CEM"]) == 100
    assert "LSCM" not in curves


def test_a_variant_tried_on_fewer_surfaces_is_left_out_of_a_profile(evidence):
    import pandas as pd

    rows = [(place, name, k, True) for k, name in enumerate("ab") for place in (0, 1)]
    frame = pd.DataFrame(
        [*rows, (0, "a (x=1)", 2, False)],
        columns=["place", "label", "series", "main"],
    )
    ratios = cost_ratios(frame, pd.Series([1.0, 2.0, 2.0, np.inf, 0.5]))
    assert ratios.to_dict("list") == {"a": [1.0, 1.0], "b": [2.0, np.inf]}


def test_a_front_has_the_means_that_no_other_beats():
    clouds = {"a": [Point(1, 4), Point(4, 4)], "b": [Point(4, 1)], "c": [Point(5, 5)]}
    best = front(clouds)
    assert list(zip(best.words, best.x, best.y, strict=True)) == [
        ("a", pytest.approx(2), pytest.approx(4)),
        ("b", pytest.approx(4), pytest.approx(1)),
    ]


def test_a_model_without_a_panel_is_known(evidence):
    plot = declared_plot(evidence, "energy-by-iteration")
    assert (plot.name, plot.paper) == ("figure-8", "Figure 8")
    assert [panel.of for panel in plot.panels] == ["Chinese Vase"]


def test_the_angles_of_a_map_are_computed_where_nobody_has_seen_it(evidence):
    plot = declared_plot(evidence, "angle-histograms")
    (panel,) = plot.panels
    assert panel.title.startswith("Liu's Neutral Face (stand-in): ")
    shares = panel.series[0].y
    assert len(shares) == 40
    assert 0 < sum(shares) <= 100.000001


def test_every_plot_of_a_report_is_declared_and_can_be_made(evidence):
    for name in own_plots(evidence):
        surface = evidence.surfaces[0] if name == "surface" else None
        plot = declared_plot(evidence, name, surface=surface)
        assert plot is not None, name
        assert all(series.x for panel in plot.panels for series in panel.series)
