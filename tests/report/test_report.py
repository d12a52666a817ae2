import hashlib
import json
import re
from dataclasses import replace

import pytest

from cembench.core.errors import RecordError
from cembench.report import plots
from cembench.report.content import inspection
from cembench.report.content.evidence import Evidence
from cembench.report.content.report import facts, stand_ins_words
from cembench.report.document import (
    Claim,
    Figure,
    Gap,
    Table,
    items_of,
    plain,
    sections_of,
)
from cembench.report.render.terminal import paper_tables
from cembench.report.write_report import write_report
from cembench.results.merging import merge
from cembench.results.papers import find_paper
from cembench.results.store import Store
from tests.limits import tree
from tests.records import changed
from tests.report.sample_report import CITATION
from tests.report.small_run import meshes, write_run
from tests.terminal import printed


def test_everything_that_the_report_names_is_there(written):
    report, folder = written
    for figure in items_of(report, Figure):
        for path in [*figure.files, *([figure.data] if figure.data else [])]:
            assert (folder / path).stat().st_size > 0, path
    for table in items_of(report, Table):
        assert all(len(row) == len(table.columns) for row in table.rows)
        assert (folder / "tables" / f"{table.name}.csv").is_file()
        assert (folder / "tables" / f"{table.name}.tex").is_file()
        for row in table.rows:
            assert all(not value.record or value.record in report.records for value in row)
    names = [t.name for t in items_of(report, Table)]
    assert len(set(names)) == len(names)
    assert {path.name for path in folder.iterdir()} >= {"index.html", "report.md", "report.tex"}


def test_the_papers_figures_are_there_or_a_gap_names_the_command(written):
    report, _ = written
    there = {figure.paper for figure in items_of(report, Figure)}
    parts = [(part, gap) for gap in items_of(report, Gap) for part in gap.title.split("; ")]
    gaps = {part.partition(":")[0]: gap for part, gap in parts}
    for k in range(1, 15):
        assert f"Figure {k}" in there or f"Figure {k}" in gaps
    assert {"Figure 1", "Figure 3", "Figure 8", "Figure 9", "Figure 12"} <= there
    assert gaps["Figure 2"].command.startswith("cembench run --surfaces left-hand-stand-in,")
    assert len(parts) > len({id(gap) for _, gap in parts})  # one line for what has one cause
    assert gaps["Figure 13"].command.startswith("cembench morph --run ")


def test_a_surface_has_a_page_with_every_map_that_ended_ok(written):
    report, folder = written
    pages = {s.title: s for s in sections_of(report) if s.page}
    assert set(pages) == {"Chinese Vase (stand-in)", "Liu's Neutral Face (stand-in)", "flat-disk"}
    gallery = pages["Chinese Vase (stand-in)"].items[1]
    assert [f.title for f in gallery.figures] == ["FDM", "LDM", "CEM", "Harmonic", "LSCM"]
    assert (folder / "pages" / "surface-hemi-ellipsoid.md").is_file()


def test_exhibits_are_sections_with_their_pictures_and_tables(written):
    report, folder = written
    section = next(s for s in sections_of(report) if s.name == "exhibit-koebe")
    (figure,) = (i for i in section.items if getattr(i, "files", None))
    assert (folder / figure.files[0]).is_file()
    (table,) = (i for i in section.items if hasattr(i, "rows"))
    assert [v.number for row in table.rows for v in row] == [1, 0.1, 2, None]


def test_stand_ins_are_said_to_stand_for_counts_and_only_fitted_ones_for_difficulty(small_run):
    evidence = Evidence.of(small_run)
    words = stand_ins_words(evidence)
    given = {"fitted": "fdm"}
    facts = [r.mesh.model_copy(update=given) for r in evidence.records]
    fitted = tuple(
        r.model_copy(update={"mesh": mesh}) for r, mesh in zip(evidence.records, facts, strict=True)
    )
    assert "not for their difficulty" in words
    assert "decides nothing" in stand_ins_words(replace(evidence, records=fitted))
    assert words.startswith("2 of 2 surfaces are stand-ins")
    low, high = re.search(
        r"E_C by CEM is (\S+) to (\S+) times the printed one, and 0 of 2", words
    ).groups()
    assert 0 < float(low) < float(high)
    own = tuple(r for r in evidence.records if not r.mesh.paper_row)
    assert stand_ins_words(replace(evidence, records=own)) == ""


def test_what_did_not_end_ok_and_what_is_missing_are_listed(written):
    table = next(t for t in items_of(written[0], Table) if t.name == "not-ok")
    statuses = [row[3].text for row in table.rows]
    assert statuses.count("failed") == 2
    assert statuses.count("timeout") == 2
    assert statuses.count("missing") == 1


