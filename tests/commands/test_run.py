import json

import pytest

from cembench.results.store import Store
from tests.records import changed, record_of
from tests.running.test_local import FAULTY

ROUNDS = [1.0, 1.1, 0.9, 1.0, 1.0, 1.2]


@pytest.fixture
def runs(cli):
    """Two runs with a machine each: in the second "cem" takes half the time, and one cell fails."""
    for name, factor in (("one", 1.0), ("two", 0.5)):
        store = Store(cli.folder / name)
        records = [
            record_of([factor * s for s in ROUNDS], algorithm="cem", mesh="hat"),
            record_of([3 * s for s in ROUNDS], algorithm="lscm", mesh="hat"),
        ]
        if name == "two":
            failed = record_of([], algorithm="ldm", mesh="hat")
            records.append(changed(failed, outcome={"cause": "it gave up"}))
        for record in records:
            store.save(changed(record, environment=name), None, {"id": name, "cpu": name})
    return cli


def test_status_counts_and_names_what_is_not_ok(runs):
    code, out, _ = runs("status", "two")
    assert code == 0
    assert "     2  ok" in out
    assert "hat / ldm (reuse): failed: it gave up" in out
    asked = [record_of([], algorithm=name, mesh="hat").cell for name in ("cem", "fdm", "qiem")]
    store = Store(runs.folder / "two")
    store.save_plan(asked)
    store.samples(asked[1], "e").save_round(0, record_of([1.0]).outcome.rounds[0])
    data = json.loads(runs("status", "two", "--json")[1])
    assert data["states"] == {"ok": 1, "in work": 1, "waiting": 1}
    assert (data["asked"], data["recorded_besides"], data["measuring"]) == (3, 2, False)
    assert "in work: 1 of 6 rounds done" in runs("status", "two")[1]
    precise = record_of([], algorithm="fdm", mesh="hat", repeats=0, precision=0.05).cell
    store.save_plan([precise])
    store.samples(precise, "e").save_round(0, record_of([1.0]).outcome.rounds[0])
    told = runs("status", "two")[1]
    assert "in work: 1 rounds done, of as many as ±5 % takes" in told


def test_show_finds_a_cell_by_name_or_key(runs):
    code, out, _ = runs("show", "hat/cem", "--run", "two")
    assert code == 0
    assert "0.4500 to 0.6000 s over 6 rounds, unstable" in out
    assert "round 6" in out
    (found,) = json.loads(runs("show", "hat/ldm", "--run", "two", "--json")[1])
    assert (found["status"], found["cause"]) == ("failed", "it gave up")
    again = json.loads(runs("show", found["key"][:8], "--run", "two", "--json")[1])
    assert again == [found]


def test_compare_tells_what_changed_and_that_the_machines_differ(runs):
    code, out, err = runs("compare", "one", "two")
    assert code == 0
    lines = out.splitlines()
    assert [line.split()[-1] for line in lines[1:3]] == ["faster", "undecided"]
    message = " ".join(lines[3:])
    assert "drift between the runs is unknown" in message
    assert "Holm, 2 comparisons" in message
    assert max(map(len, out.splitlines())) <= 80
    assert "measured under different conditions" in err
    assert "cpu: one / two" in err
    data = json.loads(runs("compare", "one", "two", "--json")[1])
    assert data["cells"][0]["ratio"] == pytest.approx(0.5)
    assert "warning" not in runs("compare", "one", "one")[2]


def test_show_has_digits_of_short_calls_too(runs):
    record = record_of([2.15e-4] * 6, algorithm="quick", mesh="hat")
    (one, *_) = rounds = record.outcome.rounds
    rounds = (one.model_copy(update={"phases": {"solves": 1.5e-4, "laplacian": 6.5e-5}}),) * 6
    outcome = record.outcome.model_copy(update={"rounds": rounds})
    Store(runs.folder / "two").save(record.model_copy(update={"outcome": outcome}), None, {})
    _, out, _ = runs("show", "hat/quick", "--run", "two")
    assert "0.000215 (solves 0.000150, laplacian 0.0000650)" in out
    assert out.count("0.0002150") == 3 + 6


@pytest.fixture
def edited(runs):
    """The first run, in which the reference was edited and took half the time from then on."""
    again = record_of([0.5 * s for s in ROUNDS], algorithm="cem", mesh="hat", code_hash="edited")
    later = {"environment": "one", "started_at": "2026-02-01T00:00:00+00:00"}
    Store(runs.folder / "one").save(again.model_copy(update=later), None, {"id": "one"})
    return runs


