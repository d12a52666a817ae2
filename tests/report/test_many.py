"""The report of a run over many surfaces: shares, profiles, wins, the hardest, and no page each."""

import re

import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench.mesh.triangle_mesh import DiskMesh
from cembench.report.content import causes
from cembench.report.content.causes import Cause
from cembench.report.content.evidence import Evidence
from cembench.report.content.findings import many_findings
from cembench.report.content.many_surfaces import HARDEST, hardest, pairwise_wins
from cembench.report.declared import declared_table
from cembench.report.declared_plots import declared_plot
from cembench.report.difficulty import boundary_crowding, shape
from cembench.report.document import plain
from cembench.report.run_tables import many_table
from cembench.report.write_report import write_report
from cembench.results.exhibits import Exhibit, write_exhibit
from cembench.results.records import Fault, FaultKind, not_ok
from cembench.results.store import Store
from tests.records import changed
from tests.report.small_run import ok, record
from tests.terminal import printed

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
    assert [c.title for c in table.columns][7:9] == ["invalid", "timeout"]
    cem = by_label(table)["CEM"]
    assert [cem[k].number for k in (2, 3, 4)] == [COUNT, COUNT, COUNT - 3]
    assert cem[5].number == pytest.approx(100 * 23 / 26)
    assert [cem[k].number for k in (7, 8)] == [2, 1]
    assert cem[9].text == "folded 2, timeout 1"
    assert by_label(table)["LSCM"][4].number == COUNT


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
    assert names == ["many", "hard", "costs", "exhibit-surface-set", "not-ok", "surfaces"]
    pages = next(s for s in report.sections if s.title == "Surfaces")
    assert len(pages.sections) == HARDEST
    text = (tmp_path / "report" / "index.html").read_text()
    wanted = (
        "Success rates",
        "profiles of accuracy",
        "Who is faster",
        "Who fails where",
        "hardest",
    )
    assert [words for words in wanted if words not in text] == []
    assert (tmp_path / "report" / "tables" / "success.csv").is_file()


def test_what_is_found_counts_all_surfaces(evidence):
    head = many_findings(evidence)
    angles, valid, _ = map(plain, head.sentences)
    assert valid == (
        "Over 26 surfaces, 3 of 4 algorithms have a valid map of every one that they take: Direct "
        "CEM, Harmonic and LSCM."
    )
    # CEM has a map of 23, fewer than nine tenths.
    assert angles.startswith("On 26 surfaces, Direct CEM ")
    assert "Left out, with too few maps: CEM." in angles
    rows = {row[0].text: row for row in head.tables[0].rows}
    assert rows["CEM"][1].text == "23 of 26"
    assert rows["CEM"][2].why == "too few valid maps to be compared"
    assert re.fullmatch(r"\d+ % \(\d+ to \d+\)", rows["Direct CEM"][4].text)
    cells, *_, worst = head.figures
    assert cells.number == f"{100 * 101 / 104:.1f} %"
    assert worst.words.startswith("the worst mean angle error of a valid map: ")


def test_a_table_by_cause_has_every_surface_and_who_fails_there(evidence, monkeypatch):
    declared = {
        "steep": Cause(title="steep", where="place < 3", help="Flatten it."),
        "large": Cause(title="large", where="place > 20", help="Wait."),
        "never": Cause(title="never", where="chord_share > 1e9", help=""),
    }
    monkeypatch.setattr(causes, "causes", lambda: declared)
    rows = by_label(declared_table(evidence, "who-fails-where"))
    assert list(rows) == ["steep", "large", causes.NONE]
    assert [row[1].number for row in rows.values()] == [3, 5, 18]
    assert rows["steep"][3].number == pytest.approx(25)
    assert rows["steep"][4].text == "CEM 3"
    assert rows["large"][3].number == 0
    assert rows["steep"][-1].text == "Flatten it."
    worst = causes.worst_table(evidence, evidence.surfaces[:1])
    assert [entry.text for entry in worst.rows[0]][-2:] == ["steep", "Flatten it."]


