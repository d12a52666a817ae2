"""The commands on existing runs: status, show, merge and export."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, fail, note, out, print_json, print_pair, warn
from cembench.commands.options import DEFAULT_RUN, Force, RequireSigned, Run, Verify
from cembench.core.errors import ParameterError, RecordError
from cembench.core.overwriting import refuse_inputs
from cembench.report.export_format import Format

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cembench.results.merging import Conflict
    from cembench.results.records import Cell, Record
    from cembench.results.store import Store


@app.command(epilog="Example:  cembench status results/run")
def status(run: Run = DEFAULT_RUN, *, verify: Verify = False, as_json: Json = False) -> None:
    """Show a run's progress, the cells that did not end ok, and files that were changed.

    The exit code is 1 if a record or a map no longer agrees with its recorded
    figures.
    """
    from cembench.results.comparison import latest
    from cembench.results.stability import scatter_words, stability_words
    from cembench.results.store import Store
    from cembench.results.verify import Depth, Kind
    from cembench.results.verify import verify as verify_run

    store = Store(run)
    store.check_is_there()
    verified = verify_run(store, Depth.everything if verify else Depth.sample)
    held = {record.cell.label: record for record in verified.records}
    damaged = {f.file.stem for f in verified.findings if f.kind is Kind.damaged} - held.keys()
    asked = store.plan() or [record.cell for record in held.values()]
    states = {cell.label: _state(store, held.get(cell.label), cell) for cell in asked}
    states |= dict.fromkeys(damaged & states.keys(), CellState("damaged"))
    shown = verified.findings if verify else verified.disagreements
    others = [record for label, record in held.items() if label not in states]
    about: dict[str, Any] = {
        "run": str(run),
        "measuring": store.is_locked(),
        "asked": len(asked),
        "states": dict(Counter(state.name for state in states.values())),
        "recorded_besides": len(others),
        "cells": [
            {"key": c.key, "mesh": c.mesh, "algorithm": c.algorithm, "state": str(states[c.label])}
            for c in asked
        ],
        "findings": [
            {"record": f.file.name, "kind": f.kind, "disagrees": f.disagrees, "detail": f.detail}
            for f in shown
        ],
    }
    about["machines"] = machines_of(store, verified.records)
    counted = latest(verified.records)
    about["superseded"] = len(verified.records) - len(counted)
    about["stability"], about["scatter"] = stability_words(counted), scatter_words(counted)
    if as_json:
        print_json(about)
    else:
        _show_status(about, others, [(cell, states[cell.label]) for cell in asked])
    fail(map(str, verified.disagreements))


def _show_status(
    about: dict[str, Any], others: list[Record], cells: list[tuple[Cell, CellState]]
) -> None:
    from cembench.report.render.terminal import status_style

    out.print(_MEASURING[about["measuring"]])
    for state, count in sorted(about["states"].items(), key=lambda item: -item[1]):
        out.print(f"{count:>6}  {state}", style=status_style(state) if state == "ok" else "")
    if others:
        out.print(f"{len(others):>6}  other records, not part of the last request")
    if about["superseded"]:
        out.print(f"{about['superseded']:>6}  older records of cells measured again")
    _show_machines(about["machines"])
    for words in filter(None, (about["stability"], about["scatter"])):
        out.print(words)
    for cell, state in cells:
        if state.name not in ("ok", "waiting"):
            line = f"{cell.mesh} / {cell.algorithm} ({cell.solves}): {state}"
            out.print(line, soft_wrap=True)
    for finding in about["findings"]:
        if not finding["disagrees"]:
            note(f"{finding['record']}: {finding['detail']}")


def machines_of(store: Store, records: Iterable[Record]) -> dict[str, Any]:
    """Return how many cells each machine measured; of a run on a cluster, how far that is."""
    from cembench.results.machines import machine_of_record
    from cembench.running.cluster.state import read_state

    environments = store.environments()
    state = read_state(store.folder)
    return {
        "cells": dict(Counter(machine_of_record(record, environments) for record in records)),
        "cluster": None if state is None else state.model_dump(),
    }


def _show_machines(about: dict[str, Any]) -> None:
    from cembench.commands.progress import duration

    if len(about["cells"]) > 1:
        for name, count in sorted(about["cells"].items(), key=lambda item: -item[1]):
            out.print(f"{count:>6}  cells measured on {name or 'a machine without a name'}")
    state = about["cluster"]
    if state is None:
        return
    left = state["seconds_left"]
    at_work = state["done"] < state["units"]
    more = f", about {duration(left)} left" if at_work and left is not None else ""
    words = f"cluster: {state['done']} of {state['units']} surfaces with a policy are done{more}"
    out.print(f"{words} ({state['written_at']})", soft_wrap=True)
    for one in state["machines"]:
        at = "lost" if one["lost"] else (one["at"] or "idle") if at_work else ""
        out.print(f"{one['units']:>6}  by a worker on {one['machine']}  {at}", soft_wrap=True)


#: Messages on whether a run is writing to the folder; None: the lock cannot be opened.
_MEASURING = {
    True: "a run is writing to this folder",
    False: "no run is writing to this folder",
    None: "the folder is read-only, so it is unknown whether a run is writing to it",
}


@app.command(epilog="Examples:  cembench show face/cem  ·  cembench show 3fa9 --run results/mine")
def show(
    cell: Annotated[str, typer.Argument(help="The start of a cell's key, or MESH/ALGORITHM.")],
    *,
    run: Annotated[Path, typer.Option("--run", help="The run's folder.")] = DEFAULT_RUN,
    as_json: Json = False,
) -> None:
    """Show everything that is recorded about a cell."""
    from cembench.results.columns import row
    from cembench.results.store import Store
    from cembench.results.verify import Depth, sound_records, verify_map

    if cell and Path(cell).is_dir():
        raise ParameterError(
            f"{cell} is a folder, and show takes a cell: cembench show CELL --run {cell}. "
            f"cembench status {cell} lists its cells."
        )
    store = Store(run)
    records = _chosen(sound_records(store, Depth.records), cell)
    findings = [
        f for record in records for f in verify_map(store, store.record_file(record.cell), record)
    ]
    if as_json:
        print_json([row(record) for record in records])
    else:
        _show_records(records)
    fail(str(finding) for finding in findings if finding.disagrees)


def _show_records(records: list[Record]) -> None:
    from cembench.report.record_table import figures_table
    from cembench.results.columns import significant

    for record in records:
        outcome = record.outcome
        print_pair(outcome.status, f"{record.cell.solves}  {record.cell.key[:12]}")
        out.print(figures_table(record))
        for number, r in enumerate(outcome.rounds, start=1):
            calls = " ".join(significant(seconds, 4) for seconds in r.calls)
            out.print(f"round {number:<3} {r.started_at}  {calls}")
        for words in filter(None, (outcome.cause, outcome.traceback)):
            out.print(words, soft_wrap=True)


@app.command(epilog="Example:  cembench merge results/a results/b -o results/both")
def merge(
    runs: Annotated[list[Path], typer.Argument(help="The runs' folders.")],
    *,
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the merged run.")],
    force: Force = False,
    verify: Verify = False,
    require_signed: RequireSigned = None,
    as_json: Json = False,
) -> None:
    """Merge the records and exhibits of several runs into one folder.

    If several runs hold a cell, a record that ended ok is preferred, then the
    later one. Cells of several machines are not mixed: those of one machine go
    into the run, the same cells of others into runs of their own, in
    OUTPUT/others.
    """
    from dataclasses import asdict

    from cembench.results.machines import machine_of
    from cembench.results.merging import merge as merged
    from cembench.results.signing import signers_of
    from cembench.results.store import Store
    from cembench.results.verify import Depth, sound_records

    if output.exists() and all(run.exists() and run.samefile(output) for run in runs):
        raise ParameterError(f"{output} is the only run: name another one to merge into it.")
    refuse_inputs(output, runs, force=force)
    signers_of(runs, require_signed, SHOWN)
    into = Store(output)
    depth = Depth.everything if verify else Depth.sample
    for run in runs:
        sound_records(Store(run), depth)
    if (output / "records").is_dir():
        sound_records(into, depth)
    joined = merged([Store(run) for run in runs], into)
    used = sorted({record.environment for record in into.records()})
    environments = into.environments()
    machines = sorted({machine_of(environments.get(key, {})) for key in used})
    if as_json:
        summary = {"output": str(output), "cells": joined.cells, "environments": used}
        conflicts = [asdict(conflict) for conflict in joined.conflicts]
        print_json(summary | {"machines": machines, "conflicts": conflicts})
    else:
        out.print(f"{joined.cells} cells in {output}", soft_wrap=True)
        _show_conflicts(joined.conflicts, output)
    if len(used) > 1:
        warn(
            f"measured in {len(used)} environments, on {len(machines)} machines; only ratios "
            "measured in one sitting can be compared"
        )


#: So many conflicts are named on the terminal.
NAMED = 10


def _show_conflicts(conflicts: Sequence[Conflict], output: Path) -> None:
    if not conflicts:
        return
    out.print(
        f"{len(conflicts)} cells were measured on several machines; the first one named is kept in "
        f"the run, the others in {output / 'others'}:",
        soft_wrap=True,
    )
    for conflict in conflicts[:NAMED]:
        out.print(f"  {conflict}", soft_wrap=True)
    if len(conflicts) > NAMED:
        out.print(f"  and {len(conflicts) - NAMED} more: --json names all")


@app.command(epilog="Example:  cembench export results/run --format parquet")
def export(
    run: Run = DEFAULT_RUN,
    *,
    form: Annotated[Format, typer.Option("--format", help="File format.")] = Format.csv,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Output file (default: RUN/rows.FORMAT).")
    ] = None,
    verify: Verify = False,
    as_json: Json = False,
) -> None:
    """Write all records of a run as one table, one row per cell."""
    from cembench.report.export import export_rows
    from cembench.results.columns import rows
    from cembench.results.run_folder import is_own
    from cembench.results.store import Store
    from cembench.results.verify import Depth, sound_records

    path = output or run / f"rows.{form.value}"
    if is_own(run, path):
        raise ParameterError(f"-o {path} is one of the run's own files; name another file.")
    exported = rows(sound_records(Store(run), Depth.everything if verify else Depth.records))
    export_rows(exported, path, form)
    if as_json:
        print_json({"output": str(path), "rows": len(exported)})
    else:
        out.print(f"{len(exported)} rows in {path}", soft_wrap=True)


@dataclass(frozen=True)
class CellState:
    """State of a cell: a status, "waiting", "in work" or "damaged", and a remark."""

    name: str
    detail: str = ""

    def __str__(self) -> str:
        return f"{self.name}: {self.detail}" if self.detail else self.name


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


def _chosen(records: list[Record], wanted: str) -> list[Record]:
    by_name = [r for r in records if f"{r.cell.mesh}/{r.cell.algorithm}" == wanted]
    records_of = by_name or [r for r in records if wanted and r.cell.key.startswith(wanted)]
    if not records_of:
        known = ", ".join(dict.fromkeys(f"{r.cell.mesh}/{r.cell.algorithm}" for r in records))
        raise RecordError(f"no cell {wanted!r} in this run; it holds: {known or 'nothing'}.")
    return records_of
