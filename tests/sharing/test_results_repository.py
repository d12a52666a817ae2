"""The example of a repository of results, driven from submission to site."""

import json
import re
import shutil
import tempfile
import tracemalloc
import zipfile
from pathlib import Path

import pytest
from cembench.sharing import bundle, site
from cembench.sharing.leaderboard import leaderboard

import cembench
from cembench.core.errors import ParameterError, RecordError
from cembench.report.document import Report
from cembench.results.records import signed
from cembench.results.signing import signer
from tests.browser import open_browser
from tests.records import changed
from tests.results.simulated_machines import SECONDS, SURFACES, machine_run
from tests.sharing.workflow_steps import run_step, steps_of

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples/results_repository"
WORKFLOW = EXAMPLE / ".github/workflows/results.yml"


@pytest.fixture(scope="module")
def bundles(tmp_path_factory):
    """The bundles of ten machines, every other one with its maps."""
    folder = tmp_path_factory.mktemp("machines")
    for number in range(10):
        run = machine_run(folder / f"run-{number}", number).folder
        cembench.submit(run, folder / f"sent/node-{number}.zip", maps=number % 2 == 0)
    return folder / "sent"


def rewritten(source, target, change, *, forged=True):
    """A copy of a bundle with another content; its metadata names the new hashes if `forged`."""
    with zipfile.ZipFile(source) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    change(files)
    if forged:
        crate = json.loads(files[bundle.METADATA])
        for entity in crate["@graph"]:
            if entity["@type"] == "File":
                entity["sha256"] = bundle.hashlib.sha256(files[entity["@id"]]).hexdigest()
        files[bundle.METADATA] = json.dumps(crate).encode()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
    return target


def edit(**changes):
    """A change of the first record of a bundle, with a digest that fits if it is to fit."""

    def change(files):
        name = min(name for name in files if name.startswith("records/"))
        record = bundle.Record.model_validate_json(files[name])
        if "calls" in changes:
            record = changed(record, outcome={"rounds": record.outcome.rounds[:1]})
            files[name] = signed(changed(record, {"calls": [changes["calls"]]}))
        elif "schema" in changes:
            files[name] = signed(changed(record, schema_version=changes["schema"]))
        else:
            content = json.loads(files[name])
            content["outcome"]["metrics"]["angle_error_mean_deg"] = 0.1
            files[name] = json.dumps(content).encode()

    return change


def with_link(source, target):
    shutil.copy(source, target)
    link = zipfile.ZipInfo("maps/link.npz")
    link.create_system, link.external_attr = 3, 0o120777 << 16
    with zipfile.ZipFile(target, "a") as archive:
        archive.writestr(link, "/etc/passwd")


def test_the_example_accepts_two_bundles_and_refuses_four(bundles, tmp_path):
    repository = shutil.copytree(EXAMPLE, tmp_path / "repository")
    sent = repository / "submissions"
    for number in (1, 2):
        shutil.copy(bundles / f"node-{number}.zip", sent)
    rewritten(bundles / "node-3.zip", sent / "forged.zip", edit(), forged=True)
    rewritten(bundles / "node-3.zip", sent / "impossible.zip", edit(calls=(1e-9,)))
    rewritten(bundles / "node-3.zip", sent / "foreign.zip", edit(schema=99))
    with_link(bundles / "node-3.zip", sent / "link.zip")
    check = steps_of(WORKFLOW, "check")["Check"]
    code, said, summary = run_step(check, repository)
    assert code == 1, said
    by_name = dict(re.findall(r"^\| ([\w-]+) \| (accepted|refused) \|", summary, re.MULTILINE))
    assert by_name == {
        **{"node-1": "accepted", "node-2": "accepted"},
        **dict.fromkeys(("forged", "impossible", "foreign", "link"), "refused"),
    }
    assert "its digest differs" in summary
    assert "is less than the" in summary
    assert "schema version 99" in summary
    assert "is a link or not a regular file" in summary
    publish = steps_of(WORKFLOW, "publish")["Publish"]
    code, said, _ = run_step(publish, repository)
    assert code == 2
    assert "some bundles are refused" in said
    assert not (repository / "site").exists()
    for name in ("forged", "impossible", "foreign", "link"):
        (sent / f"{name}.zip").unlink()
    assert run_step(check, repository)[0] == 0


