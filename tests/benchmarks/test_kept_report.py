"""A kept report holds what its page shows, and links to nothing that was left out."""

import lzma
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks.kept_report import LEFT_OUT, kept_report, rounded, shortened
from benchmarks.pages import ROOT
from cembench.report.pictures import size_of
from cembench.results.report_records import PACKED, text_rows


def test_links_to_what_is_left_out_become_plain_text():
    page = "| [1.91](records.md#ab12) | [turtle](pages/surface-turtle.md) |\n"
    assert shortened(page, "reports/x") == "| 1.91 | turtle |\n"
    forms = "All. ([SVG](figures/a.svg), [PDF](figures/a.pdf), [data](figures/a.csv))\n"
    assert shortened(forms, "reports/x") == "All.\n"
    records = "a line of [records.csv](records.csv)"
    assert shortened(records, "reports/x") == "a line of [records.csv](records.csv.xz)"
    made = "Made by `cembench report results/x -o elsewhere`."
    assert shortened(made, "reports/x") == "Made by `cembench report results/x -o reports/x`."


def test_only_what_the_page_shows_is_copied_and_what_was_there_goes(tmp_path):
    report, kept = tmp_path / "report", tmp_path / "kept"
    for name in ("figures/a.png", "figures/a.svg", "tables/t.csv", "pages/surface-a.md"):
        (report / name).parent.mkdir(parents=True, exist_ok=True)
        (report / name).write_text(name)
    page = "![A](figures/a.png) ([SVG](figures/a.svg)) [CSV](tables/t.csv) [a](pages/surface-a.md)"
    (report / "report.md").write_text(page)
    lines = "mesh,phases,seconds", f"{'0f' * 32},{{}},1.5", "b,{},0.123456789012"
    (report / "records.csv").write_text("\n".join(lines))
    kept.mkdir()
    (kept / "old.png").write_text("old")
    with pytest.raises(SystemExit, match="holds no report to replace"):
        kept_report(report, kept)
    (kept / "report.md").write_text("old")
    (report / "tables/t.csv").write_text("/home/me/meshes/a.obj")
    kept_report(report, kept, hide=[Path("/home/me/meshes")])
    assert (kept / "tables/t.csv").read_text() == "meshes/a.obj"
    files = {file.relative_to(kept).as_posix() for file in kept.rglob("*") if file.is_file()}
    assert files == {"report.md", "records.csv.xz", "figures/a.png", "tables/t.csv"}
    rows = [{"mesh": "0f" * 8, "seconds": "1.5"}, {"mesh": "b", "seconds": "0.123457"}]
    assert text_rows(kept) == rows
    first = (kept / "records.csv.xz").read_bytes()
    kept_report(report, kept)
    assert (kept / "records.csv.xz").read_bytes() == first


def test_a_large_picture_is_kept_as_a_smaller_one_that_the_page_shows(tmp_path):
    report, kept = tmp_path / "report", tmp_path / "kept"
    (report / "figures").mkdir(parents=True)
    noise = np.random.default_rng(1).integers(0, 256, (200, 2000, 3), dtype=np.uint8)
    Image.fromarray(noise).save(report / "figures/a.png")
    Image.fromarray(noise[:20, :20]).save(report / "figures/b.png")
    Image.fromarray(noise[:20, :20]).save(report / "figures/c.jpg")
    page = "![A](figures/a.png) ![B](figures/b.png) ![C](figures/c.jpg)"
    (report / "report.md").write_text(page)
    (report / "records.csv").write_text("mesh\na\n")
    kept_report(report, kept)
    shown = page.replace("a.png", "a.webp").replace("c.jpg", "c.webp")
    assert (kept / "report.md").read_text() == shown
    assert {file.name for file in (kept / "figures").iterdir()} == {"a.webp", "b.png", "c.webp"}
    assert size_of(kept / "figures/a.webp") == (1200, 120)


@pytest.mark.parametrize("report", ["paper", "real"])
def test_every_link_of_a_kept_report_leads_somewhere(report):
    folder = ROOT / "reports" / report
    for link in re.findall(r"\]\(([^)#]+)", (folder / "report.md").read_text(encoding="utf-8")):
        assert link.startswith("http") or (folder / link).exists(), link


def test_records_of_the_real_surfaces_are_kept_in_short():
    rows = text_rows(ROOT / "reports/real")
    assert all(rounded(value) == value for row in rows for value in row.values())
    assert not set(LEFT_OUT) & set(rows[0])
    assert len(rows) > 1000


def test_kept_reports_name_no_folder_of_the_machine_that_made_them():
    folders = re.compile(r"/(?:tmp|home|root|work|Users)/[\w.-]+")
    for file in sorted((ROOT / "reports").rglob("*")):
        if file.suffix in (".md", ".csv", ".json"):
            assert folders.findall(file.read_text(encoding="utf-8")) == [], file
        elif file.name == PACKED:
            assert folders.findall(lzma.decompress(file.read_bytes()).decode()) == [], file
