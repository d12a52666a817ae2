"""Whatever became of a run's folder, a verb ends with a message: never with an exception.

Every mutation is made from a seed, so that one that fails can be made again by its number.
"""

import json
import random
import shutil

import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench.mesh.files import write_mesh
from cembench.registry import load_registry
from cembench.results.store import Store
from cembench.running.environment import describe_environment
from cembench.running.local import run_tasks
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, plan_cells
from tests.report.conftest import drawing_little
from tests.report.small_run import write_koebe
from tests.validation.in_this_process import TimerHere

ALGORITHMS = ("cem", "harmonic-circle")
RUN = ("run", "--mesh", "disk.obj", "-a", ",".join(ALGORITHMS), "--repeats", 1, "-o", "run")
VERBS = {
    "status": ("status", "run"),
    "status --verify": ("status", "run", "--verify", "--json"),
    "show": ("show", "disk/cem", "--run", "run"),
    "compare": ("compare", "run", "whole"),
    "export": ("export", "run", "-o", "rows.csv"),
    "merge": ("merge", "run", "whole", "-o", "both", "--verify"),
    "dry run": (*RUN, "--dry-run"),
    "resume": RUN,
}
#: What may come out: all well, something is not ok, a message for the user.
ENDS = (0, 1, 2)
STRANGE = (
    None,
    True,
    -1,
    0,
    2.5,
    1e308,
    10**400,
    float("nan"),
    float("inf"),
    "",
    "[/fast]",
    "../../x",
    "a\x00b",
    "x" * 300,
    [],
    {},
    [[None]],
    {"a": {}},
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A run with all kinds of files, one cell of it not finished."""
    folder = tmp_path_factory.mktemp("whole")
    mesh = flat_disk(120)
    write_mesh(folder / "disk.obj", mesh)
    from cembench.mesh.files import read_mesh

    mesh = read_mesh(folder / "disk.obj")
    registry = load_registry()
    store = Store(folder / "run")
    chosen = [registry.algorithm(name) for name in ALGORITHMS]
    tasks = plan_cells(chosen, [mesh], {}, MeasurementSettings(repeats=1))
    run_tasks(tasks, store, Options(), timer=TimerHere)
    (unfinished,) = plan_cells(
        [registry.algorithm("lscm")], [mesh], {}, MeasurementSettings(repeats=2)
    )
    samples = store.samples(unfinished.cell, describe_environment()["id"])
    outcome, uv = TimerHere(folder, Options()).check(unfinished)
    samples.save_check(outcome, uv)
    samples.save_round(0, outcome.rounds[0])
    store.save_plan([*(task.cell for task in tasks), unfinished.cell])
    write_koebe(store.folder)
    return folder


@pytest.fixture
def fuzzed(whole, cli, monkeypatch):
    """Make the run anew, spoil it by a seed and call a verb on it; exit code and messages."""
    monkeypatch.setattr("cembench.running.local.CellTimer", TimerHere)
    monkeypatch.setattr("cembench.running.recorder.describe_environment", lambda: {"id": "e"})

    def call(seed, verb):
        for name in ("run", "whole", "both"):
            shutil.rmtree(cli.folder / name, ignore_errors=True)
        shutil.copytree(whole / "run", cli.folder / "run")
        shutil.copytree(whole / "run", cli.folder / "whole")
        shutil.copy(whole / "disk.obj", cli.folder)
        done = spoil(cli.folder / "run", random.Random(seed))
        code, out, err = cli(*verb)
        assert code in ENDS, f"seed {seed}: {done}\ncembench {' '.join(map(str, verb))}\n{err}"
        assert "Traceback" not in out + err, f"seed {seed}: {done}"
        assert code == 0 or "error" in err or out, f"seed {seed}: {done}: no cause"
        return done

    return call


def spoil(run, chance):
    """Change one file of a run; what was done, in words."""
    file = chance.choice(sorted(p for p in run.rglob("*") if p.is_file()))
    ways = [truncated, flipped, removed, folder_instead, emptied, fifo_instead]
    if file.suffix in (".json", ".jsonl"):
        ways += [value_replaced] * 12
    way = chance.choice(ways)
    return f"{way.__name__} {file.relative_to(run)} {way(file, chance) or ''}"


def truncated(file, chance):
    content = file.read_bytes()
    file.write_bytes(content[: chance.randrange(len(content) or 1)])


def flipped(file, chance):
    content = bytearray(file.read_bytes())
    for _ in range(chance.choice((1, 1, 5))):
        if content:
            content[chance.randrange(len(content))] ^= 1 << chance.randrange(8)
    file.write_bytes(content)


def removed(file, chance):
    file.unlink()


def folder_instead(file, chance):
    file.unlink()
    file.mkdir()


def emptied(file, chance):
    file.write_bytes(b"")


def fifo_instead(file, chance):
    import os

    file.unlink()
    os.mkfifo(file)


def value_replaced(file, chance):
    """A value somewhere in the JSON is of another type, or impossible; half the time unsigned."""
    lines = file.read_text().splitlines() if file.suffix == ".jsonl" else [file.read_text()]
    k = chance.randrange(len(lines))
    content = json.loads(lines[k])
    if isinstance(content, dict) and chance.random() < 0.5:
        content.pop("digest", None)  # as an earlier version wrote it: only the values can tell
    places = list(places_of(content))
    owner, key = chance.choice(places)
    new = chance.choice(STRANGE)
    before, owner[key] = owner[key], new
    if chance.random() < 0.2:
        del owner[key]
    lines[k] = json.dumps(content)
    file.write_text("\n".join(lines) + "\n")
    return f"{key!r}: {str(before)[:40]} -> {str(new)[:40]}"


def places_of(content):
    items = content.items() if isinstance(content, dict) else enumerate(content)
    for key, value in list(items):
        yield content, key
        if isinstance(value, dict | list):
            yield from places_of(value)


@pytest.mark.parametrize("name", VERBS)
def test_a_spoiled_run_ends_every_verb_with_a_message(fuzzed, name):
    for seed in range(25):
        fuzzed(seed, VERBS[name])


def test_a_spoiled_run_ends_report_with_a_message(fuzzed, monkeypatch):
    # Everything is computed, but not written in its four forms.
    monkeypatch.setattr("cembench.report.write_report._write_all", lambda *_: None)
    fuzzed(0, ("report", "run"))
    with drawing_little():
        for seed in range(1, 5):  # a hundred more, all drawn: the slow test below
            fuzzed(seed, ("report", "run"))


@pytest.mark.slow
@pytest.mark.parametrize("name", [*VERBS, "report"])
def test_a_spoiled_run_ends_every_verb_with_a_message_however_it_is_spoiled(fuzzed, name):
    for seed in range(1000, 1100 if name == "report" else 1600):
        fuzzed(seed, VERBS.get(name, ("report", "run")))
