"""Docstrings open with a phrase, not a question; exported names have complete numpydoc sections."""

import ast
import importlib
import re
from pathlib import Path

import pytest

import cembench

ROOT = Path(__file__).parents[1]
#: The folders whose docstrings are looked at.
FOLDERS = ("algorithms", "cembench", "meshes_gen", "papers", "sharing", "textures")
#: Checks of numpydoc that are not made, and why.
LEFT_OUT = {
    "GL01": "the summary begins on the line of the quotes",
    "GL02": "a docstring with sections ends with an empty line",
    "GL03": "as GL02",
    "ES01": "a summary may say everything",
    "SA01": "most names have nothing to see also",
    "SS06": "a summary may go on for a second line",
}
#: Checks that one name may fail, and why.
EXCUSED = {
    "cembench.core.errors.DatasetError": {"EX01": "raised only where the network is needed"},
}
WITH_DOCSTRING = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


def questions(source):
    """The lines of docstrings whose summary, the first paragraph, ends in a question mark."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, WITH_DOCSTRING):
            summary = (ast.get_docstring(node) or "").split("\n\n")[0]
            if summary.rstrip().endswith("?"):
                yield getattr(node, "lineno", 1)


def documented_imports():
    """Every name that README or a page of docs/ tells people to import, with its module."""
    pattern = re.compile(r"^\s*from (cembench[\w.]*) import ([\w, ]+)", re.MULTILINE)
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        for module, names in pattern.findall(page.read_text()):
            yield from ((module, name.strip()) for name in names.split(","))


def public_names():
    """The full names of what `cembench` exports and pages import."""
    exported = {("cembench", name) for name in cembench.__all__ if name != "__version__"}
    for module, name in sorted(exported | set(documented_imports())):
        value = getattr(importlib.import_module(module), name)
        if value.__module__.startswith("cembench."):
            yield f"{value.__module__}.{value.__qualname__}"


PUBLIC = sorted(set(public_names()))


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_summary_is_a_question(folder):
    files = sorted((ROOT / folder).rglob("*.py"))
    asked = [f"{path}:{line}" for path in files for line in questions(path.read_text())]
    assert files
    assert asked == []


@pytest.mark.parametrize(
    "source",
    [
        '"""Which triangle is seen?"""',
        'def f():\n    """How long\n    does it take?\n\n    In seconds.\n    """',
        'class A:\n    def f(self):\n        """Is it so?"""',
    ],
)
def test_questions_are_found(source):
    assert list(questions(source))


@pytest.mark.parametrize(
    "source",
    [
        '"""Where does the time go? Phases of a timed call."""',
        'def f():\n    """Return the phases.\n\n    Why not?\n    """',
        "def f():\n    pass",
    ],
)
def test_other_summaries_are_no_questions(source):
    assert not list(questions(source))


def test_exported_and_documented_names_are_looked_at():
    """What is exported and what only pages import: one of each, so that neither is lost."""
    assert {"cembench.mesh.files.read_mesh", "cembench.core.errors.MeshError"} <= set(PUBLIC)
    assert "cembench.conformal.laplacian.laplacian" in PUBLIC
    assert EXCUSED.keys() <= set(PUBLIC)


@pytest.mark.parametrize("name", PUBLIC)
def test_public_names_have_numpydoc_sections(name):
    validate = pytest.importorskip("numpydoc.validate").validate
    wrong = {code: text for code, text in validate(name)["errors"] if code not in LEFT_OUT}
    excused = EXCUSED.get(name, {})
    assert {code: text for code, text in wrong.items() if code not in excused} == {}
    assert excused.keys() <= wrong.keys(), "an excuse that nothing needs any more"