def test_there_are_at_least_ten_claims_and_none_is_without_figures(written):
    claims = list(items_of(written[0], Claim))
    assert len(claims) >= 10
    assert len({claim.name for claim in claims}) == len(claims)
    assert all(claim.figures and claim.place and claim.test for claim in claims)
    assert len({claim.verdict for claim in claims}) == 4


def test_links_of_the_markdown_lead_somewhere(written):
    _, folder = written
    records = (folder / "records.md").read_text()
    for page in [folder / "report.md", *(folder / "pages").iterdir()]:
        text = page.read_text()
        for target in re.findall(r"\]\(([^)]+)\)", text):
            path, _, anchor = target.partition("#")
            if path == CITATION.address:
                continue
            assert not path or (page.parent / path).is_file(), (page, target)
            assert not anchor or f'<a id="{anchor}">' in (records if path else text)


def test_the_first_screen_of_every_form_has_the_paper_and_all_verdicts(written):
    report, folder = written
    claims = list(items_of(report, Claim))
    counted = plain(report.findings.sentences[1])
    numbers = [int(number) for number in re.findall(r"\b\d+\b(?= (?:do|hold|ha|is|are))", counted)]
    assert counted.startswith(f"Of {len(claims)} claims of the paper, ")
    assert sum(numbers) == len(claims)
    assert [table.name for table in report.findings.tables] == ["head"]
    forms = [(folder / name).read_text() for name in ("index.html", "report.md", "report.tex")]
    for text in (printed(paper_tables(report)), *forms):
        head = " ".join(text.split())
        assert CITATION.authors in head
        assert f"doi:{CITATION.doi}" in head
        assert "CEM is faster than QIEM, FDM and LDM in 3 of the 4 comparisons" in head
        assert "average speedup over QIEM" in head or "tables/head" in head
        assert f"Of {len(claims)} claims of the paper, " in head
    failing = next(part for part in report.findings.sentences[1] if isinstance(part, Claim))
    assert f'<a href="#{failing.name}">{failing.title}</a>' in forms[0]


def test_the_terminal_shows_four_tables_in_80_columns(written):
    text = printed(paper_tables(written[0]))
    assert all(f"Table {k}: " in text for k in (1, 2, 3, 4))
    assert max(map(len, text.splitlines())) <= 80
    assert "1.00 ±0%ˢ" in text
    assert "failed" in text


@pytest.mark.usefixtures("quick_drawing")
def test_the_same_run_gives_the_same_bytes(small_run, tmp_path):
    one, two = (tmp_path / name for name in ("one", "two"))
    for folder in (one, two):
        write_report(small_run, folder, "cembench report run")
    files = json.loads((one / "contents.json").read_text())["files"]
    for name in ("contents.json", *files):
        assert (one / name).read_bytes() == (two / name).read_bytes(), name


