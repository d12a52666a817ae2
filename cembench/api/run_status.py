"""How far a run is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cembench.results.comparison import latest
from cembench.results.machines import machine_of_record
from cembench.results.records import Cell, Record
from cembench.results.stability import scatter_words, stability_words
from cembench.results.store import Store
from cembench.results.verify import Depth, Finding, Kind, verify
from cembench.running.cluster.state import read_state


@dataclass(frozen=True)
class CellState:
    """State of a cell: a status, "waiting", "in work" or "damaged", and a remark."""

    name: str
    detail: str = ""

    def __str__(self) -> str:
        return f"{self.name}: {self.detail}" if self.detail else self.name


@dataclass(frozen=True)
class RunStatus:
    """How far a run is.

    Parameters
    ----------
    cells : tuple of Cell and CellState
        The cells of the last request, in order.
    findings : tuple of Finding
        What is wrong with the files of the run, or, if all are verified, cannot be compared.
    about : mapping
        Everything as plain data, as ``cembench status --json`` prints it.

    Examples
    --------
    >>> import cembench
    >>> run = cembench.benchmark(["flat-disk"], ["lscm"], faces=200, rounds=1)
    >>> [str(state) for _, state in run.status().cells]
    ['ok']
    """

    cells: tuple[tuple[Cell, CellState], ...]
    findings: tuple[Finding, ...]
    about: Mapping[str, Any] = field(repr=False)


def status_of(run: Path, *, everything: bool) -> RunStatus:
    """Return how far a run is; raise :class:`RecordError` if there is no such folder."""
    store = Store(run)
    store.check_is_there()
    verified = verify(store, Depth.everything if everything else Depth.sample)
    held = {record.cell.label: record for record in verified.records}
    damaged = {f.file.stem for f in verified.findings if f.kind is Kind.damaged} - held.keys()
    asked = store.plan() or [record.cell for record in held.values()]
    states = {cell.label: _state(store, held.get(cell.label), cell) for cell in asked}
    states |= dict.fromkeys(damaged & states.keys(), CellState("damaged"))
    shown = verified.findings if everything else verified.disagreements
    counted, cluster = latest(verified.records), read_state(run)
    environments = store.environments()
    machines = Counter(machine_of_record(record, environments) for record in verified.records)
    about = {
        "run": str(run),
        "measuring": store.is_locked(),
        "asked": len(asked),
        "states": dict(Counter(state.name for state in states.values())),
        "recorded_besides": len(held.keys() - states.keys()),
        "cells": [
            {"key": c.key, "mesh": c.mesh, "algorithm": c.algorithm, "state": str(states[c.label])}
            for c in asked
        ],
        "findings": [
            {"record": f.file.name, "kind": f.kind, "disagrees": f.disagrees, "detail": f.detail}
            for f in shown
        ],
        "machines": {"cells": dict(machines), "cluster": cluster and cluster.model_dump()},
        "superseded": len(verified.records) - len(counted),
        "stability": stability_words(counted),
        "scatter": scatter_words(counted),
    }
    return RunStatus(tuple((cell, states[cell.label]) for cell in asked), shown, about)


def _state(store: Store, record: Record | None, cell: Cell) -> CellState:
    if record is not None:
        return CellState(record.outcome.status, record.outcome.cause or "")
    rounds = store.rounds_done(cell)
    if rounds is None:
        return CellState("waiting")
    if cell.precision is not None:
        more = f"as many as ±{100 * cell.precision:g} % takes"
        return CellState("in work", f"{rounds} rounds done, of {more}")
    return CellState("in work", f"{rounds} of {cell.repeats} rounds done")
