"""One kill: a verb is ended at some moment in a folder full of decoys, and then run again.

A plan says how to prepare the folder and which command to call. After the kill and after the second
call every decoy must be as it was, whatever was finished must still be there, and in the end the
folder must hold the same names as after a call that nobody disturbed.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path

import psutil

from tests.campaign import serving
from tests.campaign.decoys import harmed, plant, snapshot
from tests.campaign.verdict import Verdict

#: Elapsed seconds that a call may take before it counts as a hang, and a killed one's children.
PATIENCE, SOON = 300.0, 20.0

MESH = "".join(f"v {j} {i} {0.1 * (i * j % 3)}\n" for i in range(6) for j in range(6)) + "".join(
    f"f {a} {a + 1} {a + 7}\nf {a} {a + 7} {a + 6}\n"
    for i in range(5)
    for a in range(6 * i + 1, 6 * i + 6)
)


@dataclass(frozen=True)
class Plan:
    """A call: its verb, where it writes, and whether that place is a user's folder."""

    verb: str
    arguments: tuple[str, ...]
    #: Files, by pattern, that once there are finished: not changed by a second call.
    finished: tuple[str, ...] = ()
    #: Files that the call replaces: after a kill each is the old one or the new one, whole.
    replaced: tuple[str, ...] = ()
    #: The call writes into a folder, or onto a file, that it did not make; it may refuse.
    foreign: bool = False
    #: How often it is chosen.
    weight: int = 1
    command: tuple[str, ...] = field(default=(sys.executable, "-m", "cembench.commands.cli"))

    @property
    def name(self) -> str:
        """The verb and the kind of place."""
        return f"{self.verb} into a user's" if self.foreign else self.verb


_RUN = ("run", "--mesh", "face.obj", "-a", "harmonic-circle", "--repeats", "1", "-o")
_RUN_TWO = (*_RUN[:4], "harmonic-circle,lscm", *_RUN[5:])
#: An output of an earlier call.
_OLD = "mesh-of-mine.obj"
#: Runs that are made beforehand, and their algorithms.
_RUNS = {"one": "harmonic-circle", "two": "lscm"}
_RECORDS = ("records/*.json", "maps/*.npz")

#: All in one working folder that holds face.obj, the runs one and two, and decoys.
PLANS = (
    Plan("run", (*_RUN_TWO, "out"), tuple(f"out/{p}" for p in _RECORDS), weight=5),
    Plan("run", (*_RUN, "."), foreign=True, weight=2),
    Plan("run", (*_RUN, "sub"), foreign=True),
    Plan("map", ("map", "face.obj", "-o", "face_uv.obj"), ("face_uv.obj",), weight=4),
    Plan("map", ("map", "face.obj", "-o", _OLD), replaced=(_OLD,), weight=3),
    Plan("map", ("map", "face.obj", "-o", "face.obj"), foreign=True, weight=2),
    Plan("report", ("report", "one", "-o", "out"), weight=3),
    Plan("report", ("report", "one", "-o", "."), foreign=True, weight=2),
    Plan("merge", ("merge", "one", "two", "-o", "out"), ("out/records/*.json",), weight=5),
    Plan("merge", ("merge", "one", "two", "-o", "."), foreign=True, weight=2),
    Plan("fetch", ("fetch", serving.NAME), (f"cache/datasets/{serving.FILE}",), weight=5),
)


@dataclass(frozen=True)
class KillCase:
    """Which call is killed, and after which share of its usual duration."""

    number: int
    plan: int
    moment: float


def kill_case(seed: int, number: int, plans: Sequence[Plan] = PLANS) -> KillCase:
    """Choose call and moment; the moments go a little beyond the call's end."""
    rng = random.Random(f"{seed} kill {number}")
    plan = rng.choices(range(len(plans)), [p.weight for p in plans])[0]
    return KillCase(number, plan, rng.uniform(0, 1.1))


#: What a call does undisturbed: seconds, exit code, names in the folder in the end.
Usual = tuple[float, int | None, list[str]]


def prepare(folder: Path, plans: Sequence[Plan] = PLANS) -> None:
    """Make once what calls start from: a surface, a dataset's package, runs where they are read."""
    place = folder / "template"
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    (place / "face.obj").write_text(MESH)
    serving.install(folder / "site", MESH.encode())
    read = {name for plan in plans for name in _RUNS if name in plan.arguments}
    for name in sorted(read):
        command = ["run", "--mesh", "face.obj", "-a", _RUNS[name], "--repeats", "1", "-o", name]
        subprocess.run(
            [sys.executable, "-m", "cembench.commands.cli", *command],
            cwd=place,
            env=_environment(folder, place, folder / "tmp", ""),
            check=True,
            capture_output=True,
        )
    shutil.rmtree(folder / "tmp", ignore_errors=True)


def undisturbed(plan: Plan, prepared: Path, place: Path) -> Usual:
    """Call once without a kill: seconds, exit code, and the names that are there in the end."""
    with _workplace(plan, prepared, place) as (folder, environment):
        started = time.monotonic()
        code, _ = _finish(_call(plan, folder, environment))
        return time.monotonic() - started, code, sorted(snapshot(folder))