@pytest.mark.parametrize("pair", [("one", "one"), ("one", "two"), ("two", "one")])
def test_compare_takes_the_latest_record_of_an_edited_algorithm(edited, pair):
    code, _, err = edited("compare", *pair)
    assert (code, f"left out: {pair.count('one')} older records of cells" in err) == (0, True)
    found = json.loads(edited("compare", *pair, "--json")[1])
    assert [cell["ratio"] for cell in found["cells"]] == [1, 1]
    assert found["superseded"] == [int(name == "one") for name in pair]


def test_status_does_not_count_what_was_measured_again(edited):
    code, out, _ = edited("status", "one")
    assert code == 0
    assert "1  older records of cells measured again" in out
    assert "No time is stable (2 of 2 have" in out


def test_merge_brings_runs_together(runs):
    code, out, err = runs("merge", "one", "two", "-o", "all")
    assert code == 0
    assert "3 cells in all" in out
    assert "2 environments" in err
    assert len(Store(runs.folder / "all").records()) == 3
    assert json.loads(runs("merge", "one", "-o", "again", "--json")[1])["cells"] == 2


@pytest.mark.parametrize("form", ["csv", "parquet", "json"])
def test_export_writes_a_row_a_cell(runs, form):
    code, out, _ = runs("export", "two", "--format", form)
    assert code == 0
    assert f"3 rows in two/rows.{form}" in out
    assert (runs.folder / f"two/rows.{form}").stat().st_size > 500
    said = json.loads(runs("export", "two", "--format", form, "-o", "x", "--json")[1])
    assert said == {"output": "x", "rows": 3}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("status", "nowhere"), "nowhere holds no run: there is no such folder"),
        (("show", "hat/none", "--run", "one"), "no cell 'hat/none' in this run; it holds: hat/cem"),
        (("show", "", "--run", "one"), "no cell ''"),
        (("compare", "one", "empty"), "have no timed cell in common"),
        (("export", "nowhere"), "nowhere holds no run"),
        (("merge", "nowhere", "-o", "all"), "nowhere holds no run"),
        (("merge", "one", "-o", "one"), "one is the only run: name another one to merge into it."),
        (("merge", "one", "-o", "./one", "--force"), "one is the only run"),
        (("merge", "one", "two", "-o", "one"), "add `overwrite`"),
        (
            ("run", "--surfaces", "flat-disk", "--memory", "much"),
            "memory_bytes='much' is not",
        ),
        (("run", "--surfaces", "flat-disk", "--solves", "twice"), "solves='twice' is not allowed"),
        (("run", "--mesh-dir", "nowhere"), "mesh_dir='nowhere' is not a folder"),
        (("run", "--mesh-dir", "one"), "holds no file of a mesh (.obj, .off,"),
        (("run",), "there is no surface to measure on"),
    ],
)
def test_bad_usage_is_said(runs, arguments, message):
    (runs.folder / "empty/records").mkdir(parents=True)
    code, _, err = runs(*arguments)
    assert code == 2
    assert message in err


def test_a_dry_run_tells_the_cells_and_their_cost(cli):
    arguments = ["run", "--surfaces", "flat-disk", "--faces", 600, "-a", "good,harmonic-circle"]
    arguments += ["--plugin", FAULTY, "--repeats", 1, "-o", "here"]
    code, out, _ = cli(*arguments, "--solves", "reuse,backslash", "--dry-run")
    assert code == 0
    assert "4 of 4 cells to measure: about" in out
    assert "rough" in out
    assert max(map(len, out.splitlines())) <= 80
    assert not list(cli.folder.iterdir())
    assert cli(*arguments)[0] == 0
    data = json.loads(cli(*arguments, "--solves", "reuse,backslash", "--dry-run", "--json")[1])
    assert [cell["held"] for cell in data["cells"]] == ["ok", "ok", None, None]
    assert data["seconds"] == sum(c["estimate"]["seconds"] for c in data["cells"][2:])


def test_both_policies_stand_in_tables_of_their_own(cli):
    code, out, _ = cli(
        *("run", "--surfaces", "flat-disk", "--faces", 600, "-a", "cem,lscm", "--repeats", 1),
        *("--solves", "reuse,backslash", "--memory", "4GiB", "-o", "here"),
    )
    assert code == 0
    assert out.index("solves: reuse") < out.index("solves: backslash") < out.index("Speedup of cem")
    assert "flat-disk (backslash)" in out
    assert max(map(len, out[: out.index("Records and maps")].splitlines())) <= 80


