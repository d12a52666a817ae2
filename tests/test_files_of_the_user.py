"""Nothing that a user has is deleted or written over, whatever is named with -o."""

import io
import json
import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.holed_disk import holed_disk
from PIL import Image

from cembench.core.errors import RecordError
from cembench.drawing import painter
from cembench.mesh.files import read_mesh, write_mesh
from cembench.report import plots
from cembench.report.content import inspection
from cembench.results.merging import merge
from cembench.results.records import Outcome
from cembench.results.store import Store
from tests.limits import files_of_at_most, tree
from tests.records import record_on

pytestmark = pytest.mark.usefixtures("one_server")

DECOYS = {
    "thesis.txt": b"years of work",
    "scratch/thesis.txt": b"and its copy",
    ".draft-chapter": b"a draft of mine",
    f".draft-{'0' * 32}": b"a name as ours",
    "lock": b"a lock of mine",
    "plan.json": b'["my plan"]',
    "records/mine.json": b"{}",
    "records/thesis.txt": b"records of mine",
    "maps/world.npz": b"a map of mine",
    "samples/face--cem--0/blood.txt": b"a sample of mine",
    "exhibits/theory-flat/theory.png": b"a picture of mine",
    "figures/plot.png": b"a plot of mine",
    "quality/lock": b"of mine too",
    "contents.json": b'["thesis.txt", "index.html", "../beside.txt"]',
    "index.html": b"my page",
    "report.md": b"my report",
    "validation.json": b"{}",
    "rows.csv": b"my rows",
    "flat.png": b"my picture",
    "frame_000.ply": b"my frame",
    "datasets/notes.txt": b"about data",
    "surfaces/notes.txt": b"about surfaces",
}


@pytest.fixture(autouse=True)
def no_renderer(monkeypatch):
    """Pictures are grey, so that they take no time."""

    def grey(panel, colouring, folded=None):
        side = panel.raster.size // painter.SAMPLES
        return np.full((side, side, 3), 128, dtype=np.uint8)

    monkeypatch.setattr(painter, "paint", grey)


@pytest.fixture
def decoys(cli):
    """A folder of somebody, with files that have the names of ours, and one beside it."""
    folder = cli.folder / "mine"
    for name, content in DECOYS.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    (folder / "records/link.json").symlink_to("../thesis.txt")
    (cli.folder / "beside.txt").write_bytes(b"beside it")
    write_mesh(cli.folder / "flat.obj", flat_disk(60))
    write_mesh(cli.folder / "holed.obj", holed_disk(200))
    return folder


@pytest.fixture
def run(cli):
    """A run with one record."""
    return a_run(cli.folder / "run")


def a_run(folder, mesh=None, algorithm="harmonic-circle"):
    failed = Outcome(status="failed", cause="it did")
    record = record_on(mesh or flat_disk(60), algorithm, failed)
    Store(folder).save(record, None, {"id": "e"})
    return folder


#: Calls that name the folder of somebody, as arguments; `mine` is that folder.
REFUSED = [
    ("run", "--surfaces", "flat-disk", "-o", "mine"),
    ("run", "--surfaces", "flat-disk", "-o", "mine/records"),
    ("run", "--surfaces", "flat-disk", "-o", "mine", "--dry-run"),
    ("run", "--surfaces", "flat-disk", "-o", "mine/thesis.txt"),
    ("reproduce", "-o", "mine"),
    ("merge", "run", "-o", "mine"),
    ("merge", "run", "-o", "mine/scratch"),
    ("merge", "mine", "-o", "new"),
    ("report", "run", "-o", "mine"),
    ("report", "run", "-o", "mine/figures"),
    ("report", "run", "-o", "run"),
    ("report", "mine"),
    ("validate", "cem", "-o", "mine"),
    ("theory", "flat.obj", "--run", "mine"),
    ("holes", "holed.obj", "-o", "mine"),
    ("morph", "flat.obj", "flat.obj", "--run", "mine"),
    ("map", "flat.obj", "-o", "mine/flat.obj", "--preview"),
    ("map", "flat.obj", "-o", "flat.obj"),
    ("map", "flat.obj", "-o", "link.obj"),
    ("map", "flat.obj", "-o", "hard.obj"),
    ("export", "run", "-o", "run/records/x.csv"),
    ("export", "run", "-o", "mine"),
    ("export", "mine", "-o", "new.csv"),
    ("merge", "run", "run2", "-o", "run"),
    ("show", "x", "--run", "mine"),
    ("compare", "mine", "run"),
]


