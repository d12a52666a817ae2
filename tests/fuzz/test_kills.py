"""Kills of real verbs, and planted verbs that harm, lose or leave something."""

import sys

import pytest

from tests.campaign import kills
from tests.campaign.decoys import harmed, plant, snapshot
from tests.campaign.kills import PLANS, Plan, judge_kill, prepare, undisturbed

REAL = {plan.name: plan for plan in reversed(PLANS)}


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    folder = tmp_path_factory.mktemp("prepared")
    prepare(folder, [REAL["fetch"], REAL["map"]])
    return folder


@pytest.fixture(scope="module")
def usual(prepared, tmp_path_factory):
    """What each verb does undisturbed, called once."""
    known = {}

    def find(plan):
        if plan.name not in known:
            place = tmp_path_factory.mktemp("usual")
            known[plan.name] = undisturbed(plan, prepared, place)
        return known[plan.name]

    return find


@pytest.mark.parametrize(("verb", "moment"), [("fetch", 0.9), ("map", 0.8)])
def test_a_killed_verb_harms_loses_and_leaves_nothing(verb, moment, prepared, usual, tmp_path):
    verdict = judge_kill(REAL[verb], moment, usual(REAL[verb]), prepared, tmp_path / "place")
    assert verdict.fault is None, verdict
    assert not (tmp_path / "place").exists()


def script(text, finished=(), replaced=()):
    command = (sys.executable, "-c", f"import pathlib, os, sys, time\n{text}")
    return Plan("planted", (), finished, replaced, command=command)


PLANTED = {
    "pathlib.Path('out').write_text('x')": None,
    "pathlib.Path('scratch/thesis.txt').unlink()": "harmed",
    "os.utime('notes.txt')": "harmed",
    "pathlib.Path('report.md').chmod(0o600)": "harmed",
    "pathlib.Path('.draft-link').unlink()": "harmed",
    "p = pathlib.Path('records/mine.json'); p.chmod(0o644); p.write_text('{}')": "harmed",
    "pathlib.Path(f'.draft-{os.getpid()}').touch()": "draft left",
    "p = pathlib.Path('done.json'); p.write_text('{' if p.exists() else '{}')": "finished lost",
    "pathlib.Path('done.json').write_text('{')": "half-written",
    "p = pathlib.Path('twice'); sys.exit(p.exists() or p.touch())": "exit code",
    "raise KeyError": "traceback",
    "p = pathlib.Path('mesh-of-mine.obj'); p.write_text('new')": None,
    "p = pathlib.Path('mesh-of-mine.obj'); p.write_text('new' + p.read_text())": "half-written",
}


@pytest.mark.parametrize("text", PLANTED)
def test_a_planted_verb_is_found(text, prepared, tmp_path):
    plan = script(text, ("done.json",), ("mesh-of-mine.obj",))
    place = tmp_path / "place"
    usual = undisturbed(plan, prepared, place)
    # Usually it takes an hour, we say: so the first call comes to its end, whatever the clock says.
    verdict = judge_kill(plan, 1.0, (3600.0, *usual[1:]), prepared, place)
    assert verdict.outcome == "had ended"
    assert verdict.fault == PLANTED[text], verdict


def test_a_process_that_outlives_its_parent_is_found(prepared, tmp_path, monkeypatch):
    monkeypatch.setattr(kills, "SOON", 0.1)
    child = "import subprocess; subprocess.Popen([sys.executable, '-c', 'import time; "
    plan = script(child + "time.sleep(600)']); time.sleep(600)")
    verdict = judge_kill(plan, 1.0, (1.5, 0, []), prepared, tmp_path / "place")
    assert verdict.fault == "process left"
    assert "sleep(600)" in verdict.detail


def test_decoys_are_compared_by_bytes_mode_and_time(tmp_path):
    plant(tmp_path / "a", tmp_path / "b")
    before = snapshot(tmp_path)
    assert len(before) > 30
    assert harmed(before, tmp_path) == []
    (tmp_path / "a" / "new").touch()
    assert harmed(before, tmp_path) == []
    (tmp_path / "b" / "will.txt").write_text("other")
    (tmp_path / "a" / "lock").unlink()
    assert harmed(before, tmp_path) == ["a/lock", "b/will.txt"]
