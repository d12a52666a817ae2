"""External programs: whatever one does is a status with its cause, and its time is told apart."""

import json
import re
import sys
from pathlib import Path

import numpy as np
import psutil
import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench import RegistryError
from cembench.core.notices import NoticeKind
from cembench.registry import load_registry
from cembench.results.comparison import compare
from cembench.results.records import FaultKind, Round
from cembench.results.store import Store
from cembench.results.verify import Depth, verify
from cembench.running.external.installed import missing
from cembench.running.local import map_once, run_tasks
from cembench.running.measure import check_cell
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.validation.quality import compare_speed
from tests.records import changed

SCRIPT = Path(__file__).with_name("misbehaves.py")
pytestmark = pytest.mark.usefixtures("one_server")
MESH = flat_disk(600)


def command(mode, *more, **settings):
    words = f"{sys.executable} -I {SCRIPT} {mode} {{input}} {{output}} {' '.join(more)}"
    return "command:" + json.dumps({"command": words, "name": "mine", **settings})


def task_of(mode, *more, mesh=MESH, **settings):
    plugin = command(mode, *more, **settings)
    chosen = load_registry([plugin]).algorithm("mine")
    (task,) = plan_cells([chosen], [mesh], {}, MeasurementSettings(repeats=1), [plugin])
    return task


def outcome_of(mode, **settings):
    task = task_of(mode, **settings)
    return check_cell(task.algorithm, task.mesh, task.cell)


def test_a_good_program_is_a_valid_map_with_its_files_and_version():
    outcome, uv = outcome_of("good", version=f"{sys.executable} --version")
    assert outcome.status == "ok", outcome.cause
    assert np.abs(uv - (MESH.V[:, 0] + 1j * MESH.V[:, 1])).max() == 0
    assert outcome.program.version == f"Python {sys.version.split()[0]}"
    assert outcome.program.input_bytes > 10_000 < outcome.program.output_bytes
    assert outcome.iterations is None
    assert 0 < outcome.peak_memory_bytes < 2**28


@pytest.mark.parametrize(
    ("mode", "status", "kind", "cause"),
    [
        ("segfaults", "failed", FaultKind.PROGRAM_ENDED, "signal SIGSEGV"),
        ("refuses", "failed", FaultKind.GAVE_UP, "code 1: this surface is not for me"),
        ("nothing", "failed", FaultKind.NO_OUTPUT, r"no file uv.obj; its folder holds: mesh.obj"),
        ("elsewhere", "failed", FaultKind.NO_OUTPUT, "holds: mesh.obj, result.obj"),
        ("empty", "failed", FaultKind.UNREADABLE_OUTPUT, "empty"),
        ("large", "failed", FaultKind.OUTPUT_TOO_LARGE, "100,000,002 bytes; for 331 vertices"),
        ("truncated", "failed|invalid", None, r"uv.obj"),
        ("no-uv", "failed", FaultKind.UNREADABLE_OUTPUT, "no UVs"),
        ("noise", "failed", FaultKind.UNREADABLE_OUTPUT, "no UVs"),
        ("gzip", "failed", FaultKind.UNREADABLE_OUTPUT, "no UVs"),
        ("text", "failed", FaultKind.UNREADABLE_OUTPUT, "no UVs.*--program output=txt"),
        ("other-vertices", "invalid", FaultKind.OTHER_SURFACE, "lies .* from the nearest"),
        ("other-triangles", "invalid", FaultKind.OTHER_SURFACE, "other triangles: "),
        ("too-many", "invalid", FaultKind.OTHER_SURFACE, "601 triangles; the surface has 600"),
        ("nan", "invalid", FaultKind.NOT_FINITE, "at 1 vertices, the first being 7"),
        ("folded", "invalid", FaultKind.FOLDED, "are folded"),
        ("mirrored", "invalid", FaultKind.REVERSED, "reverses"),
        ("cut", "invalid", FaultKind.CUT_SURFACE, 'several UVs.*Declare the target "atlas"'),
        ("six-digits", "invalid", FaultKind.OFF_CIRCLE, "off the unit circle by up to"),
    ],
)
def test_whatever_a_program_does_is_a_status_with_its_cause(mode, status, kind, cause):
    outcome, _ = outcome_of(mode)
    assert re.fullmatch(status, outcome.status)
    assert re.search(cause, outcome.cause), outcome.cause
    assert kind is None or outcome.faults[0].kind is kind
    assert outcome.gave_up == (mode == "refuses")


def test_a_program_that_is_not_there_is_skipped_with_what_brings_it():
    plugin = "command:" + json.dumps({"command": "no-such-solver {input} {output}"})
    chosen = load_registry([plugin]).algorithm("no-such-solver")
    (task,) = plan_cells([chosen], [MESH], {}, MeasurementSettings(repeats=1), [plugin])
    outcome, _ = check_cell(chosen, MESH, task.cell)
    assert outcome.status == "skipped"
    assert outcome.faults[0].kind is FaultKind.NOT_THERE
    assert "no program 'no-such-solver'" in outcome.cause