@pytest.mark.parametrize("call", REFUSED, ids=" ".join)
def test_a_folder_of_somebody_is_refused_and_nothing_is_changed(call, cli, decoys, run):
    a_run(cli.folder / "run2")
    (cli.folder / "link.obj").symlink_to("flat.obj")
    os.link(cli.folder / "flat.obj", cli.folder / "hard.obj")
    before = tree(cli.folder)
    code, out, err = cli(*call)
    assert code == 2, err
    assert "error: " in err
    assert "Traceback" not in err
    assert out == ""
    assert tree(cli.folder) == before


def test_verbs_that_read_change_nothing(cli, decoys, run):
    before = tree(cli.folder)
    for call in (
        ("status", "mine"),
        ("status", "run"),
        ("show", "flat-disk/harmonic-circle", "--run", "run"),
        ("list",),
        ("doctor",),
        ("fetch",),
    ):
        cli(*call)
        by_key = {p: c for p, c in tree(cli.folder).items() if p != Path("run/lock")}
        assert by_key == before, call


def test_new_files_beside_the_decoys_touch_none_of_them(cli, decoys, run, monkeypatch):
    monkeypatch.setenv("CEMBENCH_CACHE", str(decoys))
    before = tree(cli.folder)
    for call in (
        ("map", "flat.obj", "-a", "harmonic-circle", "-o", "mine/new.obj"),
        ("export", "run", "-o", "mine/new.csv"),
        ("morph", "flat.obj", "flat.obj", "--frames", "2", "-o", "mine/new.npz"),
        ("merge", "run", "-o", "mine/merged"),
        ("run", "--mesh", "flat.obj", "-a", "harmonic-circle", "--repeats", "1", "-o", "mine/run"),
        ("theory", "flat.obj", "--iterations", "20", "-o", "mine/run"),
    ):
        code, _, err = cli(*call)
        assert code == 0, err
    after = tree(cli.folder)
    assert {path: after.get(path) for path in before} == before
    new = {path.parts[:2] for path in set(after) - set(before)}
    assert new == {("mine", name) for name in ("new.obj", "new.csv", "new.npz", "merged", "run")}


def test_force_writes_over_the_input_and_a_picture_of_somebody(cli, decoys):
    os.link(cli.folder / "flat.obj", cli.folder / "hard.obj")
    (cli.folder / "flat.png").write_bytes(b"mine")
    before = (cli.folder / "hard.obj").read_bytes()
    call = ("map", "flat.obj", "-a", "harmonic-circle", "-o", "flat.obj", "--preview")
    assert cli(*call)[0] == 2
    code, out, _ = cli(*call, "--force")
    assert code == 0
    assert "output     flat.obj" in out
    assert b"\nvt " in (cli.folder / "flat.obj").read_bytes()
    assert (cli.folder / "hard.obj").read_bytes() == before
    with Image.open(cli.folder / "flat.png") as picture:
        assert picture.info["Software"] == "cembench"


def test_a_preview_replaces_its_own_picture_and_no_other(cli):
    write_mesh(cli.folder / "v1.2.obj", flat_disk(60))
    call = ("map", "v1.2.obj", "-a", "harmonic-circle", "--preview")
    for _ in range(2):
        assert cli(*call)[0] == 0
    place = cli.folder / "v1.2_harmonic-circle.png"
    Image.new("RGB", (4, 4)).save(place)
    before = place.read_bytes()
    code, _, err = cli(*call)
    assert code == 2
    assert "is not a picture that this version of cembench made. Move it away" in err
    assert place.read_bytes() == before


def test_a_morph_does_not_number_its_frames_over_its_surfaces(cli):
    write_mesh(cli.folder / "a_001.obj", flat_disk(60))
    before = tree(cli.folder)
    code, _, err = cli("morph", "a_001.obj", "a_001.obj", "-o", "a.obj", "--frames", "3")
    assert code == 2
    assert "the output a_001.obj is the input a_001.obj" in err
    assert tree(cli.folder) == before


# Runs


