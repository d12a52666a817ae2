"""The command `status`: how far a run is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from cembench.api import benchmark
from cembench.commands.app import app
from cembench.commands.console import Json, fail, note, out, print_json
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import DEFAULT_RUN, Run

if TYPE_CHECKING:
    from cembench.api.run_status import RunStatus


@app.command(epilog="Example:  cembench status results/run; it ends with 1 if a file was changed")
@from_api(benchmark.Run.status, without=("self",))
def status(call: Call, run: Run = DEFAULT_RUN, *, as_json: Json = False) -> None:
    """Print it; exit with 1 if a record or a map no longer agrees with its recorded figures."""
    found = call(benchmark.Run(run))
    if as_json:
        print_json(found.about)
    else:
        _show(found)
    fail(str(finding) for finding in found.findings if finding.disagrees)


def _show(found: RunStatus) -> None:
    from cembench.report.render.terminal import status_style

    about = found.about
    out.print(_MEASURING[about["measuring"]])
    for state, count in sorted(about["states"].items(), key=lambda item: -item[1]):
        out.print(f"{count:>6}  {state}", style=status_style(state) if state == "ok" else "")
    if others := about["recorded_besides"]:
        out.print(f"{others:>6}  other records, not part of the last request")
    if about["superseded"]:
        out.print(f"{about['superseded']:>6}  older records of cells measured again")
    _show_machines(about["machines"])
    for words in filter(None, (about["stability"], about["scatter"])):
        out.print(words)
    for cell, state in found.cells:
        if state.name not in ("ok", "waiting"):
            line = f"{cell.mesh} / {cell.algorithm} ({cell.solves}): {state}"
            out.print(line, soft_wrap=True)
    for finding in about["findings"]:
        if not finding["disagrees"]:
            note(f"{finding['record']}: {finding['detail']}")


def _show_machines(about: Mapping[str, Any]) -> None:
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