DECLARED = """
from cembench import DiskMesh, external_program

@external_program("mine", title="Mine", target="disk", command="./solver {input} {output}")
def mine(mesh: DiskMesh) -> None:
    "Map by a program beside this file."
"""


def test_the_program_of_a_declaration_is_looked_for_beside_its_file(tmp_path, monkeypatch):
    (tmp_path / "sub").mkdir()
    plugin = tmp_path / "sub/declares.py"
    plugin.write_text(DECLARED)
    monkeypatch.chdir(tmp_path)
    for place, lacks in ((tmp_path, True), (plugin.parent, False)):
        solver = place / "solver"
        solver.write_text("#!/bin/sh")
        solver.chmod(0o700)
        why = missing(load_registry(["sub/declares.py"]).algorithm("mine"))
        told = f"there is no program './solver' in {plugin.parent}. Install it"
        assert why.startswith(told) if lacks else why is None


def test_a_hundred_megabytes_of_words_are_dropped():
    outcome, _ = outcome_of("talks")
    assert outcome.status == "ok", outcome.cause


def test_few_digits_and_a_unit_square_are_taken_where_that_is_declared():
    assert outcome_of("six-digits", circle=1e-5)[0].status == "ok"
    outcome, uv = outcome_of("unit-square", fit=True)
    assert outcome.status == "ok", outcome.cause
    assert np.abs(np.abs(uv[MESH.boundary]) - 1).max() < 1e-9


def test_the_time_by_its_own_word_and_that_of_its_start_stand_beside_the_wall_clock():
    pattern = r"solve: (\S+) s"
    outcome, _ = outcome_of("good", seconds=pattern)
    (found,) = outcome.rounds
    assert found.own_seconds == (0.125,)
    assert outcome.solve_seconds == 0.125
    assert found.phases == {"process": found.seconds}
    assert found.start_seconds > 0
    (found,) = outcome_of("good", seconds=r"solve: (?P<ms>\S+) s")[0].rounds
    assert found.own_seconds == (0.000125,)
    outcome, _ = outcome_of("boasts", seconds=pattern)
    (note,) = (n for n in outcome.notes if n.kind is NoticeKind.PROGRAM_SECONDS)
    assert "it reports a solve time of 1e+06 s" in str(note)
    outcome, _ = outcome_of("good", seconds=r"took (\S+) s")
    assert outcome.rounds[0].own_seconds == ()
    assert "printed no solve time" in " ".join(map(str, outcome.notes))


def test_a_program_that_sleeps_at_its_start_is_not_slower_by_it_in_the_solve_column():
    """Both of its processes sleep 0.2 s, so the difference holds none of it."""
    outcome, _ = outcome_of("slow-start")
    (found,) = outcome.rounds
    assert found.seconds >= 0.2
    assert found.start_seconds >= 0.2
    assert (outcome.solve_seconds or 0.0) <= found.seconds - 0.2
    outcome, _ = outcome_of("slow-start", seconds=r"solve: (\S+) s")
    assert outcome.solve_seconds == 0.125


def test_comparisons_take_the_solve_time_and_never_the_wall_clock():
    program = task_of("good")
    record, _ = map_once(program)

    def timed(*rounds):
        return changed(record, outcome={"rounds": rounds})

    ours = timed(*[Round(calls=(0.5,), start_seconds=0.3)] * 6)
    theirs = timed(*[Round(calls=(0.1,))] * 6).model_copy(update={"external": None})
    assert compare(ours, theirs).ratio == pytest.approx(2.0)
    result = timed(*[Round(calls=(0.5,), start_seconds=0.3, own_seconds=(0.1,))] * 6)
    assert compare(result, theirs).ratio == pytest.approx(1.0)
    # By its own word it is five times faster, by our clock twice as slow: that decides nothing.
    boasts = timed(*[Round(calls=(0.5,), start_seconds=0.3, own_seconds=(0.02,))] * 6)
    comparison = compare(boasts, theirs)
    assert (comparison.ratio, comparison.verdict, comparison.p) == (
        pytest.approx(0.2),
        "undecided",
        1.0,
    )
    assert compare(theirs, boasts).verdict == "undecided"
    assert compare_speed([(boasts, theirs)]).verdict == "undecided"
    fast = timed(*[Round(calls=(0.35,), start_seconds=0.3, own_seconds=(0.02,))] * 6)
    assert compare(fast, theirs).verdict == compare_speed([(fast, theirs)]).verdict == "faster"
    # Its start takes as long as all of it: there is no solve time to compare.
    assert compare(timed(*[Round(calls=(0.5,), start_seconds=0.5)] * 6), theirs) is None


