"""Records and maps that were edited by hand are found, and told by record."""

import json

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench.conformal.metrics import all_metrics
from cembench.core.errors import RecordError
from cembench.results.records import digest
from cembench.results.store import Store
from cembench.results.verify import Depth, Kind, different_metrics, sound_records, verify
from tests.report.small_run import ok, record


def write_pair(folder):
    """Two cells with their maps."""
    store, mesh = Store(folder), flat_disk(150, stretch=1.5)
    for algorithm in ("cem", "harmonic-circle"):
        outcome, uv = ok(algorithm, mesh, 1.0)
        store.save(record(algorithm, mesh, "", "reuse", outcome), uv, {"id": "machine"})
    store.save_mesh(mesh)
    return store


@pytest.fixture
def store(cli):
    return write_pair(cli.folder / "run")


def file_of(store, algorithm="cem"):
    (found,) = (store.folder / "records").glob(f"*--{algorithm}--*.json")
    return found


def edit(file, change, *, sign=False):
    """Change a record; `sign` it anew as one would who knows how."""
    content = json.loads(file.read_text())
    change(content)
    if sign:
        content["digest"] = digest(content)
    file.write_text(json.dumps(content))


def lower_energy(content):
    content["outcome"]["metrics"]["conformal_energy"] *= 0.99


def other_map(store, algorithm="cem"):
    file = (store.folder / "maps" / file_of(store, algorithm).name).with_suffix(".npz")
    uv = np.load(file)["uv"]
    np.savez(file, uv=uv * np.exp(1e-3 * uv.real))


def kinds(store, depth=Depth.everything):
    return {finding.kind for finding in verify(store, depth).findings}


def test_what_was_measured_agrees_with_itself(store):
    assert kinds(store) == set()
    assert len(sound_records(store, Depth.everything)) == 2


def test_an_edited_figure_is_found_by_the_digest_and_by_the_map(store):
    edit(file_of(store), lower_energy)
    assert kinds(store) == {Kind.digest, Kind.metrics}
    assert kinds(store, Depth.records) == {Kind.digest}
    with pytest.raises(RecordError, match=r"--cem--.*changed after it was written") as caught:
        sound_records(store, Depth.records)
    assert f"`cembench status {store.folder} --verify` compares" in str(caught.value)


def test_a_figure_edited_and_signed_anew_is_found_by_the_map(store):
    edit(file_of(store), lower_energy, sign=True)
    assert kinds(store) == {Kind.metrics}
    (finding,) = verify(store, Depth.everything).findings
    assert "conformal_energy" in str(finding)


def test_another_map_is_found(store):
    other_map(store)
    assert kinds(store) == {Kind.metrics}
    uv = store.uv(store.records()[0].cell)

    def name_the_old_map(content):
        content["outcome"]["uv_hash"] = "0" * 64

    edit(file_of(store), name_the_old_map, sign=True)
    assert uv is not None
    assert kinds(store) == {Kind.map}


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        (lambda c: c["cell"].update(algorithm="fdm"), Kind.file_name),
        (lambda c: c["cell"].update(threads=2), Kind.file_name),
        (lambda c: c["mesh"].update(faces=7), Kind.mesh),
        (lambda c: c["outcome"]["metrics"].update(flipped_triangles=3), Kind.status),
        (lambda c: c["outcome"].update(rounds=[{"calls": [0.0]}]), Kind.damaged),
        (lambda c: c["outcome"].update(rounds=[{"calls": []}]), Kind.damaged),
        (lambda c: c.update(environment="../../x"), Kind.damaged),
    ],
)
def test_content_that_cannot_be_is_found_even_if_signed(store, change, kind):
    edit(file_of(store), change, sign=True)
    assert kind in kinds(store)


def test_files_that_are_gone_are_told_only_when_all_is_verified(store, cli):
    (store.folder / "maps" / file_of(store, "harmonic-circle").name).with_suffix(".npz").unlink()
    assert kinds(store) == {Kind.not_kept}
    code, _, err = cli("status", "run")
    assert (code, err) == (0, "")
    code, _, err = cli("status", "run", "--verify")
    assert code == 0
    assert "cannot be recomputed" in err


def test_damaged_maps_and_surfaces_are_findings(store):
    for file in [*store.folder.glob("maps/*"), *store.folder.glob("meshes/*")]:
        content = file.read_bytes()
        file.write_bytes(content[:40])
        assert Kind.damaged in kinds(store)
        file.write_bytes(content)
    assert kinds(store) == set()