def test_every_declared_cause_can_be_evaluated_and_says_what_helps(evidence):
    found = causes.with_causes(evidence, evidence.frame)
    assert len(found) == len(evidence.frame)
    assert {name for row in found["causes"] for name in row} <= set(causes.causes())
    assert all(one.help and one.title for one in causes.causes().values())
    assert found["boundary_crowding"].notna().all()
    assert found["angle_defect"].notna().all()


def test_shapes_are_those_of_surfaces_known_in_closed_form():
    """Eight triangles about the centre of a square, flat and raised; two with a chord."""
    V = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [-1, 1, 0], [-1, 0, 0], [-1, -1, 0]]
    V += [[0, -1, 0], [1, -1, 0]]
    fan = DiskMesh.from_arrays(V, [[0, k, k % 8 + 1] for k in range(1, 9)])
    shape_of = shape(fan)
    assert shape_of.boundary_excess == pytest.approx(8 / (2 * np.sqrt(np.pi * 4)))
    assert (shape_of.obtuse_share, shape_of.chord_share) == (0, 0)
    assert shape_of.angle_defect == pytest.approx(0, abs=1e-9)
    raised = DiskMesh.from_arrays([[0, 0, 1], *V[1:]], fan.F)
    corner = np.degrees(np.arccos(2 / np.sqrt(2 * 3)))
    assert shape(raised).angle_defect == pytest.approx(360 - 8 * corner)
    flat = DiskMesh.from_arrays(
        [[0, 0, 0], [9, -1, 0], [18, 0, 0], [9, 1, 0]], [[0, 1, 3], [1, 2, 3]]
    )
    assert (shape(flat).obtuse_share, shape(flat).chord_share) == (0, 1 / 4)


@pytest.fixture(scope="module")
def of_families(run):
    """The same run, where 20 surfaces are faces of one model."""
    held = Evidence.of(run)
    faces = {surface(k).hash for k in range(20)}
    records = [
        changed(r, mesh={"family": "face"}) if r.cell.mesh_hash in faces else r
        for r in held.records
    ]
    return Evidence(held.store, tuple(records), ())


def test_a_family_counts_once_in_shares_and_wins_and_profiles(of_families):
    cem = by_label(declared_table(of_families, "success"))["CEM"]
    assert [cem[k].number for k in (2, 3, 4)] == [COUNT, 7, COUNT - 3]
    assert cem[5].number == pytest.approx(100 * (17 / 20 + 6) / 7)
    low, high = map(float, cem[6].text.split(" to "))
    assert (low, high) == pytest.approx((100 * np.array([0.61, 1.0])), abs=4)
    _, seconds = pairwise_wins(of_families, "reuse")
    column = [c.title for c in seconds.columns].index("Direct CEM")
    assert by_label(seconds)["CEM"][column].text == "7 of 7 *"
    profile = declared_plot(of_families, "accuracy-profiles").panels[0]
    assert profile.title == "mean angle error, n = 26"
    ends = {line.name: line.y[-1] for line in profile.series}
    assert ends["CEM"] == pytest.approx(100 * (17 / 20 + 6) / 7)


def test_every_sentence_says_on_how_many_families_it_rests(of_families):
    head = many_findings(of_families)
    angles, valid, *_ = map(plain, head.sentences)
    assert valid.startswith("Over 26 surfaces of 7 families, 3 of 4 algorithms")
    assert "On 26 surfaces of 7 families, Direct CEM" in angles
    assert "Over 26 surfaces of 7 families; " in head.tables[0].notes[0]
    assert re.fullmatch(r"\d+ % \(\d+ to \d+\)", head.tables[0].rows[0][4].text)


def test_the_terminal_has_a_line_an_algorithm(evidence):
    text = printed(many_table(evidence))
    assert all(len(line.rstrip()) <= 80 for line in text.splitlines())
    line = next(line for line in text.splitlines() if line.startswith("cem"))
    assert line.split()[1:4] == ["26", "23", "88.5%"]
    assert "2  cem: invalid, folded" in text