def test_a_hanging_program_is_ended_with_all_that_it_started(tmp_path):
    pids = tmp_path / "pids"
    record, _ = map_once(task_of("hangs", str(pids)), Options(timeout=5))
    assert record.outcome.status == "timeout"
    assert record.is_program
    if not pids.exists():
        pytest.skip("the machine was too busy to start the program within 5 s")
    for pid in map(int, pids.read_text().split()):
        assert not psutil.pid_exists(pid) or psutil.Process(pid).status() == "zombie"


def test_the_limit_of_memory_holds_for_the_program():
    record, _ = map_once(task_of("hogs"), Options(timeout=60, memory_bytes=500 * 2**20))
    assert record.outcome.status == "out_of_memory", record.outcome.cause
    assert record.outcome.faults[0].kind is FaultKind.OUT_OF_MEMORY


def test_what_a_program_leaves_running_is_ended_and_told():
    record, _ = map_once(task_of("leaves"))
    assert record.outcome.status == "ok"
    assert any(n.kind is NoticeKind.PROCESSES_LEFT for n in record.outcome.notes)


def test_a_run_records_programs_and_atlases_and_leaves_no_folder(tmp_path):
    good = task_of("normalised", seconds=r"solve: (\S+) s")
    tasks = [good, task_of("cut", target="atlas")]
    store = Store(tmp_path / "run")
    record, atlas = run_tasks(tasks, store)
    assert record.outcome.status == "ok", record.outcome.cause
    (found,) = record.outcome.rounds
    assert set(found.own_seconds) == {0.125}
    assert found.start_seconds > 0
    assert record.title == "mine (external program)"
    assert record.external.kind == "program"
    assert {"declaration", "misbehaves.py"} <= set(record.sources)
    assert not list((tmp_path / "run").rglob("program-*"))
    assert atlas.outcome.status == "ok", atlas.outcome.cause
    assert atlas.outcome.metrics["islands"] == 2
    assert not verify(store, Depth.everything).disagreements
    again, _ = run_tasks(tasks, store)
    assert again.started_at == record.started_at


def test_what_a_program_keeps_on_disk_by_the_triangles_is_of_no_use_to_timed_calls(tmp_path):
    task = task_of("keeps", str(tmp_path))
    (record,) = run_tasks([task], Store(tmp_path / "run"))
    (found,) = record.outcome.rounds
    assert record.outcome.status == "ok", record.outcome.cause
    assert min(found.calls) > 0.3
    assert list(tmp_path.glob("kept-*"))


def test_an_atlas_has_islands_seams_and_folds_of_each():
    outcome, corners = outcome_of("cut", target="atlas")
    assert outcome.status == "ok", outcome.cause
    assert corners.shape == (3 * MESH.m,)
    metrics = outcome.metrics
    first = MESH.V[MESH.F[0]]
    around = np.linalg.norm(first - np.roll(first, -1, axis=0), axis=1).sum()
    assert (metrics["islands"], metrics["folds_of_worst_island"]) == (2, 0)
    assert metrics["seam_length"] == pytest.approx(around)
    assert metrics["beltrami_max"] < 1e-6
    outcome, _ = outcome_of("folded", target="atlas")
    assert outcome.faults[0].kind is FaultKind.FOLDED
    assert "in 1 of 1 islands" in outcome.cause


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        ({"command": ""}, "its command is empty"),
        ({"command": "x {output}"}, "where the mesh file goes"),
        ({"command": "x {input}"}, "where the UVs go"),
        ({"command": "x {input} {outptu}"}, "names {outptu}; allowed: {input}, {output}"),
        ({"command": "x {input} {output}", "input": "stl"}, "input '.stl' is unknown"),
        ({"command": "x {input}", "output": "uv.fbx"}, "output 'uv.fbx' is unknown"),
        ({"command": "x {input}", "output": "../uv.obj"}, "is a path"),
        ({"command": "x {input} {output}", "seconds": "("}, "not a regular expression"),
        ({"command": "x {input} {output}", "seconds": "s"}, "must have one group"),
        ({"command": "x {input} {output}", "circle": 1}, "circle=1 is not allowed"),
        ({"command": "x {input} {output}", "colour": 1}, "'colour' is unknown; allowed: input"),
        ({"command": "x '{input} {output}"}, "cannot be split"),
        ({"command": "x {input} {output}", "target": "sphere"}, "target 'sphere' is unknown"),
    ],
)
def test_a_declaration_that_cannot_be_right_is_refused(declared, message):
    with pytest.raises(RegistryError, match=re.escape(message)):
        load_registry(["command:" + json.dumps({"name": "mine", **declared})])
