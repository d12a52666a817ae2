"""A paper is read from its folder, and what is wrong in one is said with its file and place."""

from importlib.metadata import EntryPoint

import pytest

from cembench.core.errors import ParameterError, RegistryError
from cembench.results import papers as module
from cembench.results.papers import NO_PAPER, find_paper, paper_of, papers, read_paper, usual_paper

FILES = {
    "paper.toml": """
title = "On maps"
authors = "A. Author"
place = "Journal 1 (2020)"
doi = "10.1/x"
algorithms = ["lscm", "cem"]
reference = "cem"
machine = "a laptop"
""",
    "tables.toml": """
[[tables]]
number = 1
file = "seconds.csv"
title = "seconds"
caption = "On {machine}."
""",
    "seconds.csv": "model,faces,lscm,cem\nFoot,100,0.5,0.25\nHand,200,,0.5\n",
    "claims.toml": """
[numbers]
most = 2.5

[words]
ours = "Ours."

[cases.maps]
rows = "ok"
each = { seconds = "first(seconds)" }

[[claims]]
name = "quick"
quote = "cem is quick"
place = "Section 1"
test = "Less than {most} seconds."
cases = "maps"
holds = "quick(seconds)"
remark = "{ours} Really."
""",
    "checks.py": "from math import *\nfrom .more import quick\ndef _own(): ...\n",
    "more.py": "def quick(seconds):\n    return seconds < 1\n",
}


@pytest.fixture
def folder(tmp_path):
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def test_a_paper_is_read_from_its_folder_with_its_checks(folder):
    with pytest.raises(ParameterError, match=r"checks\.py would run with your rights.*add `trust`"):
        find_paper(str(folder))
    paper = find_paper(str(folder), trust=True)
    assert (paper.models, paper.faces("Hand"), paper.compared) == (("Foot", "Hand"), 200, ("lscm",))
    assert paper.tables[1]["Hand"] == {"faces": 200, "lscm": None, "cem": 0.5}
    assert paper.printed[1].caption == "On a laptop."
    (claim,) = paper.claims
    assert (claim.test, claim.remark) == ("Less than 2.5 seconds.", "Ours. Really.")
    assert (claim.rows, claim.each) == ("ok", {"seconds": "first(seconds)"})
    assert paper.functions().keys() == {"quick"}
    assert paper.functions()["quick"](0.5)
    assert paper.profiles.quick == 8
    with pytest.raises(ValueError, match="frozen"):
        paper.title = "Another"


def test_cembench_s_own_paper_is_installed_and_the_usual_one():
    assert papers()["cem"] is find_paper("cem") is usual_paper() is paper_of("Knit Cap Man")
    assert paper_of("no such model") is NO_PAPER
    assert paper_of("") is NO_PAPER