@pytest.mark.parametrize(
    ("verb", "code"),
    [
        (("status", "run"), 1),
        (("status", "run", "--json"), 1),
        (("show", "disk/cem", "--run", "run"), 2),
        (("compare", "run", "run"), 2),
        (("export", "run"), 2),
        (("merge", "run", "-o", "both"), 2),
        (("report", "run"), 2),
    ],
)
def test_no_verb_shows_an_edited_figure_as_if_it_were_measured(store, cli, verb, code):
    edit(file_of(store), lower_energy)
    found, out, err = cli(*verb)
    assert found == code
    assert "was changed after it was written" in err
    if "--json" in verb:
        assert {f["kind"] for f in json.loads(out)["findings"]} == {"digest", "metrics"}
    assert not (cli.folder / "both").exists()
    assert not (cli.folder / "run/report").exists()


def test_show_recomputes_the_figures_that_it_shows(store, cli):
    name = store.records()[0].cell.mesh
    other_map(store)
    code, out, err = cli("show", f"{name}/cem", "--run", "run")
    assert (code, "conformal energy" in out) == (1, True)
    assert "the map gives different figures" in err
    assert cli("show", f"{name}/harmonic-circle", "--run", "run")[0] == 0


def test_a_damaged_record_is_one_line_of_status(store, cli):
    store.save_plan([record.cell for record in store.records()])
    file_of(store).write_text("{")
    code, out, err = cli("status", "run")
    assert code == 1
    assert "     1  damaged" in out
    assert f"{file_of(store).name}: " in err


def test_a_run_does_not_go_on_from_an_edited_record(store):
    edit(file_of(store), lower_energy)
    records = {record.cell.algorithm: record for record in store.records()}
    assert store.find(records["harmonic-circle"].cell) == records["harmonic-circle"]
    for cell in (records["cem"].cell, records["cem"].cell.model_copy(update={"mesh": "other"})):
        with pytest.raises(RecordError, match="was changed after it was written"):
            store.find(cell)


def test_a_record_without_a_digest_is_refused_and_not_called_changed(store, cli):
    edit(file_of(store), lambda content: content.pop("digest"))
    cell = next(r.cell for r in store.records() if r.cell.algorithm == "cem")
    with pytest.raises(RecordError, match=r"--cem--.* has no digest") as caught:
        store.find(cell)
    assert "changed" not in str(caught.value)
    for command in (["status", "run"], ["export", "run"], ["show", "a/cem", "--run", "run"]):
        code, _, err = cli(*command)
        assert code
        assert "has no digest" in err
        assert "changed" not in err


def test_merge_into_a_run_that_was_edited_is_refused_and_changes_nothing(store, cli):
    write_pair(cli.folder / "other")
    edit(file_of(store), lower_energy)
    before = file_of(store).read_bytes()
    assert cli("merge", "other", "-o", "run")[0] == 2
    assert file_of(store).read_bytes() == before


def test_figures_agree_within_rounding_and_not_beyond():
    mesh = flat_disk(150)
    uv = ok("cem", mesh, 1.0)[1]
    figures = all_metrics(mesh, uv)
    assert different_metrics(figures, figures) == []
    turned = all_metrics(mesh, uv * np.exp(0.7j))  # the same map, other rounding
    assert different_metrics(figures, turned) == []
    for name in figures:
        changed = figures | {name: figures[name] + 1e-3 * (1 + figures[name])}
        assert different_metrics(changed, figures)
    assert different_metrics({}, figures) == []
    assert different_metrics({"dilatation_max": None}, figures)
    assert not different_metrics({"dilatation_max": None}, figures | {"dilatation_max": np.inf})


def test_a_sample_is_bounded_and_repeats_itself(store, monkeypatch):
    looked = []
    monkeypatch.setattr(
        "cembench.results.verify.verify_map",
        lambda store, file, record: looked.append(file.name) or [],
    )
    monkeypatch.setattr("cembench.results.verify.SAMPLE_TRIANGLES", 1)
    verify(store, Depth.sample)
    verify(store, Depth.sample)
    assert len(looked) == 2
    assert looked[0] == looked[1]
    verify(store, Depth.everything)
    assert len(looked) == 4
