import csv
import io
import json

import numpy as np
import pytest

from cembench.report import plots
from cembench.report.content.evidence import Evidence
from cembench.report.declared_plots import declared_plot
from cembench.report.palette import PARTS, series_styles
from cembench.report.plots import Axis, Plot, PlotPanel, PlotSeries, plotly_of, write_plot
from cembench.results.papers import find_paper
from tests.report.small_run import meshes, ok, record, write_run


@pytest.fixture
def plot():
    kinds = ("line", "points", "both", "steps", "bars", "stack")
    panels = tuple(
        PlotPanel(
            Axis("x"),
            Axis("y", log=kind == "line"),
            (
                PlotSeries(
                    kind,
                    ["a", "b_$", "c"] if kind in ("bars", "stack") else [0, 1, 2],
                    [1.0, None, 3.0],
                    kind,
                ),
            ),
            f"$ {kind}",
        )
        for kind in kinds
    )
    return Plot("kinds", "All kinds", panels, columns=3)


def test_a_plot_is_files_and_data_and_the_same_bytes_again(plot, tmp_path):
    figure = write_plot(plot, tmp_path / "one")
    write_plot(plot, tmp_path / "two")
    assert [path.suffix for path in figure.files] == [".png", ".svg", ".pdf"]
    for path in [*figure.files, figure.data]:
        assert (tmp_path / "one" / path).read_bytes() == (tmp_path / "two" / path).read_bytes()
    rows = list(csv.DictReader(io.StringIO((tmp_path / "one" / figure.data).read_text())))
    assert [(r["x"], r["y"]) for r in rows if r["series"] == "bars"] == [
        ("a", "1.0"),
        ("b_$", ""),
        ("c", "3.0"),
    ]


def test_plotly_is_told_the_same_values(plot):
    described = plotly_of(plot)
    json.dumps(described, allow_nan=False)
    assert [trace["y"] for trace in described["data"]] == [[1.0, None, 3.0]] * 6
    assert described["layout"]["yaxis"]["type"] == "log"
    steps = next(t for t in described["data"] if t["name"] == "steps")
    assert (steps["line"]["shape"], steps["mode"]) == ("hv", "lines")


def test_algorithms_look_different_from_one_another_and_the_same_everywhere():
    names = ["cem", "qiem", "fdm", "ldm", "harmonic-circle", "lscm", "mine", "yours"]
    styles = series_styles(names)
    assert len({styles[name].colour for name in names}) == len(names)
    assert series_styles(["zebra", "cem"])["cem"] == styles["cem"]


def test_thirty_algorithms_have_styles_of_their_own():
    names = [
        "cem",
        "qiem",
        "fdm",
        "ldm",
        "harmonic-circle",
        "lscm",
        *(f"other {k}" for k in range(24)),
    ]
    styles = series_styles(names)
    assert len({(styles[name].colour, styles[name].marker) for name in names}) == len(names)
    assert len({(styles[name].colour, styles[name].dash) for name in names}) == len(names)


def test_the_printed_seconds_have_their_exponents(evidence):
    seconds = find_paper("cem").tables[1]
    x, y = np.log([(row["faces"], row["cem"]) for row in seconds.values()]).T
    panel = declared_plot(evidence, "cost-by-faces").panels[-1]
    points, line = (series for series in panel.series if series.name.startswith("CEM"))
    assert len(points.x) == len(seconds)
    slope = np.polyfit(x, y, 1)[0]
    assert np.diff(np.log(line.y)) / np.diff(np.log(line.x)) == pytest.approx(slope)
    assert len(next(series for series in panel.series if series.name == "FDM").x) == 18


def test_the_phases_of_every_algorithm_add_up_to_all_of_its_time(evidence):
    panel = declared_plot(evidence, "time-by-phase").panels[0]
    total = np.sum([series.y for series in panel.series], axis=0)
    np.testing.assert_allclose(total, 100)


def test_cost_is_shown_by_policy_beside_the_printed(evidence):
    titles = [panel.title for panel in declared_plot(evidence, "cost-by-faces").panels]
    assert titles == [
        "measured here, solves: reuse",
        "measured here, solves: backslash",
        "measured here, solves: reuse, free boundary",
        "measured here, solves: backslash, free boundary",
        "printed in the paper (Table 1)",
    ]


def test_energies_of_algorithms_not_in_the_paper_stand_beside_those_of_cem(tmp_path):
    store = write_run(tmp_path, ("reuse",))
    vase = meshes()["Chinese Vase"]
    outcome, uv = ok("direct-cem", vase, 1.0)
    rival = record("direct-cem", vase, "Chinese Vase", "reuse", outcome)
    store.save(rival, uv, {"id": "machine", "cpu": "x"})
    (panel,) = declared_plot(Evidence.of(tmp_path), "energy-by-iteration").panels
    assert [series.name for series in panel.series] == ["CEM", "Direct CEM"]
    assert panel.series[1].y[-1] < panel.series[0].y[0]


def test_no_phase_has_an_algorithm_s_colour():
    algorithms = {look.colour.lower() for look in series_styles(list("abcdef")).values()}
    assert not algorithms & {colour.lower() for colour in PARTS}
    assert len(set(PARTS)) == len(PARTS)


def test_iterations_have_whole_ticks():
    for last, step in ((2, 1), (8, 1), (40, 5)):
        curve = PlotSeries("CEM", list(range(last + 1)), [1.0] * (last + 1), "both")
        panel = PlotPanel(Axis("iteration"), Axis("E_C"), (curve,))
        axis = plotly_of(Plot("history", "History", (panel,)))["layout"]["xaxis"]
        assert (axis["tick0"], axis["dtick"]) == (0, step)
    times = PlotSeries("CEM", [0.5, 1.0], [1.0, 2.0], "both")
    plot = Plot("times", "Times", (PlotPanel(Axis("seconds"), Axis("E_C"), (times,)),))
    assert "dtick" not in plotly_of(plot)["layout"]["xaxis"]


@pytest.mark.parametrize(
    ("value", "text"),
    [
        *[(0.005, "0.005"), (1000, "1,000"), (1e6, "1,000,000"), (1e7, "10⁷"), (2e8, "2\u00d710⁸")],
        *[(1e-5, "0.00001"), (1e-6, "10⁻⁶"), (5e-10, "5\u00d710⁻¹⁰")],
    ],
)
def test_ticks_are_written_so_that_they_do_not_run_into_each_other(value, text):
    assert plots._tick(value) == text