@pytest.mark.usefixtures("quick_drawing")
def test_an_older_report_is_replaced_and_other_files_are_left(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    folder = tmp_path / "out"
    write_report(store.folder, folder, "c")
    (folder / "mine.txt").write_text("mine")
    contents = json.loads((folder / "contents.json").read_text())
    for name in ("old.png", "changed.png", "../run/plan.json"):
        hashed = hashlib.sha256((folder / name).read_bytes() if "run" in name else b"old")
        contents["files"][name] = [hashed.hexdigest()]
    (folder / "contents.json").write_text(json.dumps(contents))
    (folder / "old.png").write_text("old")
    (folder / "changed.png").write_text("new")
    # A surface that an older run did not keep, and no plan.
    next((tmp_path / "run" / "meshes").iterdir()).unlink()
    report = write_report(store.folder, folder, "c")
    assert (folder / "mine.txt").read_text() == "mine"
    assert (folder / "changed.png").read_text() == "new"
    assert not (folder / "old.png").exists()
    assert (tmp_path / "run" / "plan.json").exists()
    gaps = list(items_of(report, Gap))
    assert any("does not hold the surface" in gap.why for gap in gaps)
    assert any("--solves reuse,backslash" in gap.command for gap in gaps)


@pytest.mark.usefixtures("quick_drawing")
def test_a_run_of_other_surfaces_alone_has_a_report(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    for record in store.records():
        if record.mesh.paper_row:
            next((tmp_path / "run" / "records").glob(f"{record.cell.label}.json")).unlink()
    report = write_report(store.folder, tmp_path / "out", "c")
    assert report.title == "flat-disk, mapped by 5 algorithms"
    assert {section.name for section in report.sections} == {"summary", "results", "surfaces"}
    assert not list(items_of(report, Gap))
    assert not list(items_of(report, Claim))
    assert report.paper is None
    assert [table.name for table in report.findings.tables] == ["standings", "own-surfaces"]
    assert (
        "| surface | faces | mean angle error, degrees QIEM |"
        in ((tmp_path / "out" / "report.md").read_text().partition("## Results")[0])
    )
    tables = list(items_of(report, Table))
    assert not any(column.title == "printed" for table in tables for column in table.columns)
    assert "cells ended with a valid map" in report.findings.figures[-1].words
    text = printed(paper_tables(report))
    assert max(map(len, text.splitlines())) <= 80
    assert any(line.split()[:2] == ["flat-disk", "QIEM"] for line in text.splitlines())
    assert re.search(r"^ +FDM +timeout +timeout +timeout +timeout", text, re.M)


def test_no_run_and_no_record_are_errors_and_nothing_is_written(cli):
    code, _, err = cli("report", "nowhere")
    assert code == 2
    assert "nowhere holds no run: there is no such folder. Make one with `cembench run`" in err
    (cli.folder / "empty" / "records").mkdir(parents=True)
    code, _, err = cli("report", "empty", "-o", "out")
    assert code == 2
    assert "empty holds no record: no cell is finished yet" in err
    assert not (cli.folder / "out").exists()


def test_a_file_is_no_folder_for_a_report(small_run, tmp_path):
    (tmp_path / "out").write_text("")
    with pytest.raises(RecordError, match="is a file; name a folder with -o"):
        write_report(small_run, tmp_path / "out", "c")


@pytest.mark.usefixtures("quick_drawing")
def test_nothing_is_left_of_a_report_that_fails(small_run, tmp_path, monkeypatch):

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("cembench.report.write_report.write_latex", full)
    with pytest.raises(RecordError, match="No space left on device"):
        write_report(small_run, tmp_path / "out", "c")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("quick_drawing")
def test_the_verb_says_where_the_report_is(cli, small_run):
    code, out, err = cli("report", small_run, "-o", "out", "--json")
    data = json.loads(out)
    assert code == 0
    assert (cli.folder / data["html"]).is_file()
    assert data["claims"]["delaunay"] == "holds"
    assert "table-4" in data["tables"]
    assert data["paper"]["doi"] == CITATION.doi
    assert data["findings"][0].startswith("CEM is faster than QIEM, FDM and LDM in 3 of the 4 ")
    assert sum(data["verdicts"].values()) == len(data["claims"])
    assert next(iter(data["verdicts"])) == "does not hold here"
    assert "[1/4] surface Chinese Vase" in err


def test_of_a_cell_measured_twice_the_later_record_counts(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    old = next(r for r in store.records() if r.cell.algorithm == "cem")
    new = changed(old, cell={"code_hash": "edited"}, started_at="2026-02-01T00:00:00+00:00")
    store.save(new, None, {"id": "machine"})
    evidence = Evidence.of(store.folder)
    surface = next(s for s in evidence.surfaces if s.mesh_hash == old.cell.mesh_hash)
    assert evidence.find(surface, evidence.series_of("cem")).cell.key == new.cell.key
    assert evidence.superseded == {old.cell.key}


def test_other_parameters_are_a_series_of_their_own(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    old = next(r for r in store.records() if r.cell.algorithm == "cem")
    store.save(changed(old, cell={"parameters": {"inversion": False}}), None, {"id": "machine"})
    evidence = Evidence.of(store.folder)
    labels = [s.label for s in evidence.series if s.algorithm == "cem"]
    assert labels == ["CEM", "CEM (inversion=False)"]
    (without,) = [s for s in evidence.series if s.label == labels[1]]
    assert ("inversion", "False") in without.variant
    assert evidence.series_of("cem").label == "CEM"


def test_algorithms_of_one_title_are_told_apart_by_their_targets_or_names(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    old = next(r for r in store.records() if r.cell.algorithm == "cem")
    for name, target in (("of-holes", "circular holes"), ("free", "free boundary")):
        record = changed(old, cell={"algorithm": name}, target=target)
        store.save(record, None, {"id": "machine"})
    labels = {s.algorithm: s.label for s in Evidence.of(store.folder).series}
    assert labels["cem"] == "CEM"
    assert labels["of-holes"] == "CEM (circular holes)"
    assert labels["free"] == "CEM (free boundary)"
    store.save(changed(old, cell={"algorithm": "twin"}), None, {"id": "machine"})
    labels = {s.algorithm: s.label for s in Evidence.of(store.folder).series}
    assert (labels["cem"], labels["twin"]) == ("CEM (cem)", "CEM (twin)")


def fdm_record(store, mesh_name, origin, public_program):
    """Save FDM's record on a surface of this origin with this reading; return its key."""
    old = next(r for r in store.records() if r.cell.algorithm == "fdm")
    parameters = {"public_program": public_program, "tolerance": 1e-5}
    cell = {"mesh": mesh_name, "mesh_hash": mesh_name, "parameters": parameters}
    record = changed(old, cell=cell, mesh={"origin": origin, "paper_row": "Foot"})
    store.save(record, None, {"id": "machine"})
    return record.cell.key


def labels_of(store):
    """The label of the series of each cell of FDM that has parameters."""
    evidence = Evidence.of(store.folder)
    by_name = {}
    for surface in evidence.surfaces:
        for series in evidence.series:
            record = evidence.find(surface, series) if series.algorithm == "fdm" else None
            if record is not None and record.cell.parameters:
                by_name[record.cell.key] = dict(series.variant)["public_program"]
    return by_name


def test_a_model_run_as_printed_is_in_the_column_of_the_other_surfaces(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    model = fdm_record(store, "own", "model", public_program=True)
    other = fdm_record(store, "other", "stand-in", public_program=False)
    assert labels_of(store) == {model: "False", other: "False"}
    labels = [s.label for s in Evidence.of(store.folder, find_paper("ldm2018")).series]
    assert "FDM (as the paper ran it)" in labels


def test_both_readings_on_a_model_are_two_columns(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    public = fdm_record(store, "own", "model", public_program=True)
    corrected = fdm_record(store, "own", "model", public_program=False)
    assert labels_of(store) == {public: "True", corrected: "False"}


def test_a_reading_asked_for_everywhere_is_one_column(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    keys = [fdm_record(store, o, o, public_program=True) for o in ("model", "stand-in")]
    assert labels_of(store) == dict.fromkeys(keys, "True")


def test_a_store_keeps_surfaces_and_knows_a_wrong_one(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    record = store.records()[0]
    assert store.mesh(record.cell).hash == record.cell.mesh_hash
    assert Store(tmp_path / "none").mesh(record.cell) is None
    one, two = sorted((tmp_path / "run" / "meshes").iterdir())[:2]
    one.write_bytes(two.read_bytes())
    wrong = next(r for r in store.records() if r.cell.mesh_hash.startswith(one.stem))
    with pytest.raises(RecordError, match="does not hold the surface named in its file name"):
        store.mesh(wrong.cell)
    one.write_bytes(b"cut")
    with pytest.raises(RecordError, match="is not an archive of arrays"):
        store.mesh(wrong.cell)


def test_runs_that_are_merged_bring_their_surfaces(tmp_path):
    store = write_run(tmp_path / "run", ("reuse",))
    merge([store], Store(tmp_path / "both"))
    names = [path.name for path in (tmp_path / "run" / "meshes").iterdir()]
    assert sorted(p.name for p in (tmp_path / "both" / "meshes").iterdir()) == sorted(names)


@pytest.mark.slow
def test_other_processes_draw_the_same_pictures_and_plots(monkeypatch, tmp_path):
    """One surface lies in the run, the other does not."""
    store = write_run(tmp_path / "run", ("reuse",), ("cem", "lscm"))
    (tmp_path / "run" / "meshes" / f"{meshes()[''].hash[:32]}.npz").unlink()
    write_report(store.folder, tmp_path / "one", "c")
    monkeypatch.setattr(plots, "_drawn", None)
    monkeypatch.setattr(inspection, "SIDE", None)
    write_report(store.folder, tmp_path / "two", "c", jobs=2)
    assert tree(tmp_path / "two") == tree(tmp_path / "one")


def test_the_head_says_until_when_it_was_measured(evidence):
    assert "until" not in dict(facts(evidence))["rounds"]
    records = [
        changed(r, cell={"repeats": 0, "precision": precision})
        for r, precision in zip(evidence.records, [0.05, 0.1] * 100, strict=False)
    ]
    told = dict(facts(replace(evidence, records=tuple(records))))["rounds"]
    assert "until ±5 % or ±10 % or the time limit was reached" in told


def test_a_report_is_two_lines_in_a_notebook(written):
    report, folder = written
    assert repr(report).splitlines() == [
        f"{report.title}: {len(report.records)} records",
        str(report.page),
    ]
    assert report.page.name == "index.html"
    assert f"<a href='{report.page}'>" in report._repr_html_()
    assert folder.is_dir()
