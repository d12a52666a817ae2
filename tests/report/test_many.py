"""The report of a run over many surfaces: shares, profiles, wins, the hardest, and no page each."""

import io
import re

import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench.report.content.evidence import Evidence
from cembench.report.content.findings import many_findings
from cembench.report.content.many_surfaces import HARDEST, _wins, hardest, pairwise_wins
from cembench.report.declared import declared_table
from cembench.report.declared_plots import declared_plot
from cembench.report.document import plain
from cembench.report.run_tables import many_table
from cembench.report.surface_facts import boundary_crowding
from cembench.report.write_report import write_report
from cembench.results.exhibits import Exhibit, write_exhibit
from cembench.results.frame import share_interval
from cembench.results.records import Fault, FaultKind, not_ok
from cembench.results.store import Store
from tests.report.small_run import ok, record

#: `direct-cem` is the best and slowest, `harmonic-circle` the fastest; both map all surfaces.
SECONDS = {"cem": 0.5, "direct-cem": 1.0, "harmonic-circle": 0.1, "lscm": 0.4}
COUNT = 26


def surface(k):
    """The k-th: flatter or steeper, and of another size."""
    return hemi_ellipsoid(60 + 4 * k, z=0.5 + 0.1 * k).renamed(f"surface-{k:02d}")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """26 surfaces; CEM folds on the first two, and gives no answer in time on the third."""
    folder = tmp_path_factory.mktemp("many") / "run"
    store = Store(folder)
    for k in range(COUNT):
        mesh = surface(k)
        for name, seconds in SECONDS.items():
            outcome, uv = ok(name, mesh, seconds * (1 + k))
            if name == "cem" and k < 2:
                outcome, uv = not_ok("invalid", Fault(kind=FaultKind.FOLDED, detail="2")), None
            if name == "cem" and k == 2:
                outcome, uv = not_ok("timeout", Fault(kind=FaultKind.TIMEOUT, detail="8 s")), None
            store.save(record(name, mesh, "", "reuse", outcome), uv, {"id": "machine"})
        store.save_mesh(mesh)
    store.save_plan([])
    return folder


@pytest.fixture(scope="module")
def evidence(run):
    return Evidence.of(run)


def by_label(table):
    return {row[0].text: row for row in table.rows}


def test_shares_count_what_was_tried_and_say_what_failed(evidence):
    table = declared_table(evidence, "success")
    assert [c.title for c in table.columns][6:8] == ["invalid", "timeout"]
    cem = by_label(table)["CEM"]
    assert [cem[k].number for k in (2, 3)] == [COUNT, COUNT - 3]
    assert cem[4].number == pytest.approx(100 * 23 / 26)
    assert [cem[k].number for k in (6, 7)] == [2, 1]
    assert cem[8].text == "folded 2, timeout 1"
    assert by_label(table)["LSCM"][3].number == COUNT


@pytest.mark.parametrize("k", [0, 1, 13, 25, 26])
def test_the_interval_of_a_share_holds_it_and_says_something_at_the_ends(k):
    low, high = share_interval(k, 26)
    assert 0 <= low <= k / 26 <= high <= 1
    assert high - low > 0.1


def test_a_profile_ends_at_the_success_rate_and_the_best_starts_highest(evidence):
    plot = declared_plot(evidence, "accuracy-profiles")
    angles = plot.panels[0]
    assert angles.title == f"mean angle error, n = {COUNT}"
    ends = {line.name: line.y[-1] for line in angles.series}
    assert ends["CEM"] == pytest.approx(100 * 23 / 26)
    assert ends["Direct CEM"] == 100
    energies = plot.panels[2]
    assert "LSCM" not in {line.name for line in energies.series}
    starts = {line.name: line.y[0] for line in energies.series}
    assert sum(starts.values()) >= 100  # somebody is the best on every surface
    assert all(line.y == sorted(line.y) for line in energies.series)


