"""What is older than its code is told, and what cannot have changed a figure does not count."""

import json

import pytest

from benchmarks import __main__ as runner
from benchmarks import origins, stale
from benchmarks.origins import changed, hashes, plain
from benchmarks.pages import ROOT, Section

TREE = {
    "benchmarks/study.py": "from cembench.registry import load_registry\n",
    "benchmarks/reader.py": "import csv\nfrom cembench.results.records import Record\n",
    "cembench/registry.py": "from cembench.core import names\n",
    "cembench/core/names.py": "",
    "cembench/core/__init__.py": "",
    "cembench/results/records.py": "class Record: ...\n",
    "cembench/conformal/metrics.py": "def angles(): return 1\n",
    "algorithms/cem.py": "from .parts import step\nfrom cembench.conformal.metrics import angles\n",
    "algorithms/parts.py": "def step():\n    return 1\n",
    "algorithms/__init__.py": "",
}
NOW = hashes(TREE, "benchmarks/study.py")


def about(start="benchmarks/study.py"):
    return {"start": start, "hashes": hashes(TREE, start)}


@pytest.mark.parametrize(
    ("file", "text", "told"),
    [
        ("algorithms/parts.py", "def step():\n    return 2\n", ["algorithms"]),
        ("cembench/conformal/metrics.py", "def angles(): return 2\n", ["metrics"]),
        ("benchmarks/study.py", TREE["benchmarks/study.py"] + "x = 1\n", ["the study"]),
        ("algorithms/parts.py", '"""New."""\n\ndef step():\n    # why\n    return 1\n', []),
        ("cembench/core/names.py", "x = 1\n", []),
        ("cembench/results/records.py", "x = 1\n", []),
    ],
)
def test_code_that_a_figure_depends_on_is_named_where_it_changed(file, text, told):
    assert changed(about(), TREE | {file: text}) == told


def test_what_reads_records_does_not_depend_on_algorithms():
    started = about("benchmarks/reader.py")
    assert set(started["hashes"]) == {"harness", "the study"}
    assert changed(started, TREE | {"algorithms/parts.py": "x = 1\n"}) == []
    assert changed(started, TREE | {"cembench/results/records.py": "x = 1\n"}) == ["harness"]


def test_statistics_of_reports_count_only_where_a_study_imports_them():
    families = "cembench/results/families.py"
    reader = "import cembench.results.families\n" + TREE["benchmarks/reader.py"]
    tree = TREE | {families: "x = 1\n", "benchmarks/reader.py": reader}
    tree |= {"cembench/results/records.py": "import cembench.results.families\n"}
    tree |= {"benchmarks/study.py": "import cembench.results.records\n"}
    for start, told in (
        ("benchmarks/reader.py", ["statistics over surfaces"]),
        ("benchmarks/study.py", []),
    ):
        then = {"start": start, "hashes": hashes(tree, start)}
        assert changed(then, tree | {families: "x = 2\n"}) == told


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ('x = "# no comment"  # one\n\n\ny = 2\n', "x = '# no comment'\ny = (2)", True),
        ('x = "# no comment"', 'x = "# another"', False),
        ('"""Two."""\ndef f(): return 1', 'def f():\n    """One."""\n    return 1', True),
        ("def f(a):\n    b = a\n    return b", "def f(a):\n    c = a\n    return c", True),
        ("def f(a):\n    return a", "def f(b):\n    return b", False),  # callers name it
        ("def f(a):\n    b = c\n    return b", "def f(a):\n    c = c\n    return c", False),
        ("x = 1", "y = 1", False),
        ("def f():\n    a = b = 1\n    return a", "def f():\n    a = b = 1\n    return b", False),
        ("import a\ndef f():\n    return a", "def f():\n    import a\n    return a", True),
        ("from a import b", "from c import b", False),
        ("def f():\n    global a\n    a = 1", "def f():\n    global b\n    b = 1", False),
    ],
)
def test_what_code_does_is_compared_and_not_how_it_is_written(one, other, same):
    assert (plain(one) == plain(other)) == same


def test_a_new_algorithm_counts_and_what_has_no_hashes_is_unknown():
    assert changed(about(), TREE | {"algorithms/another.py": "x = 1\n"}) == ["algorithms"]
    assert changed({"start": "gone.py", "hashes": {}}, TREE) == [
        "unknown: made before hashes were recorded"
    ]


def test_the_state_of_each_kept_report_and_table_is_listed_with_its_date():
    page, known = (ROOT / stale.PAGE).read_text(), origins.origins()
    made = [*stale.kept_reports(), *stale.made_tables()]
    assert len(made) > 15
    for what in made:
        if not what.endswith(stale.OF_RECORDS):
            (line,) = [one for one in page.splitlines() if one.startswith(f"| {what} |")]
            assert known[what]["commit"] in line
            assert known[what]["date"] in line


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """One page with one table, filled by a study."""
    monkeypatch.setattr(origins, "FILE", tmp_path / "origins.json")
    monkeypatch.setattr(stale, "kept_reports", list)
    monkeypatch.setattr(stale, "made_tables", lambda: ["docs/a.md growth"])
    return tmp_path


def test_the_runner_writes_down_what_it_filled_and_the_check_tells(repository, monkeypatch, capsys):
    with pytest.raises(SystemExit, match="1 of 1 are older"):
        stale.stale(check=True)

    class Filled(Section):
        def write(self, study):
            assert study == "growth"

    module = type("growth", (), {"growth": staticmethod(lambda: Filled(["x"], page="docs/a.md"))})
    monkeypatch.setattr(runner, "import_module", lambda name: module)
    runner.main(["growth", "--write-docs"])
    (held,) = json.loads((repository / "origins.json").read_text()).values()
    assert held["command"] == "python -m benchmarks growth --write-docs"
    assert held["seconds"] == 0
    assert held["hashes"]
    stale.stale(check=True)
    capsys.readouterr()
    now = origins.working_tree()
    changed_tree = now | {"algorithms/cem.py": now["algorithms/cem.py"] + "x = 1\n"}
    monkeypatch.setattr(stale, "working_tree", lambda: changed_tree)
    with pytest.raises(SystemExit, match="1 of 1"):
        stale.stale(check=True)
    assert "docs/a.md growth: changed since" in capsys.readouterr().out
    stale.stale(refresh=True)
    assert "python -m benchmarks growth --write-docs" in capsys.readouterr().out
