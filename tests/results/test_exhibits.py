import pytest
from pydantic import ValidationError

from cembench.core.errors import RecordError
from cembench.results.exhibits import (
    Exhibit,
    ExhibitPicture,
    ExhibitTable,
    copy_exhibits,
    exhibit_folder,
    read_exhibits,
    write_exhibit,
)


def exhibit(name="koebe"):
    return Exhibit(
        name=name,
        title="Steps of Koebe's method",
        text="What happens.",
        command="cembench holes",
        origin="surface",
        pictures=(ExhibitPicture(file="steps.png", caption="Steps"),),
        facts={"sweeps": 1},
    )


def test_an_exhibit_comes_back_as_it_was_written(tmp_path):
    (exhibit_folder(tmp_path, "koebe") / "steps.png").write_bytes(b"png")
    write_exhibit(tmp_path, exhibit())
    assert read_exhibits(tmp_path) == [exhibit()]


def test_a_run_without_exhibits_has_none(tmp_path):
    assert read_exhibits(tmp_path) == []


def test_a_picture_that_is_not_there_is_an_error_and_nothing_is_described(tmp_path):
    with pytest.raises(RecordError, match=r"steps\.png"):
        write_exhibit(tmp_path, exhibit())
    assert read_exhibits(tmp_path) == []


def test_a_damaged_description_is_named(tmp_path):
    (exhibit_folder(tmp_path, "koebe") / "exhibit.json").write_text("{")
    with pytest.raises(RecordError, match=r"exhibit\.json"):
        read_exhibits(tmp_path)


def test_a_row_has_a_value_for_each_column():
    with pytest.raises(ValidationError, match="a row does not have 2 values"):
        ExhibitTable(title="steps", columns=("step", "off"), rows=((1, 0.1), (None,)))


def test_exhibits_are_copied_with_their_pictures_and_numbered_where_names_meet(tmp_path):
    first, second, into = (tmp_path / name for name in ("first", "second", "into"))
    other = exhibit().model_copy(update={"text": "Something else."})
    for run, one in ((first, exhibit()), (second, other)):
        (exhibit_folder(run, "koebe") / "steps.png").write_bytes(run.name.encode())
        write_exhibit(run, one)
    for _ in range(2):  # the second time nothing is new
        for run in (first, second, first):
            copy_exhibits(run, into)
    names = {"name": "koebe-2", "title": "Steps of Koebe's method (2)"}
    numbered = other.model_copy(update=names)
    assert read_exhibits(into) == [exhibit(), numbered]
    pictures = [into / "exhibits" / name / "steps.png" for name in ("koebe", "koebe-2")]
    assert [picture.read_bytes() for picture in pictures] == [b"first", b"second"]
    (first / "exhibits/koebe/steps.png").unlink()
    copy_exhibits(first, tmp_path / "third")  # the report says that the picture is gone
    assert read_exhibits(tmp_path / "third") == [exhibit()]


def test_lists_without_pictures_become_one(tmp_path):
    def listed(run, *rows):
        table = ExhibitTable(title="Surfaces", columns=("surface", "vertices"), rows=rows)
        about = {"text": f"{run}: {len(rows)} surfaces.", "command": f"cembench run {run}"}
        one = exhibit("set").model_copy(update={"pictures": (), "tables": (table,), **about})
        write_exhibit(tmp_path / run, one)
        return tmp_path / run

    runs = listed("a", ("face", 9), ("head", 8)), listed("b", ("head", 8), ("hand", 7))
    for run in (*runs, *runs):  # the second time nothing is new
        copy_exhibits(run, tmp_path / "into")
    (both,) = read_exhibits(tmp_path / "into")
    assert both.tables[0].rows == (("face", 9), ("head", 8), ("hand", 7))
    assert both.text == "a: 2 surfaces.\n\nb: 2 surfaces."
    assert both.command == "cembench run a; cembench run b"
    assert both.facts == {}
    kept = read_exhibits(runs[0])
    copy_exhibits(runs[0], tmp_path / "twice")
    copy_exhibits(runs[0], tmp_path / "twice")
    assert read_exhibits(tmp_path / "twice") == kept
    write_exhibit(runs[1], read_exhibits(runs[1])[0].model_copy(update={"origin": "stand-in"}))
    copy_exhibits(runs[1], tmp_path / "twice")  # a stand-in's figures do not go among others
    assert [one.name for one in read_exhibits(tmp_path / "twice")] == ["set", "set-2"]