def test_a_run_is_resumed_and_keeps_what_else_lies_there(cli, run):
    (run / "notes.txt").write_text("mine")
    (run / "scratch").mkdir()
    (run / "scratch/thesis.txt").write_text("mine")
    (run / ".draft-chapter").write_text("mine")
    before = tree(run)
    with Store(run).locked() as scratch:
        assert scratch.parent == run
        assert scratch.name not in ("scratch", "scratch-")
    after = tree(run)
    assert set(after) - set(before) <= {Path("lock")}
    assert {path: after[path] for path in before} == before
    assert json.loads((run / "cembench.json").read_text())["kind"] == "run"
    assert len(Store(run).records()) == 1


@pytest.mark.parametrize("what", ["records", "maps", "samples", "lock", "plan.json", "exhibits"])
@pytest.mark.parametrize("kind", ["link", "dangling", "other"])
@pytest.mark.parametrize("marked", [False, True])
def test_a_name_of_ours_that_is_something_else_is_refused(what, kind, marked, tmp_path):
    folder = tmp_path / "run"
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "thesis.txt").write_text("mine")
    if marked:
        with Store(folder).locked():
            pass
        (folder / "lock").unlink(missing_ok=True)
    folder.mkdir(exist_ok=True)
    if kind == "link":
        (folder / what).symlink_to(elsewhere)
    elif kind == "dangling":
        (folder / what).symlink_to("nowhere")
    elif what in ("lock", "plan.json"):
        (folder / what).mkdir()
    else:
        (folder / what).write_text("mine")
    before = tree(tmp_path)
    with pytest.raises(RecordError), Store(folder).locked():
        pass
    assert tree(tmp_path) == before


def test_a_link_named_as_the_scratch_folder_is_an_error_and_not_followed(tmp_path):
    with Store(tmp_path / "run").locked() as scratch:
        pass
    (tmp_path / "thesis.txt").write_text("mine")
    scratch.symlink_to(tmp_path)
    with pytest.raises(RecordError, match="cannot be written"), Store(tmp_path / "run").locked():
        pass
    assert (tmp_path / "thesis.txt").read_text() == "mine"


@pytest.mark.parametrize(
    "marker",
    [
        "",
        "{}",
        '{"kind": "run"}',
        '{"project": "cembench", "kind": "report"}',
        '{"project": "cembench", "kind": "run", "token": "../x"}',
        '{"project": "cembench", "kind": "run", "schema_version": 1}',
        '{"project": "other", "kind": "run", "token": "%s"}' % ("0" * 32),
        '{"project": "cembench", "kind": "run", "schema_version": 2, "token": "%s"}' % ("0" * 32),
    ],
)
def test_a_marker_that_is_not_ours_makes_no_run(marker, tmp_path):
    (tmp_path / "cembench.json").write_text(marker)
    before = tree(tmp_path)
    with pytest.raises(RecordError, match="Nothing was changed"), Store(tmp_path).locked():
        pass
    assert tree(tmp_path) == before


# Names


HOSTILE = ["a/b", "../x", "../../x", "/tmp/x", "x" * 240, "caf\udce9", "nul", "a\nb", "..", "Ünï"]


@pytest.mark.parametrize("name", HOSTILE)
def test_any_name_of_an_algorithm_or_mesh_is_kept_inside_and_found_again(name, tmp_path):
    mesh = replace(flat_disk(60), name=name)
    run = a_run(tmp_path / "up/run", mesh, name)
    outside = [p for p in tmp_path.rglob("*") if p.is_file() and not p.is_relative_to(run)]
    assert outside == []
    store = Store(run)
    (record,) = store.records()
    assert store.find(record.cell) == record
    store.save(record, np.ones(3, complex), {"id": "e"})
    assert store.uv(record.cell) is not None
    store.samples(record.cell, name).save_check(record.outcome, None)
    assert store.rounds_done(record.cell) == 0
    assert merge([store], Store(tmp_path / "up/all")).cells == 1
    assert len(Store(tmp_path / "up/all").records()) == 1
    assert {p.name for p in tmp_path.iterdir()} == {"up"}
    assert {p.name for p in (tmp_path / "up").iterdir()} == {"run", "all"}


