"""The campaign: three parts that take turns, within limits, seeded, written down case by case."""

from __future__ import annotations

import shutil
import tempfile
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, Generic, TypeVar

from tests.campaign import kills, project
from tests.campaign.files import file_case, judge_file
from tests.campaign.hard_meshes import FAMILIES as MESH_FAMILIES
from tests.campaign.hard_meshes import hard_mesh
from tests.campaign.journal import Entry, Journal
from tests.campaign.kills import PLANS, kill_case
from tests.campaign.limited import Ending, Limits, run_cases
from tests.campaign.meshes import MeshCase, judge_case, takes
from tests.campaign.seed_files import FAMILIES as FILE_FAMILIES
from tests.campaign.verb import judge_verb

#: Of so many files, one is also given to the verb `map`.
VERB_EVERY = 20
#: Turns that the parts take: each does this share of its cases before the next one goes on.
TURNS = 20
C = TypeVar("C")


@dataclass(frozen=True)
class Targets:
    """How many cases of each part."""

    files: int = 10_000
    meshes: int = 3_000
    kills: int = 300


@dataclass(frozen=True)
class Part(Generic[C]):
    """A kind of cases: how they are listed, named, judged, and kept when faulty."""

    name: str
    cases: list[C]
    key: Callable[[C], str]
    family: Callable[[C], str]
    judge: Callable[[C], dict[str, Any]]
    keep: Callable[[C, Path], None]
    limits: Limits
    batch: int = 1
    #: Called once, before the first case of a sitting, with the cases that may follow.
    begin: Callable[[list[C]], None] = lambda cases: None

    def shares(self, number: int) -> Iterator[list[C]]:
        """Yield the cases in so many shares."""
        size = -(-len(self.cases) // number) or 1
        cases = iter(self.cases)
        for _ in range(number):
            yield list(islice(cases, size))


def parts(seed: int, targets: Targets, folder: Path) -> list[Part[Any]]:
    """Return the parts of a campaign; what it prepares once lies in the folder."""
    return [
        _files(seed, targets.files, folder),
        _meshes(seed, targets.meshes),
        _kills(seed, targets.kills, folder),
    ]


def run(
    chosen: Iterable[Part[Any]],
    journal: Journal,
    slots: int,
    deadline: float,
    finished: Callable[[Entry], None],
) -> bool:
    """Do what the journal does not hold yet; whether all was done before the deadline.

    The deadline is one of :func:`time.monotonic`. A case that has begun is brought to its end.
    """
    todo = [part for part in chosen if part.cases]
    begun: set[str] = set()
    for turn in zip(*(part.shares(TURNS) for part in todo), strict=True):
        for part, share in zip(todo, turn, strict=True):
            left = [case for case in share if f"{part.name}:{part.key(case)}" not in journal]
            if left and part.name not in begun and time.monotonic() < deadline:
                begun.add(part.name)
                part.begin(part.cases)
            in_time = _until(deadline, left)
            for ending in run_cases(in_time, part.judge, part.limits, slots, part.batch):
                entry = entry_of(part, ending)
                journal.add(entry)
                if entry.fault:
                    _keep(part, ending.case, entry, journal)
                finished(entry)
    return all(f"{p.name}:{p.key(case)}" in journal for p in todo for case in p.cases)


def _until(deadline: float, cases: list[C]) -> Iterator[C]:
    for case in cases:
        if time.monotonic() > deadline:
            return
        yield case


def entry_of(part: Part[C], ending: Ending[C]) -> Entry:
    """Return what is written down of a case that has ended."""
    result = ending.result or {
        "outcome": ending.failure,
        "fault": ending.failure,
        "detail": ending.detail[-2000:],
    }
    return Entry(
        part=part.name,
        case=part.key(ending.case),
        family=part.family(ending.case),
        seconds=round(ending.seconds, 3),
        **result,
    )


def _keep(part: Part[C], case: C, entry: Entry, journal: Journal) -> None:
    """Keep a faulty case as files, with the command that repeats it."""
    place = journal.path.parent / "faults" / entry.id.replace(":", "-").replace("/", "-")
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    part.keep(case, place)
    command = f"python -m tests.campaign --seed {journal.about['seed']} --replay {entry.id}"
    (place / "about.txt").write_text(f"{command}\n\n{entry.fault}: {entry.detail}\n")


def _files(seed: int, count: int, folder: Path) -> Part[int]:
    def judge(number: int) -> dict[str, Any]:
        warnings.simplefilter("ignore")
        case = file_case(seed, number)
        with tempfile.TemporaryDirectory(prefix="fuzz-file-") as place:
            path = Path(place) / f"case{case.suffix}"
            path.write_bytes(case.data)
            verdict = judge_file(path, project.read, legal=not case.mutations)
            if verdict.fault is None and number % VERB_EVERY == 0:
                verdict = judge_verb(path, verdict)
        mutations = ", ".join(case.mutations) or "none"
        detail = f"{verdict.detail} (mutations: {mutations})" if verdict.fault else ""
        return {**verdict.as_json(), "detail": detail.replace(place, "")}

    def keep(number: int, place: Path) -> None:
        case = file_case(seed, number)
        (place / f"case{case.suffix}").write_bytes(case.data)

    return Part(
        name="files",
        cases=list(range(count)),
        key=str,
        family=lambda number: list(FILE_FAMILIES)[number % len(FILE_FAMILIES)],
        judge=judge,
        keep=keep,
        limits=Limits(cpu_seconds=5),
        batch=50,
    )


def _meshes(seed: int, count: int) -> Part[MeshCase]:
    names = list(project.algorithms())

    def judge(case: MeshCase) -> dict[str, Any]:
        warnings.simplefilter("ignore")
        return judge_case(seed, case)[1].as_json()

    def keep(case: MeshCase, place: Path) -> None:
        _, V, F = hard_mesh(seed, case.number)
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in V.tolist()]
        lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in F.tolist()]
        (place / f"{case.algorithm}.obj").write_text("\n".join(lines) + "\n")

    return Part(
        name="meshes",
        cases=[MeshCase(k, name) for k in range(count) for name in names if takes(k, name)],
        key=lambda case: f"{case.number}/{case.algorithm}",
        family=lambda case: list(MESH_FAMILIES)[case.number % len(MESH_FAMILIES)],
        judge=judge,
        keep=keep,
        limits=Limits(cpu_seconds=20),
        batch=len(names),
    )