def test_wins_are_counted_both_ways_and_failures_lose(evidence):
    angles, seconds = pairwise_wins(evidence, "reuse")
    names = [column.title for column in seconds.columns]
    rows = by_label(seconds)

    def won(table, a, b):
        return by_label(table)[a][names.index(b)].text

    assert won(seconds, "CEM", "Direct CEM") == "23 of 26 *"
    assert won(seconds, "Direct CEM", "CEM") == "3 of 26 *"
    assert rows["CEM"][names.index("CEM")].text == ""
    a, b = won(angles, "CEM", "Direct CEM"), won(angles, "Direct CEM", "CEM")
    assert int(a.split()[0]) + int(b.split()[0]) == int(a.split()[2])


def test_equal_figures_and_untried_surfaces_are_no_win():
    first = [1.0, 2.0, np.inf, np.inf, np.nan]
    second = [1.0 + 1e-9, 1.0, 5.0, np.inf, 1.0]
    assert _wins(first, second) == (0, 2)


def test_the_hardest_are_those_with_the_worst_best_map(evidence):
    shown = hardest(evidence)
    assert len(shown) == HARDEST
    table = by_label(declared_table(evidence, "spread"))
    best = [
        min(
            r.outcome.metrics["angle_error_mean_deg"]
            for r in evidence.records
            if r.cell.mesh_hash == s.mesh_hash and r.outcome.status == "ok" and r.target == "disk"
        )
        for s in shown
    ]
    assert best == sorted(best, reverse=True)
    assert table["CEM"][1].number == COUNT - 3


def test_a_steeper_surface_has_a_larger_span(evidence):
    known = evidence.difficulties
    assert len(known) == COUNT
    spans = [known[s.mesh_hash].span for s in evidence.surfaces]
    assert np.corrcoef(np.arange(COUNT), np.log(spans))[0, 1] > 0.9


def test_crowding_is_one_on_the_disk_itself_and_does_not_see_the_gauge():
    from cembench.surfaces.flat_disk import flat_disk

    mesh = flat_disk(400)
    z = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    assert boundary_crowding(mesh, z) == pytest.approx(1, abs=1e-9)
    moved = (z - 0.6) / (1 - 0.6 * z)
    assert boundary_crowding(mesh, moved) == pytest.approx(1, abs=1e-6)
    assert boundary_crowding(mesh, 2 * z) is None


def test_the_report_has_a_page_for_the_hardest_alone(run, tmp_path, quick_drawing):
    write_exhibit(
        run,
        Exhibit(
            name="surface-set", title="The surfaces", text="a set", command="run", origin="surface"
        ),
    )
    report = write_report(run, tmp_path / "report", "cembench report run")
    names = [section.name for section in report.sections]
    assert names == ["many", "costs", "exhibit-surface-set", "not-ok", "surfaces"]
    pages = next(s for s in report.sections if s.title == "Surfaces")
    assert len(pages.sections) == HARDEST
    text = (tmp_path / "report" / "index.html").read_text()
    for words in ("Success rates", "Performance profiles of accuracy", "Who is faster", "hardest"):
        assert words in text
    assert (tmp_path / "report" / "tables" / "success.csv").is_file()


def test_what_is_found_counts_all_surfaces(evidence):
    found = many_findings(evidence)
    valid, angles, counts, fastest, _ = map(plain, found.sentences)
    assert valid == (
        "Over 26 surfaces, 3 of 4 algorithms have a valid map of every one that they take: Direct "
        "CEM, Harmonic and LSCM."
    )
    # CEM has a map of 23, fewer than nine tenths.
    assert angles.startswith("On 26 surfaces, Direct CEM ")
    assert angles.endswith("Left out, with too few maps: CEM.")
    assert re.fullmatch(r".* on \d+ of 26 surfaces and is within 1 % of the best on \d+\.", counts)
    assert "surface" in fastest
    cells, *_, worst = found.figures
    assert cells.number == f"{100 * 101 / 104:.1f} %"
    assert worst.words.startswith("the worst mean angle error of a valid map: ")


def test_the_terminal_has_a_line_an_algorithm(evidence):
    from rich.console import Console

    console = Console(width=80, record=True, file=io.StringIO())
    console.print(many_table(evidence))
    text = console.export_text()
    assert all(len(line.rstrip()) <= 80 for line in text.splitlines())
    line = next(line for line in text.splitlines() if line.startswith("cem"))
    assert line.split()[1:4] == ["26", "23", "88.5%"]
    assert "2  cem: invalid, folded" in text