def test_a_folder_of_meshes_and_a_profile_can_be_named(cli, monkeypatch):
    from cembench.surfaces.flat_disk import flat_disk

    from cembench.mesh.files import write_mesh
    from cembench.registry import Registry, load_registry

    # Stand-ins that take no time to make, instead of the real ones.
    bare = Registry(load_registry().algorithms, {})
    monkeypatch.setattr("cembench.registry._installed", lambda: bare)
    (cli.folder / "meshes").mkdir()
    for name in ("b.obj", "a.ply"):
        write_mesh(cli.folder / "meshes" / name, flat_disk(100))
    (cli.folder / "meshes/notes.txt").touch()
    plugin = cli.folder / "stand_ins.py"
    plugin.write_text(
        "from cembench import DiskMesh, surface_family\n"
        "from cembench.results.papers import find_paper\n"
        "from cembench.surfaces.flat_disk import flat_disk\n"
        "from dataclasses import replace\n"
        "def declare(k, row):\n"
        "    @surface_family(f's{k}', title=row, paper_row=row)\n"
        "    def plate(faces: int = 100 + 10 * k) -> DiskMesh:\n"
        "        return flat_disk(100 + 60 * k).renamed(f's{k}')\n"
        "    plate.__module__ = __name__\n"
        "    return plate\n"
        "for k, row in enumerate(find_paper('cem').models):\n"
        "    globals()[f's{k}'] = declare(k, row)\n"
    )
    arguments = ("run", "-a", "cem", "--plugin", plugin, "--dry-run", "--json")
    code, out, err = cli(*arguments, "--mesh-dir", "meshes", "--profile", "quick")
    assert code == 0, err
    assert "made" not in err  # ahead, in other processes: only what is kept is
    data = json.loads(out)
    assert [cell["mesh"] for cell in data["cells"]] == ["a", "b", *(f"s{k}" for k in range(8))]


def test_a_record_knows_which_row_of_the_paper_its_surface_stands_for():
    from cembench.registry import load_registry
    from cembench.running.plan import Provenance, provenances

    sources = provenances(load_registry(), ["foot-stand-in", "flat-disk"])
    assert sources == {
        "foot-stand-in": Provenance("Foot", "stand-in", family="foot-stand-in", fitted="fdm"),
        "flat-disk": Provenance(family="flat-disk"),
    }


def test_a_surface_that_lies_in_a_folder_in_two_formats_is_measured_once(cli):
    from cembench.surfaces.flat_disk import flat_disk

    from cembench.mesh.files import write_mesh

    for name in ("a.obj", "a.ply"):
        write_mesh(cli.folder / name, flat_disk(100))
    data = json.loads(cli("run", "-a", "cem", "--mesh-dir", ".", "--dry-run", "--json")[1])
    assert [cell["mesh"] for cell in data["cells"]] == ["a"]


def test_ctrl_c_says_that_the_same_command_resumes(cli, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("cembench.api.run_plan.run_tasks", interrupted)
    code, _, err = cli("run", "--surfaces", "flat-disk", "--faces", "60", "-a", "cem")
    assert code == 130
    assert "Stopped; the same command resumes." in err


def test_ctrl_c_in_a_command_that_keeps_nothing_says_only_that_it_stopped(cli, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    from cembench.surfaces.flat_disk import flat_disk

    from cembench.mesh.files import write_mesh

    monkeypatch.setattr("cembench.textures.maps.map_here", interrupted)
    write_mesh(cli.folder / "disk.obj", flat_disk(60))
    code, _, err = cli("map", "disk.obj")
    assert code == 130
    assert "Stopped." in err
    assert "resumes" not in err


@pytest.mark.parametrize(
    ("pair", "words", "code"),
    [
        (("one", "two"), "slower,worse,invalid", 0),
        (("two", "one"), "slower", 1),
        (("two", "one"), "worse", 0),
        (("one", "one"), "slower", 0),
    ],
)
def test_compare_fails_on_what_it_is_told_to(runs, pair, words, code):
    assert runs("compare", *pair, "--fail-on", words)[0] == code


def test_compare_says_which_words_it_fails_on(runs):
    code, _, err = runs("compare", "one", "two", "--fail-on", "slow")
    assert code == 2
    assert "fail_on: unknown kind of regression 'slow'. Did you mean slower?" in err


def test_compare_writes_no_junit_over_another_file(runs):
    (runs.folder / "j.xml").write_text("mine")
    code, _, err = runs("compare", "one", "two", "--junit", "j.xml")
    assert code == 2
    assert "was not written by `cembench compare`" in err


def test_compare_needs_two_runs_or_solvers(runs):
    code, _, err = runs("compare", "one")
    assert code == 2
    assert "name two folders of runs; or name solvers by -a" in err