@pytest.mark.skipif(shutil.which("ssh-keygen") is None, reason="NOT CHECKED: no ssh-keygen")
def test_the_example_takes_its_signers_from_the_base_branch(bundles, tmp_path):
    repository = shutil.copytree(EXAMPLE, tmp_path / "repository")
    shutil.copy(bundles / "node-1.zip", repository / "submissions")
    steps = steps_of(WORKFLOW, "check")
    assert steps["Base branch"]["with"] == {"ref": "${{ github.base_ref || github.ref }}"} | {
        "path": "base"
    }
    (repository / "signers").write_text("whoever sends the pull request\n")
    assert run_step(steps["Check"], repository)[0] == 0
    (repository / "base").mkdir()
    (repository / "base/signers").write_text("ada@example.org ssh-ed25519 AAAA\n")
    code, _, summary = run_step(steps["Check"], repository)
    assert code == 1
    assert "is not signed" in summary


@pytest.mark.slow
def test_the_example_publishes_what_it_accepts(bundles, tmp_path):
    repository = shutil.copytree(EXAMPLE, tmp_path / "repository")
    for number in (1, 3):
        shutil.copy(bundles / f"node-{number}.zip", repository / "submissions")
    code, said, _ = run_step(steps_of(WORKFLOW, "publish")["Publish"], repository)
    assert code == 0, said
    assert (repository / "site/runs/node-3/index.html").stat().st_size > 100_000
    assert "node-1" in (repository / "site/leaderboard/index.html").read_text()


@pytest.fixture(scope="module")
def published(bundles, tmp_path_factory):
    """The site of ten bundles; the reports of single runs have tests of their own."""
    folder = tmp_path_factory.mktemp("site") / "site"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(site, "build_report", lambda e, f, command: Report(command, command, (), ()))
        with bundle.accepted(bundle.bundles_in(bundles)) as runs:
            site.write_site(runs, folder)
            entrants = [site.Entrant(run.name, site.Evidence.of(run)) for run in runs]
            return folder, leaderboard(entrants, "cembench publish")


def table_of(report, name):
    from cembench.report.document import Table, items_of

    return next(table for table in items_of(report, Table) if table.name == name)


def test_the_leaderboard_answers_its_questions_and_each_figure_names_its_record(published):
    _, report = published
    ranked = table_of(report, "ranked-disk")
    assert {row[0].text for row in ranked.rows} == {"CEM", "Direct CEM", "FDM", "LDM", "Harmonic"}
    place = {(column.group, column.title): k for k, column in enumerate(ranked.columns)}
    for row in ranked.rows:
        assert all(value.record in report.records for value in row[1:] if value.number)
        for title in ("median", "worst"):
            value = row[place["degrees", title]]
            assert value.number == report.records[value.record]["angle_error_mean_deg"]
    ratios = {row[0].text: row[place["at equal angles", "median"]].number for row in ranked.rows}
    assert ratios["Harmonic"] == 1
    assert ratios["FDM"] == pytest.approx(7.5, rel=0.25)
    success = table_of(report, "success-by-family")
    (fdm,) = [row for row in success.rows if row[0].text == "FDM"]
    assert fdm[-1].text == "93.3 % of 30"
    assert report.records[fdm[-1].record]["status"] == "failed"
    machines = table_of(report, "machines")
    assert len(machines.rows) == 10
    assert all(row[4].record in report.records for row in machines.rows if row[4].number)
    assert len(table_of(report, "every-cell").rows) == 10 * len(SECONDS) * len(SURFACES)


@pytest.mark.parametrize("width", [1280, 390])
def test_the_site_fits_and_a_number_opens_its_record(published, width):
    folder, _ = published
    with open_browser() as browser:
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        for page in ("index.html", "leaderboard/index.html"):
            browser.get((folder / page).as_uri())
            assert browser.execute_script("return document.documentElement.scrollWidth") <= width
        browser.execute_script("document.querySelector('#ranked-disk td a').click()")
        shown = "return document.querySelector('#record-shown')?.innerText"
        assert browser.execute_async_script(
            "const end = arguments[0], ask = () => { const one = document.querySelector("
            "'#record-shown'); one?.open ? end(one.innerText) : setTimeout(ask, 50) }; ask()"
        ).count("node-")
        assert "mean angle error" in browser.execute_script(shown)
        assert [m for m in browser.get_log("browser") if m["level"] == "SEVERE"] == []