@pytest.mark.parametrize(
    ("file", "old", "new", "told"),
    [
        (
            "paper.toml",
            "title",
            "titel",
            r"paper.toml: at the top: 'titel' is not known here; allowed are title, au",
        ),
        (
            "paper.toml",
            "machine",
            "speed",
            r"paper.toml: at the top: 'speed' is not known here; allowed are title",
        ),
        ("paper.toml", 'doi = "10.1/x"', "", "paper.toml: doi: field required"),
        (
            "paper.toml",
            "machine =",
            "claims =",
            "paper.toml: at the top: 'claims' is not known here",
        ),
        (
            "tables.toml",
            "[[tables]]",
            "[[errata]]\n[[figures]]",
            "'figures' is not known here; allo",
        ),
        (
            "claims.toml",
            "[words]",
            "[word]",
            "'word' is not known here; allowed are numbers, words,",
        ),
        ("paper.toml", "reference =", "reference", r"paper.toml is not TOML: .*line 7"),
        (
            "paper.toml",
            '"cem"\n',
            '"fdm"\n',
            r"'fdm' is none of the paper's algorithms \(lscm, cem",
        ),
        ("tables.toml", "number = 1", "", "tables.toml: tables: needs a number and the name of a"),
        ("tables.toml", '"seconds.csv"', '"s.csv"', r"s\.csv of a paper cannot be read: No such"),
        ("tables.toml", "[[tables]]", "[tables]", r"tables: write each as a table \[\[tables\]\]"),
        ("tables.toml", "{machine}", "{laptop}", r"\{'laptop'\} is no word of \[words\]; known: m"),
        (
            "tables.toml",
            "title =",
            "heading =",
            "tables.toml: printed.1: 'heading' is not known here; allowed are title, cap",
        ),
        (
            "seconds.csv",
            "0.5,0.25",
            "fast,0.25",
            "seconds.csv: line 2, column 'lscm': 'fast' is not",
        ),
        ("seconds.csv", "0.5,0.25", "0.25", "seconds.csv: line 2: 3 cells, under 4 headings"),
        ("seconds.csv", "Hand", "Foot", "seconds.csv: line 3: the model 'Foot' occurs twice"),
        ("seconds.csv", "faces", "triangles", "no table has the column 'faces' for 'Foot'"),
        (
            "claims.toml",
            'cases = "maps"',
            'cases = "map"',
            r"'quick': there is no \[cases.map\]; kn",
        ),
        (
            "claims.toml",
            "{most}",
            "{least}",
            r"\{'least'\} is no word of \[words\]; known: machine",
        ),
        (
            "claims.toml",
            "holds =",
            "hold =",
            r"claims.toml: claims.0: 'hold' is not known here; allowed are name",
        ),
        (
            "claims.toml",
            "place",
            "plase",
            "claims.toml: claims.0: 'plase' is not known here; allowed are name, qu",
        ),
    ],
)
def test_what_is_wrong_in_a_paper_is_said_with_its_place(folder, file, old, new, told):
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new))
    with pytest.raises(RegistryError, match=told) as error:
        read_paper(folder)
    assert str(error.value).endswith("Repair it; papers/cem is an example.")


ERRATUM = """
[[errata]]
table = 1
model = "Foot"
column = "fdm"
reason = "a slip"
"""
PLOT = """
[cost_by_faces]
models = 3
"""
PICTURE = """
[[pictures]]
figure = "Figure 1"
model = "Nose"
"""


@pytest.mark.parametrize(
    ("file", "more", "told"),
    [
        ("tables.toml", FILES["tables.toml"], "table 1 occurs twice"),
        ("tables.toml", ERRATUM, "errata: table 1 has no cell 'fdm' of 'Foot'"),
        (
            "claims.toml",
            "[[claims]]" + FILES["claims.toml"].partition("[[claims]]")[2],
            "claim 'quick': occurs twice",
        ),
        ("figures.toml", PLOT, "figures.toml: plots.cost_by_faces.models: input should be"),
        ("paper.toml", PICTURE, "model 'Nose': no printed table has it; known: Foot, Hand"),
    ],
)
def test_parts_of_a_paper_that_do_not_fit_are_said(folder, file, more, told):
    before = (folder / file).read_text() if (folder / file).exists() else ""
    (folder / file).write_text(before + more)
    with pytest.raises(RegistryError, match=told):
        read_paper(folder)


def test_checks_that_cannot_be_imported_are_said(folder):
    (folder / "checks.py").write_text("import no_such_module")
    paper = read_paper(folder)
    with pytest.raises(
        RegistryError, match=r"checks.py: cannot be imported: ModuleNotFoundError.*R"
    ):
        paper.functions()


def test_a_name_that_is_no_paper_is_said(tmp_path):
    with pytest.raises(RegistryError, match="'dem' is neither an installed paper nor a folder; in"):
        find_paper("dem")
    with pytest.raises(RegistryError, match=r"paper.toml of a paper cannot be read: No such file"):
        find_paper(str(tmp_path))


def test_an_entry_point_that_is_no_folder_is_said(monkeypatch):
    entry = EntryPoint("bad", "json.decoder", module.GROUP)
    monkeypatch.setattr(module, "entry_points", lambda **_: [entry])
    papers.cache_clear()
    try:
        with pytest.raises(RegistryError, match=r"bad = 'json.decoder' .* is not the package of a"):
            papers()
    finally:
        papers.cache_clear()
