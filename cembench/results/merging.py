"""Merge runs from different machines or days into one folder.

What several machines measured of one surface under one policy is never mixed: one machine's cells
stand in the run, and the same cells of the others beside it, each machine's as a run of its own in
``RUN/others/<machine>``, which every verb takes.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cembench.core.loading import check_no_link, files_in
from cembench.core.names import file_name
from cembench.results.comparison import circumstances
from cembench.results.exhibits import copy_exhibits
from cembench.results.machines import machine_of_record
from cembench.results.records import Record
from cembench.results.store import Store


@dataclass(frozen=True)
class Held:
    """A record, the run that holds it, and its machine."""

    record: Record
    run: Store
    machine: str

    @property
    def rank(self) -> tuple[bool, str]:
        """Records that ended ok come first, then the later ones."""
        return self.record.outcome.status == "ok", self.record.started_at


@dataclass(frozen=True)
class Conflict:
    """A cell that several machines measured: the one kept in the run comes first."""

    cell: str
    machines: tuple[str, ...]
    statuses: tuple[str, ...]
    seconds: tuple[float | None, ...]
    #: Whether all have the same map, to the bit; None where one has none.
    same_map: bool | None

    def __str__(self) -> str:
        shown = ", ".join(
            f"{name or 'not named'} {status}{'' if s is None else f' {s:.3g} s'}"
            for name, status, s in zip(self.machines, self.statuses, self.seconds, strict=True)
        )
        return f"{self.cell}: {shown}{'; other maps' if self.same_map is False else ''}"


@dataclass(frozen=True)
class Merged:
    """The result: how many cells the run holds, and which of them other runs hold, too."""

    cells: int
    conflicts: tuple[Conflict, ...]


def merge(runs: Iterable[Store], into: Store) -> Merged:
    """Merge the records and exhibits of several runs. All records are read before any is written.

    Of a cell that was measured on one machine several times, one that ended ok counts before one
    that did not, and then the later one. Of several machines the one counts that has more cells of
    the surface ok, and then the later one.
    """
    read = [(run, run.records(), run.environments()) for run in runs]
    with into.locked():
        every = [*read, (into, into.finished(), into.environments())]
        for one in others_of(into):
            every.append((one, one.finished(), one.environments()))
        best = _best(every)
        cells: dict[str, dict[str, Held]] = defaultdict(dict)
        for (key, machine), held in best.items():
            cells[key][machine] = held
        leaders = _leaders(best)
        conflicts = []
        for by_machine in cells.values():
            leader = leaders[circumstances(next(iter(by_machine.values())).record.cell)]
            ordered = sorted(by_machine.values(), key=lambda held: held.rank, reverse=True)
            ordered.sort(key=lambda held: held.machine != leader)
            for other in ordered[1:]:  # first, as one of them may stand in the run now
                _copy(other, _beside(into, other.machine))
            _copy(ordered[0], into)
            _beside(into, ordered[0].machine).forget(ordered[0].record.cell)
            if len(ordered) > 1:
                conflicts.append(_conflict(ordered))
        for run, *_ in read:
            copy_exhibits(run.folder, into.folder)
        return Merged(len(cells), tuple(conflicts))


def others_of(run: Store) -> list[Store]:
    """Return the runs of other machines that are stored beside a merged run.

    Raises
    ------
    RecordError
        One of them is a link.
    """
    files = files_in(run.folder / "others", "*", run.folder)
    for folder in files:
        check_no_link(folder, run.folder)
    return [Store(folder) for folder in files if folder.is_dir()]


def _beside(into: Store, machine: str) -> Store:
    return Store(into.folder / "others" / file_name(machine or "not-named", 100))


def _best(
    held_by_runs: Sequence[tuple[Store, Sequence[Record], Mapping[str, dict[str, Any]]]],
) -> dict[tuple[str, str], Held]:
    best: dict[tuple[str, str], Held] = {}
    for run, records, environments in held_by_runs:
        for record in records:
            held = Held(record, run, machine_of_record(record, environments))
            place = record.cell.key, held.machine
            if place not in best or best[place].rank < held.rank:
                best[place] = held
    return best


def _leaders(best: Mapping[tuple[str, str], Held]) -> dict[str, str]:
    """Return the machine whose cells the run takes, by surface and policy."""
    oks: dict[str, dict[str, list[tuple[bool, str]]]] = defaultdict(lambda: defaultdict(list))
    for held in best.values():
        oks[circumstances(held.record.cell)][held.machine].append(held.rank)
    return {
        where: max(
            machines, key=lambda name: (sum(ok for ok, _ in machines[name]), max(machines[name]))
        )
        for where, machines in oks.items()
    }


def _copy(held: Held, into: Store) -> None:
    if held.run.folder == into.folder:
        return
    environments = held.run.environments()
    environment = environments.get(held.record.environment, {"id": held.record.environment})
    into.save(held.record, held.run.uv(held.record.cell), environment)
    mesh = held.run.mesh(held.record.cell)
    if mesh is not None:
        into.save_mesh(mesh)


def _conflict(ordered: Sequence[Held]) -> Conflict:
    outcomes = [held.record.outcome for held in ordered]
    cell = ordered[0].record.cell
    hashes = [outcome.uv_hash for outcome in outcomes]
    return Conflict(
        f"{cell.mesh} / {cell.algorithm} ({cell.solves})",
        tuple(held.machine for held in ordered),
        tuple(outcome.status for outcome in outcomes),
        tuple(outcome.median_seconds for outcome in outcomes),
        None if None in hashes else len(set(hashes)) == 1,
    )