def _kills(seed: int, count: int, folder: Path) -> Part[kills.KillCase]:
    prepared = folder / "prepared"
    usual: dict[int, kills.Usual] = {}

    def measure(cases: list[kills.KillCase]) -> None:
        """Prepare, and call each verb once undisturbed, before the first kill of this sitting."""
        for stale in (prepared, *folder.glob("kill-*")):  # of a sitting that was ended
            shutil.rmtree(stale, ignore_errors=True)
        chosen = sorted({case.plan for case in cases})
        kills.prepare(prepared, [PLANS[number] for number in chosen])
        for number in chosen:
            usual[number] = kills.undisturbed(PLANS[number], prepared, _place(folder))

    def judge(case: kills.KillCase) -> dict[str, Any]:
        plan = PLANS[case.plan]
        verdict = kills.judge_kill(plan, case.moment, usual[case.plan], prepared, _place(folder))
        when = f"{plan.name} {' '.join(plan.arguments)}, killed after {case.moment:.0%}"
        detail = f"{when}: {verdict.detail}" if verdict.fault else ""
        return {**verdict.as_json(), "detail": detail}

    def keep(case: kills.KillCase, place: Path) -> None:
        (place / "call.txt").write_text(f"{PLANS[case.plan]}\nkilled after {case.moment:.3f}\n")

    return Part(
        name="kills",
        cases=[kill_case(seed, number) for number in range(count)],
        key=lambda case: str(case.number),
        family=lambda case: PLANS[case.plan].name,
        judge=judge,
        keep=keep,
        limits=Limits(cpu_seconds=60, memory_bytes=None),
        begin=measure,
    )


def _place(folder: Path) -> Path:
    return Path(tempfile.mkdtemp(prefix="kill-", dir=folder))
