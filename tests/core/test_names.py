import os
from pathlib import PurePosixPath, PureWindowsPath

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cembench.core.names import distinct_slugs, file_name, printable, slug
from cembench.results.records import Cell

HOSTILE = [
    *("a/b", "../x", "..", ".", "", "/etc/passwd", "a\\b", "c:x", "nul", "CON.txt", "com1", "x."),
    *(
        "x ",
        " x",
        ".hidden",
        "a\nb",
        "caf\udce9",
        "x" * 240,
        "ß" * 120,
        "*",
        "a?b",
        "\0",
        "-" * 300,
    ),
]
NAMES = st.one_of(st.text(), st.sampled_from(HOSTILE), st.text("./\\a~0", max_size=9))


@pytest.mark.parametrize(
    "name", ["face", "face (1)", "Ünï-code_2.5", "a,b=c+d", "direct-cem", "x~y"]
)
def test_ordinary_names_stay_as_they_are(name):
    assert file_name(name) == name


def test_labels_of_ordinary_names_are_those_of_earlier_runs():
    cell = Cell(algorithm="direct-cem", code_hash="c", mesh="face (1).v2", mesh_hash="abc")
    assert cell.label == f"face (1).v2--direct-cem--{cell.key[:12]}"


@given(NAMES)
def test_a_file_name_stays_in_its_folder_on_every_system(name):
    found = file_name(name, 60)
    assert 0 < len(found.encode()) <= 60
    for flavour in (PurePosixPath, PureWindowsPath):
        assert flavour(found).parts == (found,)
    assert found not in (".", "..")
    assert found.isprintable()
    assert not found.endswith((".", " "))
    assert file_name(name, 60) == found
    assert not os.path.isreserved(found) if hasattr(os.path, "isreserved") else True


@given(st.lists(NAMES, unique=True))
def test_different_names_give_different_files(names):
    assert len({file_name(name, 40) for name in names}) == len(names)


def test_a_name_made_to_look_like_a_cleaned_one_is_another():
    assert file_name(file_name("a/b")) != file_name("a/b")


@given(st.lists(NAMES, unique=True))
def test_slugs_are_distinct_and_bounded_without_regard_to_case(names):
    slugs = distinct_slugs({f"{k:08x}": name for k, name in enumerate(names)})
    assert len(set(slugs.values())) == len(names)
    assert all(len(one) <= 120 and one == slug(one, 120) for one in slugs.values())


def test_a_slug_made_to_look_like_another_is_told_apart():
    names = {"12345678": "a b", "87654321": "A-B", "0": "a-b-12345678"}
    assert len(set(distinct_slugs(names).values())) == 3


@given(st.text())
def test_what_is_printable_can_be_printed(name):
    assert printable(name).isprintable()
    assert printable(printable(name)) == printable(name)
