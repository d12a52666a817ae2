"""The page of a report as text; how a browser shows it is in test_html_browser.py."""

import base64
import dataclasses
import gzip
import hashlib
import json
import math
from collections import Counter
from html.parser import HTMLParser
from pathlib import PurePosixPath

import numpy as np
import pytest
from PIL import Image

from cembench.core.errors import RenderError
from cembench.report import pictures
from cembench.report.document import Column, Figure, Report, Section, Table, Text, Value
from cembench.report.pictures import with_transparent_background
from cembench.report.render import html
from cembench.report.render.html import write_html
from cembench.results.machines import letter
from tests.report.sample_report import CITATION, HOSTILE, sample_report

VOID = {"meta", "link", "img", "br", "input"}


class Page(HTMLParser):
    """Elements with their attributes and words; complains of tags that do not match."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.open = [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        element = {"tag": tag, **dict(attributes), "words": ""}
        self.elements.append(element)
        if tag not in VOID:
            self.open.append(element)

    def handle_endtag(self, tag):
        assert self.open.pop()["tag"] == tag

    def handle_data(self, words):
        for element in self.open:
            element["words"] += words

    def all(self, tag, **attributes):
        return [
            e
            for e in self.elements
            if e["tag"] == tag and all(e.get(name) == value for name, value in attributes.items())
        ]


def store_of(page):
    """What the page holds compressed."""
    packed = page.all("script", id="store")[0]["words"]
    return json.loads(gzip.decompress(base64.b85decode(packed)))


def page_of(report, folder):
    return Page(write_html(report, folder).read_text())


def report_of(*items, records=None):
    return Report("A title", "", (), (Section("part", "Part", items),), records or {})


def table_of(columns, *rows, footer_rows=0):
    heads = (Column("surface", numeric=False), *(Column(name) for name in columns))
    return Table("some", "Some", heads, rows, footer_rows=footer_rows)


@pytest.fixture(scope="module")
def sample(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    return page_of(sample_report(folder), folder)


def test_it_is_one_file_that_names_no_other_place(sample):
    for element in sample.elements:
        assert element.get("src", "data:").startswith("data:")
        target = element.get("href", "#")
        beside = "beside" in element.get("class", "").split()
        cited = target == CITATION.address  # a link; nothing is loaded from there
        assert target.startswith(("#", "data:")) or cited or (beside and "://" not in target)


def test_its_policy_lets_only_its_own_scripts_run_and_no_request_leave(sample):
    policy = sample.all("meta", **{"http-equiv": "Content-Security-Policy"})[0]["content"]
    rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
    assert rules["default-src"] == "'none'"
    assert rules["img-src"] == "data: blob:"
    packed = sample.all("script", id="plotly")[0]["words"]
    own = [s["words"].encode() for s in sample.all("script") if "type" not in s]
    scripts = [*own, gzip.decompress(base64.b85decode(packed))]
    hashes = [base64.b64encode(hashlib.sha256(s).digest()).decode() for s in scripts]
    assert len(own) == 1
    assert rules["script-src"] == " ".join(f"'sha256-{value}'" for value in hashes)


def test_every_link_within_leads_somewhere_and_no_anchor_stands_twice(sample):
    anchors = Counter(e["id"] for e in sample.elements if "id" in e)
    assert set(anchors.values()) == {1}
    inner = {e["href"][1:] for e in sample.all("a") if e["href"].startswith("#")}
    records = {f"record-{key}" for key in store_of(sample)["records"]}
    assert inner <= set(anchors) | records
    assert inner & records


def test_the_head_has_the_paper_the_verdicts_linked_the_suspects_and_the_own_table(sample):
    (about,) = sample.all("p", **{"class": "about"})
    assert all(part in about["words"] for part in (CITATION.authors, CITATION.place, CITATION.doi))
    (head,) = sample.all("div", **{"class": "findings"})
    order = ("printed 8.5", "All surfaces", "1 does not hold here: claim 2; 1 holds.", "14", "70.3")
    places = [head["words"].index(words) for words in order]
    assert places == sorted(places)
    (link,) = sample.all("a", href="#claim-2")
    assert link["words"] == "claim 2"


def test_it_has_a_language_a_title_and_words_for_every_picture(sample):
    assert sample.all("html")[0]["lang"] == "en"
    assert sample.all("title")[0]["words"] == "A small report"
    assert all(picture["alt"] for picture in sample.all("img") if picture.get("alt") != "")
    assert all(b.get("aria-label") or b["words"].strip() for b in sample.all("a"))


def test_a_surface_named_like_code_is_only_words(sample):
    kinds = Counter(script.get("type", "code") for script in sample.all("script"))
    assert kinds == {"code": 1, "text/plain": 3}  # Plotly, a view, and what else is compressed
    assert any(HOSTILE in heading["words"] for heading in sample.all("h2"))
    assert not any("onerror" in e or "onclick" in e for e in sample.elements)


def test_code_in_a_plot_stays_in_its_data(tmp_path):
    plot = {"data": [{"name": "</script><script>alert(1)</script>", "y": [1.0, math.nan]}]}
    page = page_of(report_of(Figure("f", "F", (), plot=plot)), tmp_path)
    assert store_of(page)["plots"]["f"]["data"] == [
        {"name": plot["data"][0]["name"], "y": [1.0, None]}
    ]


def test_the_same_report_gives_the_same_bytes(tmp_path):
    first = write_html(sample_report(tmp_path), tmp_path).read_bytes()
    assert write_html(sample_report(tmp_path), tmp_path).read_bytes() == first


def test_symbols_of_the_paper_have_subscripts_and_code_does_not(tmp_path):
    path = write_html(report_of(Text("E_C & <b>t_CEM</b>, `p E_C <i>`")), tmp_path)
    assert (
        "<p><i>E</i><sub>C</sub> &amp; &lt;b&gt;<i>t</i><sub>CEM</sub>&lt;/b&gt;, "
        "<code>p E_C &lt;i&gt;</code></p>"
    ) in path.read_text()


def test_no_line_ends_before_a_per_cent(tmp_path):
    path = write_html(report_of(Text("16 % of 184, `5 %`")), tmp_path)
    assert "<p>16\u00a0% of 184, <code>5 %</code></p>" in path.read_text()


def test_a_report_without_plots_is_small(tmp_path):
    path = write_html(report_of(Text("See `cembench show`.")), tmp_path)
    assert path == tmp_path / "index.html"
    assert path.stat().st_size < 60_000
    assert Page(path.read_text()).all("code")[0]["words"] == "cembench show"


def test_a_column_of_one_origin_is_marked_in_its_head_and_a_mixed_one_in_each_cell(tmp_path):
    def row(name, second):
        return Value(name), Value("1.0", 1.0, "printed"), Value("2.0", 2.0, second)

    table = table_of(("a", "b"), row("x", "model"), row("y", "stand-in"), row("z", "derived"))
    page = page_of(report_of(table), tmp_path)
    heads = [head["words"] for head in page.all("th", scope="col")]
    assert heads == ["surface", "aᵖ", "b"]
    assert [cell["words"] for cell in page.all("td")] == [
        "1.0",
        "2.0ᵐ",
        "1.0",
        "2.0ˢ",
        "1.0",
        "2.0",
    ]
    legend = page.all("p", **{"class": "legend"})[0]["words"]
    assert all(sign in legend for sign in "ᵖᵐˢ")


def test_a_footer_of_another_origin_does_not_unmark_a_column(tmp_path):
    rows = [
        (Value(name), Value("1.0", 1.0, origin))
        for name, origin in (("x", "printed"), ("y", "printed"), ("mean", "derived"))
    ]
    page = page_of(report_of(table_of(("a",), *rows, footer_rows=1)), tmp_path)
    assert [head["words"] for head in page.all("th", scope="col")] == ["surface", "aᵖ"]
    assert len(page.all("tfoot")) == 1


def test_a_number_links_to_its_record_if_the_report_holds_it(tmp_path):
    values = Value("1.0", 1.0, "model", "known"), Value("2.0", 2.0, "model", "lost")
    table = table_of(("a", "b"), (Value("x"), *values))
    calls = [[0.123456789, 2], [1e-9 / 3]]
    records = {"known": {"mesh": "x", "algorithm": "cem", "seconds": 1.0, "cause": None}}
    records["known"] |= {"energy": 0.1 + 0.2, "calls": calls}
    page = page_of(report_of(table, records=records), tmp_path)
    assert [a["href"] for a in page.all("a", **{"class": "figure-link"})] == ["#record-known"]
    fields = store_of(page)["records"]["known"]["fields"]
    assert ["seconds", [["", "1.0"]]] in fields
    assert ["energy", [["", "0.30000000000000004"]]] in fields
    assert ["calls", [["", "[[0.123457, 2], [3.33333e-10]]"]]] in fields
    assert "cause" not in dict(fields)


def test_keys_of_records_are_as_long_as_they_must_be_to_differ(tmp_path):
    keys = ["0123456789ab" + end for end in ("cdef", "c012", "ffff")]
    row = (Value("x"), *(Value("1", 1.0, "model", key) for key in keys))
    records = {key: {"mesh": "x", "algorithm": key} for key in keys}
    page = page_of(report_of(table_of("abc", row), records=records), tmp_path)
    links = [a["href"] for a in page.all("a", **{"class": "figure-link"})]
    assert links == [f"#record-{key[:14]}" for key in keys]


def test_a_filter_offers_what_records_differ_in_and_knows_the_names_of_tables(tmp_path):
    rows = [("lion-stand-in", "Lion", "cem", "CEM"), ("foot", None, "cem", "CEM")]
    rows += [("foot", None, "bff", "BFF"), ("foot", None, "bff-igl", "BFF")]
    rows += [("foot", None, "cetm-flips", "CETM, flips")]
    columns = ("mesh", "paper_row", "algorithm", "title", "status")
    records = {f"k{n}": dict(zip(columns, (*row, "ok"), strict=True)) for n, row in enumerate(rows)}
    page = page_of(report_of(records=records), tmp_path)
    boxes = [(box["name"], box["value"]) for box in page.all("input", type="checkbox")]
    assert boxes == [
        ("surface", "foot"),
        ("surface", "Lion"),
        ("algorithm", "BFF (bff)"),
        ("algorithm", "BFF (bff-igl)"),
        ("algorithm", "CEM"),
        ("algorithm", "CETM (flips)"),
    ]
    store = store_of(page)
    choices = [[1, 2, 0], [0, 2, 0], [0, 0, 0], [0, 1, 0], [0, 3, 0]]
    assert store["cells"] == {f"k{n}": own for n, own in enumerate(choices)}
    assert store["names"]["cetm-flips"] == store["names"]["CETM (flips)"] == [1, 3]  # as in tables
    assert store["names"]["lion-stand-in"] == store["names"]["Lion"] == [0, 1]
    assert store["names"]["bff"] == [1, 0]
    assert "BFF" not in store["names"]  # it could mean either


def test_numbers_sort_by_all_their_digits_and_infinities_are_no_gaps(tmp_path):
    row = (Value("x"), Value("0.1", 0.1 + 0.2), Value("inf", math.inf), Value("nan", math.nan))
    page = page_of(report_of(table_of(("a", "b", "c"), row)), tmp_path)
    assert [cell.get("data-n") for cell in page.all("td")] == [repr(0.1 + 0.2), "Infinity", None]


def test_equal_causes_are_one_remark(tmp_path):
    rows = [
        (Value(n), Value("-", why=why))
        for n, why in (("x", "late"), ("y", "folded"), ("z", "late"))
    ]
    page = page_of(report_of(table_of(("a",), *rows)), tmp_path)
    assert [cell["words"] for cell in page.all("td")] == ["-a", "-b", "-a"]
    assert len(page.all("li", id="some-a")) == len(page.all("li", id="some-b")) == 1


def test_remarks_are_lettered_beyond_the_alphabet():
    assert [letter(k) for k in (0, 25, 26, 51, 52, 701, 702)] == [
        "A", "Z", "AA", "AZ", "BA", "ZZ", "AAA"
    ]  # fmt: skip


def test_data_travels_with_the_page_unless_it_is_large(tmp_path, monkeypatch):
    (tmp_path / "a b.csv").write_text("x,y\n1,2\n")
    report = report_of(Figure("f", "F", (), data=PurePosixPath("a b.csv")))
    page = page_of(report, tmp_path)
    assert page.all("a", download="a b.csv")[0]["href"] == "a%20b.csv"  # until the script runs
    assert store_of(page)["texts"] == {"a b.csv": "x,y\n1,2\n"}
    monkeypatch.setattr(html, "DATA_BYTES", 3)
    assert store_of(page_of(report, tmp_path))["texts"] == {}


def test_a_picture_in_several_places_is_embedded_once(tmp_path):
    Image.new("RGB", (30, 20), "red").save(tmp_path / "p.png")
    files = (PurePosixPath("p.png"),)
    again = Section("page", "Page", (Figure("b", "B", files),), page=True)
    report = Report(
        "A title", "", (), (Section("part", "Part", (Figure("a", "A", files),), (again,)),)
    )
    images = page_of(report, tmp_path).all("img")
    assert [(i["data-picture"], i["width"]) for i in images] == [("p.png", "30")] * 3
    assert ["src" in image for image in images] == [True, False, False]


@pytest.mark.parametrize(
    "what", [{"files": (PurePosixPath("no.png"),)}, {"data": PurePosixPath("no.csv")}]
)
def test_a_file_that_is_not_there_is_named_and_nothing_is_written(tmp_path, what):
    figure = dataclasses.replace(Figure("f", "F", ()), **what)
    with pytest.raises(
        RenderError, match=r"names .*no\.(png|csv), which cannot be read.*write the"
    ):
        write_html(report_of(figure), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_no_picture_is_named(tmp_path):
    (tmp_path / "p.png").write_text("words")
    with pytest.raises(RenderError, match=r"p\.png, which cannot be read"):
        write_html(report_of(Figure("f", "F", (PurePosixPath("p.png"),))), tmp_path)


def test_pictures_keep_within_the_budget_and_small_ones_keep_all_they_have(tmp_path):
    sizes = [(100, 100), (2000, 1000), (2000, 2000)]
    cap = pictures.pixel_cap(sizes, budget=1_000_000)
    assert cap == pytest.approx((1_000_000 - 100 * 100) / 2)
    assert pictures.pixel_cap(sizes[:2]) == math.inf
    Image.new("RGB", (2000, 1000)).save(tmp_path / "p.png")
    seen = pictures.embed_pixels(tmp_path / "p.png", cap, exact=False)
    assert seen.width * seen.height == pytest.approx(cap, rel=0.01)
    assert seen.width / seen.height == pytest.approx(2, rel=0.01)


def test_a_plot_without_script_is_its_drawing_if_that_is_small_and_its_pixels_if_not(
    tmp_path, monkeypatch
):
    head = '<svg xmlns="http://www.w3.org/2000/svg" width="72pt" height="36pt"></svg>'
    (tmp_path / "p.svg").write_text(head)
    Image.new("RGB", (30, 20)).save(tmp_path / "p.png")
    files = (PurePosixPath("p.png"), PurePosixPath("p.svg"))
    report = report_of(Figure("p", "P", files, plot={"data": []}))
    page = page_of(report, tmp_path)
    image = page.all("img")[0]
    assert store_of(page)["texts"][image["data-picture"]] == head
    assert (image["width"], image["height"]) == ("96", "48")
    monkeypatch.setattr(pictures, "VECTOR_BYTES", 10)
    assert page_of(report, tmp_path).all("img")[0]["src"].startswith("data:image/webp;base64,")


def test_the_white_round_a_picture_becomes_transparent_and_the_white_in_it_stays():
    pixels = np.full((60, 80, 3), 255, dtype=np.uint8)
    pixels[10:50, 20:60] = (80, 130, 180)
    pixels[25:35, 35:45] = 255  # within
    pixels[5, 5] = 200  # a speck, as JPEG leaves them
    array = np.asarray(with_transparent_background(Image.fromarray(pixels)))
    assert (array[:8, :, 3] == 0).all()
    assert (array[12:48, 22:58, 3] == 255).all()
    assert array.shape == (60, 80, 4)