CRATE = bundle.METADATA


def refused(path):
    (found,) = cembench.check_submissions(path)
    assert not found.accepted
    return found.faults[0]


def test_a_file_that_is_not_as_the_metadata_says_is_refused(bundles, tmp_path):
    def longer(files):
        files["environments/e3.json"] += b" "

    path = rewritten(bundles / "node-3.zip", tmp_path / "a.zip", longer, forged=False)
    assert "environments/e3.json does not have the SHA-256" in refused(path)

    def fewer(files):
        del files["environments/e3.json"]

    path = rewritten(bundles / "node-3.zip", tmp_path / "b.zip", fewer, forged=False)
    assert "environments/e3.json is missing" in refused(path)

    def more(files):
        files["environments/e4.json"] = b"{}"

    path = rewritten(bundles / "node-3.zip", tmp_path / "c.zip", more, forged=False)
    assert "environments/e4.json is not in ro-crate-metadata.json" in refused(path)

    def no_crate(files):
        files[bundle.METADATA] = b"[1"

    path = rewritten(bundles / "node-3.zip", tmp_path / "d.zip", no_crate, forged=False)
    assert "is not metadata of a bundle" in refused(path)
    path = rewritten(
        bundles / "node-3.zip", tmp_path / "e.zip", lambda files: files.pop(CRATE), forged=False
    )
    assert "e.zip is not metadata of a bundle: it is missing" in refused(path)


@pytest.mark.parametrize("name", [CRATE, "records/a.json", "signature"])
def test_a_small_bundle_whose_text_is_huge_is_refused_before_it_is_read(bundles, tmp_path, name):
    def longer(files):
        files[name] = files.get(name, b"") + b" " * 300_000_000

    path = rewritten(bundles / "node-3.zip", tmp_path / "a.zip", longer, forged=False)
    assert path.stat().st_size < 500_000
    tracemalloc.start()
    try:
        said = refused(path)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert f"{path} was not unpacked: its files have 300," in said
    assert "Ask its sender to pack it again" in said
    assert most < 20_000_000


def test_one_text_of_a_large_bundle_is_bounded_too(bundles, tmp_path, monkeypatch):
    monkeypatch.setattr(bundle, "MAX_TEXT", 1000)
    said = refused(bundles / "node-2.zip")
    assert "'records/" in said or f"'{CRATE}'" in said
    assert "bytes, of at most 1,000" in said


def test_what_is_wrong_with_a_bundle_names_it_and_no_folder_that_is_gone(bundles, tmp_path):
    def broken(files):
        files[min(name for name in files if name.startswith("records/"))] = b"{"

    for change in (broken, edit(schema=99)):
        path = rewritten(bundles / "node-3.zip", tmp_path / "a.zip", change)
        said = refused(path)
        assert tempfile.gettempdir() not in said.replace(str(path), "")
        assert "run again" not in said.lower()


def test_figures_that_are_not_of_the_maps_are_refused_with_right_digests(bundles, tmp_path):
    def better(files):
        name = min(name for name in files if name.startswith("records/"))
        record = bundle.Record.model_validate_json(files[name])
        metrics = record.outcome.metrics | {"angle_error_sd_deg": 0.5}
        files[name] = signed(changed(record, outcome={"metrics": metrics}))

    with_maps = rewritten(bundles / "node-2.zip", tmp_path / "a.zip", better)
    assert "the map gives different figures: angle_error_sd_deg" in refused(with_maps)
    without = rewritten(bundles / "node-3.zip", tmp_path / "b.zip", better)
    assert cembench.check_submissions(without)[0].accepted, "nothing to compare with"


@pytest.mark.parametrize(
    "name", ["../out.json", "/etc/out.json", "records/../../out.json", "records\\out.json", "a/b"]
)
def test_names_that_lead_elsewhere_are_refused_and_nothing_is_unpacked(tmp_path, name):
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(zipfile.ZipInfo(name), "x")
    before = set(tmp_path.rglob("*"))
    assert "is no name of a bundle's files" in refused(path)
    assert set(tmp_path.rglob("*")) == before