@pytest.mark.usefixtures("quick_drawing")
def test_a_record_from_elsewhere_with_hostile_content_stays_inside(cli, run):
    (path,) = (run / "records").iterdir()
    record = json.loads(path.read_text())
    record["cell"] |= {"mesh": "../../../out", "algorithm": "../../../out"}
    record["cell"]["mesh_hash"] = record["environment"] = record["title"] = "../../../out"
    path.write_text(json.dumps(record))
    before = tree(cli.folder)
    for call, expected in (
        (("merge", "run", "-o", "new"), 2),
        (("report", "run", "-o", "page"), 2),
        (("status", "run"), 1),
    ):
        code, _, err = cli(*call)
        assert code == expected, call
        assert path.name in err
    after = tree(cli.folder)
    assert {p.parts[0] for p in set(after) - set(before)} <= {"new", "page"}
    assert {p: after[p] for p in before} == before
    assert {path.name for path in cli.folder.parent.iterdir()} == {cli.folder.name}


def test_an_algorithm_of_any_name_is_measured_and_shown(cli, monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    monkeypatch.delenv("PYTHONDONTWRITEBYTECODE", raising=False)
    name = "../x/y"
    (cli.folder / "mine.py").write_text(PLUGIN.replace("NAME", name))
    write_mesh(cli.folder / f"{'m' * 240}.obj", flat_disk(60))
    call = ("--plugin", "mine.py", "-a", name)
    mesh = f"{'m' * 240}.obj"
    code, out, err = cli("run", "--mesh", mesh, *call, "--repeats", "1", "--json")
    assert code == 0, err
    assert [row["algorithm"] for row in json.loads(out)] == [name]
    assert len(list((cli.folder / "results/run/records").iterdir())) == 1
    assert "1  ok" in cli("status")[1]
    code, _, err = cli("map", mesh, *call, "--preview")
    assert code == 0, err
    names = {path.name for path in cli.folder.iterdir()}
    assert len(names) == 4
    assert {"results", "mine.py", mesh} < names


PLUGIN = """
from cembench import DiskMesh, Parameterization, algorithm
from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian

@algorithm("NAME", title="Mine", target="disk")
def mine(mesh: DiskMesh) -> Parameterization:
    f_b = arc_length_circle(mesh)
    return Parameterization(harmonic_extension(laplacian(mesh), mesh.boundary, f_b))
"""


def test_a_file_whose_name_is_not_text_is_mapped_and_recorded(cli):
    mesh = Path(os.fsdecode(b"caf\xe9.obj"))
    write_mesh(cli.folder / mesh, flat_disk(60))
    assert read_mesh(cli.folder / mesh).name == r"caf\udce9"
    output = os.fsdecode(b"\xe9.obj")
    code, out, err = cli("map", str(mesh), "-a", "harmonic-circle", "-o", output)
    assert code == 0, err
    assert r"\udce9.obj" in out
    assert (cli.folder / output).is_file()
    code, _, err = cli("theory", str(mesh), "--iterations", "20")
    assert code == 0, err


@pytest.fixture
def quick_drawing(monkeypatch):
    png = io.BytesIO()
    Image.new("RGB", (2, 2)).save(png, "PNG")
    forms = {"png": png.getvalue(), "svg": b"<svg xmlns='http://www.w3.org/2000/svg'/>", "pdf": b""}
    monkeypatch.setattr(plots, "_drawn", lambda plot: forms)
    monkeypatch.setattr(inspection, "SIDE", 16)


def test_names_that_differ_in_case_or_signs_alone_get_pages_of_their_own(cli, quick_drawing):
    for k, name in enumerate(("Face", "face", "face-", "F" * 240, "F" * 241)):
        mesh = flat_disk(60)
        a_run(cli.folder / "run", replace(mesh, V=(k + 1) * mesh.V, name=name))
    code, _, err = cli("report", "run")
    assert code == 0, err
    pages = list((cli.folder / "run/report/pages").iterdir())
    assert len({page.name.lower() for page in pages}) == 5


# Reports


@pytest.mark.usefixtures("quick_drawing")
def test_a_report_leaves_what_was_changed_and_refuses_what_is_in_its_way(cli, run):
    assert cli("report", "run", "-o", "out")[0] == 0
    out = cli.folder / "out"
    assert cli("report", "run", "-o", "out")[0] == 0
    (out / "notes.txt").write_text("mine")
    (out / "report.md").write_text("my words")
    before = tree(cli.folder)
    code, _, err = cli("report", "run", "-o", "out")
    assert code == 2
    assert "report.md. Nothing was changed." in err
    assert tree(cli.folder) == before
    (out / "report.md").unlink()
    assert cli("report", "run", "-o", "out")[0] == 0
    assert (out / "notes.txt").read_text() == "mine"


@pytest.mark.usefixtures("quick_drawing")
def test_a_report_does_not_follow_a_link_out_of_its_folder(cli, run):
    assert cli("report", "run", "-o", "out")[0] == 0
    tables = cli.folder / "out/tables"
    tables.rename(cli.folder / "elsewhere")
    tables.symlink_to(cli.folder / "elsewhere")
    before = tree(cli.folder)
    assert cli("report", "run", "-o", "out")[0] == 2
    assert tree(cli.folder) == before


@pytest.mark.usefixtures("quick_drawing")
def test_a_report_cut_short_while_it_is_moved_is_completed(cli, run, monkeypatch):
    assert cli("report", "run", "-o", "out")[0] == 0
    renamed, moved = Path.replace, []

    def breaks(path, target):
        if "out/" in str(target) and ".json" not in str(target):
            moved.append(target)
            if len(moved) == 3:
                raise KeyboardInterrupt
        return renamed(path, target)

    Store(run).save_plan([])
    a_run(run, flat_disk(90))  # another report than before
    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", breaks)
        assert cli("report", "run", "-o", "out")[0] != 0
    assert len(moved) == 3
    code, _, err = cli("report", "run", "-o", "out")
    assert code == 0, err


# Full disks


def test_a_map_on_a_full_disk_leaves_the_older_file_and_says_so(cli):
    mesh = flat_disk(600)
    write_mesh(cli.folder / "a.obj", mesh)
    (cli.folder / "old.obj").write_text("older")
    (cli.folder / "old.png").write_text("older")
    before = tree(cli.folder)
    call = ("map", "a.obj", "-a", "harmonic-circle", "-o", "old.obj")
    with files_of_at_most(25_000):
        code, out, err = cli(*call)
    assert code == 2
    assert "old.obj cannot be written: File too large" in err
    assert "old.obj" not in out
    assert tree(cli.folder) == before


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb", ".vtp", ".npz", ".off", ".stl"])
@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 0.999])
def test_a_mesh_on_a_full_disk_is_whole_or_as_before(suffix, share, tmp_path):
    mesh = flat_disk(600)
    uv = mesh.V[:, 0] + 1j * mesh.V[:, 1] if suffix not in (".off", ".stl") else None
    path = tmp_path / f"a{suffix}"
    write_mesh(path, mesh, uv)
    whole = path.read_bytes()
    path.write_bytes(b"older")
    with files_of_at_most(int(share * len(whole))), pytest.raises(Exception, match="cannot be wri"):
        write_mesh(path, mesh, uv)
    assert tree(tmp_path) == {Path(path.name): b"older"}
    with files_of_at_most(len(whole)):
        write_mesh(path, mesh, uv)
    assert path.read_bytes() == whole


