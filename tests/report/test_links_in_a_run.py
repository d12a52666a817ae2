"""A run folder from elsewhere: no link in it is followed, wherever it stands."""

import os
import shutil

import pytest

from cembench.core.errors import RecordError
from cembench.core.loading import open_file
from cembench.report.content.evidence import Evidence
from cembench.report.write_report import write_report
from cembench.results.exhibits import exhibit_folder, read_exhibits
from cembench.results.merging import merge, others_of
from cembench.results.records import Outcome
from cembench.results.run_folder import empty_scratch
from cembench.results.store import Store
from cembench.results.verify import Depth, sound_records
from cembench.running.cluster.state import ClusterState, read_state, save_state
from tests.report.small_run import cell, meshes

LINK = "is a symbolic link"


@pytest.fixture(scope="module")
def readable_run(small_run, tmp_path_factory):
    """A run of all kinds of files, which is read without complaint."""
    folder = tmp_path_factory.mktemp("readable") / "run"
    shutil.copytree(small_run, folder)
    store = Store(folder)
    samples = store.samples(cell("ldm", meshes()[""], "reuse"), "machine")
    samples.save_check(Outcome(status="ok"), None)
    save_state(folder, ClusterState(units=1))
    merge([store], Store(folder / "others" / "second"))
    read_all(folder)
    return folder


@pytest.fixture
def run(readable_run, tmp_path):
    return shutil.copytree(readable_run, tmp_path / "run")


def read_all(run):
    """Read everything that a verb reads of a run."""
    store = Store(run)
    for record in sound_records(store, Depth.everything):
        store.find(record.cell), store.uv(record.cell), store.mesh(record.cell)
    store.plan(), store.environments(), read_exhibits(run), read_state(run)
    planned = cell("ldm", meshes()[""], "reuse")
    store.rounds_done(planned), store.samples(planned, "machine").check()
    [other.records() for other in others_of(store)]


def replaced_by_link(path, elsewhere):
    """Move what is at a path elsewhere, and put a link to it in its place."""
    shutil.move(path, elsewhere)
    path.symlink_to(elsewhere)


KINDS = (
    "plan.json",
    "machines.json",
    "records",
    "maps",
    "meshes",
    "environments",
    "samples",
    "exhibits",
    "others",
    "records/*",
    "maps/*",
    "meshes/*",
    "environments/*",
    "samples/*",
    "samples/*/*",
    "exhibits/*",
    "exhibits/*/exhibit.json",
    "others/*",
    "others/*/records/*",
)


@pytest.mark.parametrize("pattern", KINDS)
def test_no_link_of_a_run_is_followed_whatever_it_leads_to(run, tmp_path, pattern):
    replaced_by_link(min(run.glob(pattern)), tmp_path / "elsewhere")
    with pytest.raises(RecordError, match=LINK):
        read_all(run)


def test_a_run_that_is_reached_by_a_link_is_read(run, tmp_path):
    (tmp_path / "link").symlink_to(run)
    read_all(tmp_path / "link")


def test_a_picture_that_is_a_link_is_not_copied_into_a_report(run, tmp_path, quick_drawing):
    picture = run / "exhibits" / "koebe" / "steps 1.jpg"
    replaced_by_link(picture, tmp_path / "private.jpg")
    with pytest.raises(RecordError, match=rf"steps 1\.jpg {LINK}.*delete the link"):
        write_report(run, tmp_path / "report", "cembench report run")
    assert not (tmp_path / "report").exists()


def test_a_picture_is_known_by_its_content_and_named_by_it(run, tmp_path, quick_drawing):
    picture = run / "exhibits" / "koebe" / "steps 1.jpg"
    description = picture.with_name("exhibit.json")
    picture.rename(picture.with_suffix(".html"))
    description.write_text(description.read_text().replace("steps 1.jpg", "steps 1.html"))
    write_report(run, tmp_path / "report", "cembench report run")
    assert (tmp_path / "report" / "figures" / "exhibit-koebe-steps-1.jpg").is_file()
    picture.with_suffix(".html").write_text("root:x:0:0:<script>alert()</script>")
    with pytest.raises(RecordError, match=r"steps 1\.html is not a picture"):
        write_report(run, tmp_path / "another", "cembench report run")


def test_a_run_writes_through_no_link(run, tmp_path):
    elsewhere = tmp_path / "elsewhere"
    store, planned = Store(run), cell("ldm", meshes()[""], "reuse")
    journal = store.samples(planned, "machine")
    replaced_by_link(journal.journal, elsewhere)
    before = elsewhere.read_bytes()
    with pytest.raises(RecordError, match=LINK):
        journal.save_check(Outcome(status="ok"), None)
    assert elsewhere.read_bytes() == before
    (tmp_path / "folder").mkdir()
    (run / "exhibits" / "morph").symlink_to(tmp_path / "folder")
    with pytest.raises(RecordError, match=LINK):
        exhibit_folder(run, "morph")
    draft = tmp_path / "folder" / f".draft-{'0' * 32}"
    draft.write_text("")
    empty_scratch(run)
    assert draft.exists()


def test_a_fifo_in_a_run_is_not_waited_for(run):
    (run / "cembench.json").unlink()
    (run / "plan.json").unlink()
    for record in (run / "records").iterdir():
        record.unlink()
    os.mkfifo(run / "records" / f"disk--cem--{'0' * 12}.json")
    os.mkfifo(run / "exhibits" / "koebe" / "steps 2.jpg")
    (run / "exhibits" / "koebe" / "exhibit.json").unlink()
    with pytest.raises(RecordError, match="not a regular file"):
        Evidence.of(run)


def test_a_link_that_is_made_after_the_look_is_not_followed_either(tmp_path, monkeypatch):
    (tmp_path / "private").write_text("private")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "plan.json").symlink_to(tmp_path / "private")
    (tmp_path / "run" / "records").symlink_to(tmp_path)
    monkeypatch.setattr("cembench.core.loading.check_no_link", lambda path, root: None)
    for name in ("plan.json", "records/private"):
        with pytest.raises(OSError, match=r"symbolic links|Not a directory"):
            open_file(tmp_path / "run" / name, tmp_path / "run")
