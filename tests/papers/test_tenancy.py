"""A paper is a tenant: nothing outside its folder names its models, tables or figures."""

import re
from pathlib import Path

import pytest

from cembench.results.papers import papers

ROOT = Path(__file__).parents[2]
ROOMS = ("cembench", "meshes_gen", "algorithms")
#: The equations of Section 5, where the CEM paper measures. Kernels cite those of its methods.
OF_RESULTS = ("33",)
#: Other people's meshes under their published titles ("Foot 44"), and where they come from.
EXCEPT = ("meshes_gen/real_meshes.tsv",)
SUFFIXES = {".py", ".toml", ".tsv", ".csv", ".html", ".css", ".js", ".md", ".tex"}


def pattern():
    """What names one of the papers' models, tables, figures, or equations of results."""
    models = "|".join(re.escape(model) for paper in papers().values() for model in paper.models)
    equations = "|".join(OF_RESULTS)
    return re.compile(
        rf"\b(?:{models}|(?:Tables?|Figures?|Figs?\.) ?\d+|Section 5|Eqs?\.? ?\(?(?:{equations}))\b"
    )


def named(text):
    return [match.group() for match in pattern().finditer(text)]


def files():
    found = (file for room in ROOMS for file in (ROOT / room).rglob("*"))
    return sorted(
        file
        for file in found
        if file.suffix in SUFFIXES and str(file.relative_to(ROOT)) not in EXCEPT
    )


def test_nothing_outside_a_paper_s_folder_names_what_is_the_paper_s():
    assert len(files()) > 300
    lines = [
        f"{file.relative_to(ROOT)}:{number}: {name}"
        for file in files()
        for number, line in enumerate(file.read_text().splitlines(), 1)
        for name in named(line)
    ]
    assert lines == []


@pytest.mark.parametrize(
    "text",
    ["on Knit Cap Man", '"Foot"', "as in Table 2", "Figure 13", "(Fig. 8)", "Eq. 33", "Eq. (33)"],
)
def test_such_a_name_would_be_found(text):
    assert len(named(text)) == 1


@pytest.mark.parametrize("text", ["Eq. 30", "Footer 3", "Theorem 1", "Eqs. 3, 4", "a table of 4"])
def test_other_names_are_no_paper_s(text):
    assert named(text) == []
