"""A second paper, given as a folder: its report has its tables, pictures and claims."""

import re
import shutil
from pathlib import Path

import pytest

from cembench.core.errors import RecordError
from cembench.report.content.evidence import Evidence
from cembench.report.document import Claim, Figure, Gap, Table, items_of, plain, sections_of
from cembench.report.write_report import write_report
from cembench.results.papers import find_paper
from tests.report.conftest import drawing_little

FOLDER = Path(__file__).parents[1] / "papers/another"
PAPER = find_paper(str(FOLDER))


@pytest.fixture(scope="module")
def report(small_run, tmp_path_factory):
    with drawing_little():
        return write_report(small_run, tmp_path_factory.mktemp("another"), "c", paper=PAPER)


def test_a_paper_costs_few_lines():
    files = [file for file in FOLDER.iterdir() if file.is_file()]
    assert sum(len(file.read_text().splitlines()) for file in files) <= 60


def test_its_title_tables_and_misprints_are_there(report):
    assert report.title == "Maps onto Circles: measured again"
    assert report.paper == PAPER
    tables = {table.name: table for table in items_of(report, Table)}
    assert {"table-1", "table-3"} <= tables.keys()
    assert not {"table-2", "table-4", "averages"} & tables.keys()
    table = tables["table-1"]
    assert table.caption.startswith("What the paper printed is for programs on a machine of their")
    groups = {column.group for column in table.columns}
    assert groups == {"", "Harmonic", "CEM", "CEM iterations"}
    assert table.absent == "not in this run: Teapot"
    printed = {row[0].text: row[2].text for row in table.rows if row[2].origin == "printed"}
    assert printed == {"Chinese Vase": "0.50", "Liu's Neutral Face": "0.60"}
    assert any(section.title == "Tables 1 to 3" for section in sections_of(report))


def test_its_claims_have_verdicts(report):
    items = [item for section in sections_of(report) for item in section.items]
    claims = {item.name: item for item in items if isinstance(item, Claim)}
    assert list(claims) == ["lower-energy", "small-angles"]
    assert claims["lower-energy"].verdict == "holds"
    assert claims["lower-energy"].figures.startswith("true on ")
    assert claims["small-angles"].verdict == "does not hold here"
    assert "Chinese Vase" in claims["small-angles"].figures
    assert claims["small-angles"].remark.endswith("Not much of a claim.")
    text = plain(report.findings.sentences[0])
    assert text.startswith("Of 2 claims of the paper, 1 does not hold here: small angles; 1 holds")


def test_its_pictures_are_there_and_no_other_paper_s(report):
    assert "Figure 1" in {figure.paper for figure in items_of(report, Figure)}
    items = [item for section in sections_of(report) for item in section.items]
    gaps = [item.title for item in items if isinstance(item, Gap)]
    assert not any(title.startswith("Figure") for title in gaps)


def test_a_run_without_any_of_its_models_is_said(small_run):
    paper = PAPER.model_copy(update={"tables": {1: {"Teapot": {"faces": 900}}}, "title": "Pots"})
    with pytest.raises(RecordError, match=r"model of 'Pots'; its models are Teapot\. Ask"):
        Evidence.of(small_run, paper)


def test_the_command_takes_a_folder(cli, small_run, quick_drawing):
    told = cli("report", small_run, "-o", "out", "--paper", FOLDER, "--json")[1]
    assert '"title": "Maps onto Circles: measured' in told
    code, _, error = cli("report", small_run, "-o", "out", "--paper", "nowhere")
    assert code == 2
    assert "neither an installed paper nor a folder" in " ".join(error.split())


def test_code_of_a_folder_that_is_not_installed_needs_trust(
    cli, small_run, quick_drawing, tmp_path, monkeypatch
):
    folder = shutil.copytree(FOLDER, tmp_path / "sent")
    (folder / "checks.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w').close()\n")
    code, _, error = cli("report", small_run, "-o", "out", "--paper", folder)
    assert code == 2
    assert "would run with your rights" in " ".join(error.split())
    assert "add `trust`" in error
    assert not (tmp_path / "ran").exists()
    assert not (cli.folder / "out").exists()
    monkeypatch.setattr("sys.stdin.isatty", lambda: True, raising=False)
    for answer, reports in ((False, False), (True, True)):
        monkeypatch.setattr("typer.confirm", lambda text, answer=answer: answer)
        cli("report", small_run, "-o", "asked", "--paper", folder)
        assert (cli.folder / "asked/index.html").exists() == reports == (tmp_path / "ran").exists()
    assert cli("report", small_run, "-o", "there", "--paper", folder, "--trust")[0] == 0


def test_a_strange_paper_brings_no_html_of_its_own(small_run, tmp_path, quick_drawing):
    strange = "<img src=x onerror=alert(1)>"
    about = dict.fromkeys(("title", "authors", "place", "doi", "machine"), f"A {strange} B")
    claims = [
        claim.model_copy(
            update=dict.fromkeys(("plain", "quote", "place", "test", "remark"), strange)
        )
        for claim in PAPER.claims
    ]
    printed = {
        number: one.model_copy(update={"title": strange, "caption": strange})
        for number, one in PAPER.printed.items()
    }
    paper = PAPER.model_copy(update=about | {"claims": tuple(claims), "printed": printed})
    write_report(small_run, tmp_path / "out", "c", paper=paper)
    for file in (tmp_path / "out").rglob("*.md"):
        text = file.read_text(encoding="utf-8")
        assert not re.search(r"(?<!\\)<img", text), file
    page = (tmp_path / "out/index.html").read_text(encoding="utf-8")
    assert "<img src=x" not in page