def judge_kill(plan: Plan, moment: float, usual: Usual, prepared: Path, place: Path) -> Verdict:
    """Kill the call, call again, and say what was harmed, lost or left."""
    seconds, code, names = usual
    with _workplace(plan, prepared, place) as (folder, environment):
        owned = {n: about for n, about in snapshot(folder).items() if n not in plan.replaced}
        before = {name: (folder / name).read_bytes() for name in plan.replaced}
        process = _call(plan, folder, environment)
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=moment * seconds)
        killed, left = _kill(process)
        outcome = "killed" if killed else "had ended"
        if left:
            return Verdict(outcome, "process left", f"not ended with its parent: {left}")
        damaged = harmed(owned, folder)
        if damaged:
            return Verdict(outcome, "harmed", f"by the killed call: {', '.join(damaged)}")
        finished = _finished(plan, folder)
        broken = [
            name for name in finished if name.endswith(".json") and not _is_json(folder / name)
        ]
        if broken:
            return Verdict(outcome, "half-written", ", ".join(broken))
        then = {name: (folder / name).read_bytes() for name in plan.replaced}
        again, said = _finish(_call(plan, folder, environment))
        if again is None or "Traceback (most recent call last)" in said:
            return Verdict(outcome, "hang" if again is None else "traceback", said[-800:])
        damaged = harmed(owned, folder)
        if damaged:
            return Verdict(outcome, "harmed", f"by the second call: {', '.join(damaged)}")
        lost = _changed(finished, folder)
        if lost:
            return Verdict(outcome, "finished lost", ", ".join(lost))
        torn = [n for n in then if then[n] not in (before[n], (folder / n).read_bytes())]
        if torn:
            return Verdict(outcome, "half-written", ", ".join(torn))
        if again != code:
            return Verdict(outcome, "exit code", f"{again} instead of {code}: {said[-800:]}")
        return Verdict(outcome, *_compared(names, sorted(snapshot(folder))))


def _compared(expected: list[str], there: list[str]) -> tuple[str | None, str]:
    missing, more = set(expected) - set(there), set(there) - set(expected)
    if more:
        return "draft left", ", ".join(sorted(more)[:5])
    if missing:
        return "missing", ", ".join(sorted(missing)[:5])
    return None, ""


@contextmanager
def _workplace(plan: Plan, prepared: Path, place: Path) -> Iterator[tuple[Path, dict[str, str]]]:
    """Give a working folder with decoys, and the environment of a call in it."""
    folder = place / "work"
    shutil.copytree(prepared / "template", folder, symlinks=True)
    plant(folder, place / "outside")
    plant(folder / "sub", place / "outside")
    plant(folder / "cache", place / "outside")
    plant(folder / "cache" / "datasets", place / "outside")
    (place / "tmp").mkdir()
    serves = serving.server(MESH.encode()) if plan.verb == "fetch" else nullcontext("")
    try:
        with serves as url:
            yield folder, _environment(prepared, folder, place / "tmp", url)
    finally:
        for path in [place, *place.rglob("*")]:
            if path.is_dir() and not path.is_symlink():
                path.chmod(0o755)
        shutil.rmtree(place)


def _environment(prepared: Path, folder: Path, temporary: Path, url: str) -> dict[str, str]:
    temporary.mkdir(exist_ok=True)
    paths = [str(prepared / "site"), *filter(None, os.environ.get("PYTHONPATH", "").split(":"))]
    return {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([*paths, str(Path(__file__).parents[2])]),
        "PYTHONDONTWRITEBYTECODE": "1",
        "TMPDIR": str(temporary),
        "CEMBENCH_CACHE": str(folder / "cache"),
        "CEMBENCH_DATA_URL": url,
    }


def _call(plan: Plan, folder: Path, environment: dict[str, str]) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [*plan.command, *plan.arguments],
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )


def _finish(process: subprocess.Popen[bytes]) -> tuple[int | None, str]:
    """Wait for a call's end: its exit code, None for a hang, and what it said."""
    try:
        said, _ = process.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        _kill(process)
        return None, f"not finished after {PATIENCE:g} s"
    return process.returncode, said.decode(errors="replace")


def _kill(process: subprocess.Popen[bytes]) -> tuple[bool, list[str]]:
    """Kill a call as ``kill -9`` does: whether it still ran, and which processes outlived it."""
    children: list[psutil.Process] = []
    with suppress(psutil.Error):
        children = psutil.Process(process.pid).children(recursive=True)
    ran = process.poll() is None
    process.kill()
    assert process.stdout is not None
    process.stdout.close()
    process.wait()
    _, alive = psutil.wait_procs(children, timeout=SOON)
    left = []
    for child in alive:
        with suppress(psutil.Error):
            if child.status() != psutil.STATUS_ZOMBIE:
                left.append(" ".join(child.cmdline())[:200])
                os.kill(child.pid, signal.SIGKILL)
    return ran, left


def _finished(plan: Plan, folder: Path) -> dict[str, bytes]:
    """Return the files that are finished, with their bytes."""
    paths = [path for pattern in plan.finished for path in folder.glob(pattern)]
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def _changed(finished: dict[str, bytes], folder: Path) -> list[str]:
    """Return the files that are gone or hold something else; written again they may be."""
    there = {name: folder / name for name in finished}
    return [
        name
        for name, path in there.items()
        if not path.is_file() or path.read_bytes() != finished[name]
    ]


def _is_json(path: Path) -> bool:
    try:
        json.loads(path.read_bytes())
    except ValueError:
        return False
    return True