@pytest.mark.usefixtures("quick_drawing")
def test_other_verbs_on_a_full_disk_end_with_a_message_and_keep_what_was_there(cli, decoys, run):
    assert cli("report", "run", "-o", "out")[0] == 0
    for name in ("old.parquet", "old.npz"):
        (cli.folder / name).write_text("older")
    before = tree(cli.folder)
    for call in (
        ("export", "run", "-o", "old.parquet", "--format", "parquet"),
        ("report", "run", "-o", "out"),
        ("morph", "flat.obj", "flat.obj", "-o", "old.npz"),
    ):
        assert_full(cli, call, 6_000)
    assert tree(cli.folder) == before


@pytest.mark.slow
def test_verbs_that_draw_on_a_full_disk_end_with_a_message_and_keep_what_was_there(cli, decoys):
    shown = ("theory", "flat.obj", "--iterations", "20", "-o", "shown")
    assert cli(*shown)[0] == 0
    before = tree(cli.folder)
    for call in (
        shown,
        ("holes", "holed.obj", "-o", "shown"),
        ("map", "flat.obj", "-a", "harmonic-circle", "--preview"),
    ):
        assert_full(cli, call, 6_000)
    after = tree(cli.folder)
    assert {path: after.get(path) for path in before} == before
    assert not [path for path in set(after) - set(before) if after[path] is not None]


def assert_full(cli, call, size):
    with files_of_at_most(size):
        code, _, err = cli(*call)
    assert code == 2, (call, err)
    assert "cannot be written" in err
    assert "Traceback" not in err
