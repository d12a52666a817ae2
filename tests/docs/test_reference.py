"""Pages that list what the code has: nothing is missing, and nothing is there that is gone."""

import re
import sys
from importlib import import_module
from pathlib import Path

import pytest

import cembench
from cembench.core import errors, extras
from cembench.core.notices import NoticeKind
from cembench.mesh.defects import Defect, RepairLossError, UnusableMeshError
from cembench.mesh.uvs import OtherSurfaceError
from cembench.results.records import FaultKind
from cembench.running.external.exchange import ProgramFault

DOCS = Path(__file__).parents[2] / "docs"
CLASSES = {
    *(name for name, value in vars(errors).items() if isinstance(value, type)),
    *(one.__name__ for one in (extras.MissingExtra, ProgramFault)),
    *(one.__name__ for one in (OtherSurfaceError, RepairLossError, UnusableMeshError)),
}


def rows(heading):
    """The first column of the table below a heading of the page of errors."""
    page = (DOCS / "errors.md").read_text()
    section = page.split(f"## {heading}\n")[1].split("\n## ")[0]
    matches = re.findall(r"^\| (.+?) \| (.+?) \| (.+?) \|$", section, re.MULTILINE)
    assert len(matches) > 3
    return [first.strip("`") for first, *_ in matches[1:]]


@pytest.mark.parametrize(
    ("heading", "known"),
    [
        ("Exceptions", CLASSES),
        ("Faults of a cell", {*map(str, FaultKind)}),
        ("Notices", {*map(str, NoticeKind)}),
        ("Defects of a surface", {*map(str, Defect)}),
    ],
)
def test_the_page_of_errors_has_each_kind_once(heading, known):
    listed = rows(heading)
    assert sorted(listed) == sorted(known)


def test_every_class_of_errors_is_below_the_base():
    subclasses, found = [cembench.CembenchError], set()
    for one in subclasses:
        if one.__module__.startswith("cembench"):
            found.add(one.__name__)
        subclasses += one.__subclasses__()
    assert found <= CLASSES


def test_the_api_lists_every_public_name():
    page = (DOCS / "api.rst").read_text()
    listed = re.findall(r"^   (\w+)$", page, re.MULTILINE)
    assert set(listed) == {*cembench.__all__, *cembench._brought()} - {"__version__"}


def test_the_modules_listed_are_there_and_say_what_they_are():
    page = (DOCS / "modules.rst").read_text()
    listed = re.findall(r"^   (cembench\.[\w.]+)$", page, re.MULTILINE)
    assert len(listed) > 30
    for name in listed:
        assert import_module(name).__doc__, name


def test_the_page_of_the_commands_has_every_verb_and_option(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS / "_ext"))
    import cli_pages

    page, verbs = cli_pages.page(), cli_pages.commands()
    sections = dict(re.findall(r"^## cembench (\S+)\n(.*?)(?=^## |\Z)", page, re.DOTALL | re.M))
    assert set(sections) == set(verbs)
    for name, verb in verbs.items():
        for option in verb.params:
            for flag in option.opts if option.param_type_name == "option" else ():
                assert f"`{flag}" in sections[name], f"{flag} of {name}"
    assert "| `--uv unit\\|square\\|world\\|disk` |" in sections["map"]
    assert "$ cembench map left-hand" in sections["map"]
    assert "Default: `reuse`." in sections["run"]
    assert set(re.findall(r"`cembench ([a-z]+)", page)) <= set(verbs)
    sys.modules.pop("cli_pages")


def test_every_page_is_linked_from_a_list_of_pages():
    index = (DOCS / "index.md").read_text()
    listed = set(re.findall(r"^([\w/]+)$", index, re.MULTILINE))
    pages = {p.relative_to(DOCS).with_suffix("").as_posix() for p in DOCS.glob("*.md")}
    pages |= {p.relative_to(DOCS).with_suffix("").as_posix() for p in DOCS.glob("start/*.md")}
    assert pages - {"index", "cli", "history"} <= listed


def test_links_between_pages_lead_to_files():
    broken = []
    for page in [*DOCS.glob("*.md"), *DOCS.glob("start/*.md"), DOCS.parent / "README.md"]:
        for link in re.findall(r"\]\((?!https?:|#)(?:path:)?([^)#\s]+)", page.read_text()):
            made = link.startswith(("cli.md", "history.md", "gallery/", "../gallery/", "../cli.md"))
            if not made and not (page.parent / link).exists():
                broken.append(f"{page.name}: {link}")
    assert broken == []
