"""What a release consists of agrees with itself."""

import importlib.util
import json
import re
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
PAPER = (ROOT / "paper.md").read_text()
#: A remark of the paper: a file and what stands there.
QUOTE = re.compile(r"<!-- (\S+): (.+?) -->", re.DOTALL)


def ci(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / f".ci/{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def check():
    return ci("release_check")


def test_version_address_and_licence_are_told_once(check):
    assert check.texts() == []


def test_another_version_would_be_found(check, tmp_path, monkeypatch):
    for name in ("codemeta.json", "CITATION.cff", "CHANGELOG.md"):
        (tmp_path / name).write_text((ROOT / name).read_text())
    told = json.loads((ROOT / "codemeta.json").read_text()) | {"version": "9"}
    (tmp_path / "codemeta.json").write_text(json.dumps(told))
    (tmp_path / "CHANGELOG.md").write_text("# Changelog\n\n## 0.0.1\n")
    monkeypatch.setattr(check, "ROOT", tmp_path)
    version, heading = check.texts()
    assert version.startswith("codemeta.json has the version 9, pyproject.toml ")
    assert "begins with '## 0.0.1'" in heading


def test_the_tests_of_installed_packages_are_there(check):
    named = (*check.TESTS, *ci("test_matrix").SUBSET)
    assert [name for name in named if not (ROOT / name).is_file()] == []


@pytest.mark.slow
def test_the_default_installation_is_light_and_does_what_readme_says(check, tmp_path):
    wheel, _ = check.build(tmp_path)
    assert check.try_out(wheel, tmp_path)


@pytest.mark.slow
def test_the_lowest_versions_declared_pass_the_tests():
    assert ci("test_matrix").tests(sys.executable, lowest=True, whole=False)


def test_the_matrix_names_the_versions_that_are_declared():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    declared = re.findall(r":: (3\.\d+)", "\n".join(project["classifiers"]))
    matrix = ci("test_matrix")
    assert list(matrix.VERSIONS) == declared
    assert matrix.python_of("2.0") is None


def test_every_figure_of_the_paper_is_of_a_kept_record():
    quotes = QUOTE.findall(PAPER)
    assert len(quotes) > 6
    for file, words in quotes:
        assert " ".join(words.split()) in " ".join((ROOT / file).read_text().split()), words
    shown = PAPER.split("# What it shows")[1].split("# Limitations")[0]
    inside = set(re.findall(r"\d+(?:\.\d+)?", QUOTE.sub("", shown)))
    recorded = set(re.findall(r"\d+(?:\.\d+)?", " ".join(words for _, words in quotes)))
    recorded |= set(
        re.findall(r"(\d+) hold in part", (ROOT / "reports/paper/report.md").read_text())
    )
    assert inside <= recorded


def test_the_paper_is_short_and_its_sources_are_listed():
    text = QUOTE.sub("", PAPER.split("---", 2)[2])
    assert len(text.split()) < 1000
    listed = re.findall(r"@\w+\{(\w+),", (ROOT / "paper.bib").read_text())
    assert set(re.findall(r"\[@(\w+)\]", text)) == set(listed)
    for heading in ("Summary", "Statement of need", "State of the field", "References"):
        assert f"# {heading}\n" in text


def test_the_container_s_commands_are_those_of_readme():
    text = (ROOT / "Dockerfile").read_text()
    readme = (ROOT / "README.md").read_text()
    commands = ["make reproduce", "make test"]
    assert json.loads(text.split("CMD ")[1]) == commands[0].split()
    assert all(command in text and f"\n{command} " in readme for command in commands)
    copied = re.findall(r"^COPY (\S+) ", text, re.MULTILINE)
    assert all((ROOT / name).exists() for name in copied)


def test_pins_have_hashes_and_hold_the_versions_of_the_kept_reports():
    pins = (ROOT / "requirements/kept.txt").read_text()
    parts = re.split(r"\n(?=[a-z])", pins.split("\n", 2)[2])
    assert all("--hash=sha256:" in part for part in parts)
    kept = re.findall(r"^([\w-]+==[\d.]+)$", (ROOT / "requirements/kept.in").read_text(), re.M)
    assert len(kept) == 5
    assert all(f"{one} \\" in pins for one in kept)
    report = (ROOT / "reports/paper/report.md").read_text()
    assert all(one.replace("==", " ") in report for one in kept[:3])


@pytest.mark.parametrize("form", sorted((ROOT / ".github/ISSUE_TEMPLATE").glob("*.yml")))
def test_issue_forms_are_as_the_service_reads_them(form):
    parsed = yaml.safe_load(form.read_text())
    if form.name == "config.yml":
        assert parsed == {"blank_issues_enabled": True}
        return
    assert {"name", "description", "body"} <= parsed.keys()
    for part in parsed["body"]:
        assert part["type"] in ("textarea", "dropdown", "input")
        assert part["id"]
        assert part["attributes"]["label"]