def test_bombs_and_twins_and_encryption_are_refused(tmp_path, monkeypatch):
    path = tmp_path / "a.zip"
    monkeypatch.setattr(bundle, "MAX_BYTES", 10_000)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("records/a.json", bytes(20_000))
    assert "its files have 20,000 bytes, of at most 10,000" in refused(path)
    monkeypatch.setattr(bundle, "MAX_FILES", 1)
    with zipfile.ZipFile(path, "w") as archive:
        for name in ("records/a.json", "records/b.json"):
            archive.writestr(name, "x")
    assert "it holds 2 files, of at most 1" in refused(path)
    monkeypatch.setattr(bundle, "MAX_FILES", 10)
    with zipfile.ZipFile(path, "w") as archive:
        for name in ("records/a.json", "records/A.json"):
            archive.writestr(name, "x")
    assert "'records/A.json' is there twice" in refused(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("records/a.json", "x")
    assert "encrypted, or compressed in an unusual way" in refused(path)


def test_a_bomb_within_an_archive_of_arrays_is_refused(bundles, tmp_path, monkeypatch):
    import io

    import numpy as np

    def zeros(files):
        name = min(name for name in files if name.startswith("maps/"))
        content = io.BytesIO()
        np.savez_compressed(content, uv=np.zeros(2_000_000, complex))
        files[name] = content.getvalue()

    path = rewritten(bundles / "node-2.zip", tmp_path / "a.zip", zeros)
    monkeypatch.setattr(bundle, "MAX_BYTES", 10_000_000)
    assert "declares 32,000,128 bytes, of at most 10,000,000" in refused(path)


def test_what_is_no_archive_is_refused(tmp_path):
    (tmp_path / "a.zip").write_bytes(b"PK nothing")
    assert "is not a bundle" in refused(tmp_path)
    with pytest.raises(RecordError, match="holds no bundle"):
        cembench.check_submissions(tmp_path / "nowhere")


@pytest.mark.parametrize(
    ("round_", "why"),
    [
        ({"kernel_seconds": None}, "has no time of the reference kernel"),
        ({"kernel_seconds": 1e-6}, "no machine takes 1e-06 s for the reference kernel"),
        ({"phases": {"solves": 9.0}}, "its phases take longer than its calls"),
        ({"cpu_seconds": 9.0}, "more CPU seconds than 8 hardware threads have"),
    ],
)
def test_times_that_cannot_be_are_not_packed(tmp_path, round_, why):
    run = machine_run(tmp_path / "run", 1, **round_).folder
    with pytest.raises(RecordError, match=f"(?s)was not packed.*{why}.*Measure these cells again"):
        cembench.submit(run, tmp_path / "a.zip")
    assert not (tmp_path / "a.zip").exists()


def test_a_machine_that_is_far_from_three_others_is_refused(bundles, tmp_path):
    folder = shutil.copytree(bundles, tmp_path / "sent")
    fast = rewritten(bundles / "node-3.zip", folder / "node-3.zip", edit(calls=(1e-4,)))
    by_name = {one.name: one for one in cembench.check_submissions(folder)}
    assert [name for name, one in by_name.items() if not one.accepted] == ["node-3"]
    assert "on 9 other machines" in by_name["node-3"].faults[0]
    assert cembench.check_submissions(fast)[0].accepted, "alone it may be true"


def test_the_metadata_is_a_crate_with_machine_versions_and_licences(bundles):
    with zipfile.ZipFile(bundles / "node-2.zip") as archive:
        crate = json.loads(archive.read(bundle.METADATA))
        names = set(archive.namelist()) - {bundle.METADATA}
    by_id = {entity["@id"]: entity for entity in crate["@graph"]}
    assert len(by_id) == len(crate["@graph"])
    assert by_id[bundle.METADATA]["conformsTo"]["@id"] == "https://w3id.org/ro/crate/1.1"
    root = by_id["./"]
    assert {"name", "description", "datePublished", "license", "hasPart"} <= set(root)
    assert {part["@id"] for part in root["hasPart"]} == names
    assert by_id[root["license"]["@id"]]["name"] == "CC-BY-4.0"
    tool = by_id["#environment-e2"]
    assert (tool["softwareVersion"], tool["identifier"]) == ("0.1.0", "2" * 40)
    assert tool["processorRequirements"] == "node-2: processor 2"
    surfaces = [one for key, one in by_id.items() if key.startswith("#surface-")]
    assert {one["name"]: one["license"]["@id"][-3:] for one in surfaces} == dict.fromkeys(
        SURFACES, "MIT"
    )
    with zipfile.ZipFile(bundles / "node-3.zip") as archive:
        assert not [name for name in archive.namelist() if name.startswith(("maps", "meshes"))]


@pytest.mark.parametrize("name", ["my-face", "catenoid-sheet"])
def test_surfaces_of_unknown_licence_are_not_sent(tmp_path, name):
    """Nor is a file that has the name of a generated surface."""
    run = machine_run(tmp_path / "run", 1, mesh=name)
    for licence, sent in ((None, 0), ("CC0-1.0", 1)):
        path = tmp_path / f"{licence}.zip"
        result = cembench.submit(run.folder, path, maps=True, surfaces_licence=licence)
        with zipfile.ZipFile(path) as archive:
            assert len([n for n in archive.namelist() if n.startswith("meshes/")]) == 2 + sent
        assert result.maps == 10 + 5 * sent
        assert result.unlicensed == (() if sent else (name,))


def test_what_cannot_be_submitted_is_said(bundles, tmp_path):
    run = machine_run(tmp_path / "run", 1).folder
    with pytest.raises(ParameterError, match=r"write mine\.zip"):
        cembench.submit(run, tmp_path / "mine.tar")
    (tmp_path / "mine.zip").write_text("mine")
    with pytest.raises(ParameterError, match="already exists"):
        cembench.submit(run, tmp_path / "mine.zip")
    assert (tmp_path / "mine.zip").read_text() == "mine"
    with pytest.raises(RecordError, match="holds no run"):
        cembench.submit(tmp_path, tmp_path / "b.zip")


@pytest.mark.skipif(shutil.which("ssh-keygen") is None, reason="NOT CHECKED: no ssh-keygen")
def test_a_signed_bundle_names_its_signer_and_another_is_refused(bundles, tmp_path, cli):
    import subprocess

    key = tmp_path / "ada"
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", str(key)], check=True)
    signers = tmp_path / "signers"
    signers.write_text(f"ada@example.org {key.with_suffix('.pub').read_text()}")
    run = machine_run(tmp_path / "run", 1).folder
    code, out, err = cli("submit", run, "-o", "sent/mine.zip", "--key", key)
    assert (code, err) == (0, "")
    assert out == "15 cells, 0 with maps: sent/mine.zip\n"
    shutil.copy(bundles / "node-2.zip", "sent")
    code, out, _ = cli("submissions", "check", "sent", "--require-signed", signers, "--json")
    assert code == 1
    mine, other = json.loads(out)
    assert (mine["accepted"], mine["signer"]) == (True, "ada@example.org")
    assert "is not signed" in other["faults"][0]
    with zipfile.ZipFile("sent/mine.zip") as archive:
        archive.extractall("unpacked")
    assert signer(cli.folder / "unpacked", signers) == "ada@example.org"
    # Author and licence are what others rely on.
    for old, new in ((b"CC-BY-4.0", b"CC0-1.0"), (b'"name": "mine"', b'"name": "yours"')):

        def other(files, old=old, new=new):
            assert old in files[CRATE]
            files[CRATE] = files[CRATE].replace(old, new)

        forged = rewritten("sent/mine.zip", tmp_path / "forged.zip", other, forged=False)
        (found,) = cembench.check_submissions(forged, require_signed=signers)
        assert found.faults[0].startswith("forged.zip was changed after ada@example.org signed it")
    code, _, err = cli("publish", "sent", "-o", "site", "--require-signed", signers)
    assert code == 2
    assert "node-2.zip is not signed; its measurer can run `cembench submit" in " ".join(
        err.split()
    )
    assert tempfile.gettempdir() not in err.replace(str(signers), "")


def test_maps_that_are_left_out_are_named_with_what_to_add(tmp_path, cli):
    run = machine_run(tmp_path / "run", 1, mesh="my-face")
    code, out, err = cli("submit", run.folder, "-o", tmp_path / "mine.zip", "--maps")
    assert code == 0
    assert "with maps" in out
    assert "no licence is stated for my-face" in err
    assert "--surfaces-licence" in err


def test_a_folder_that_is_named_as_a_cell_is_not_looked_for_in_another_run(tmp_path, cli):
    run = machine_run(tmp_path / "run", 1)
    code, _, err = cli("show", run.folder)
    assert code == 2
    assert f"cembench show CELL --run {run.folder}" in " ".join(err.split())
    assert "results/run" not in err
