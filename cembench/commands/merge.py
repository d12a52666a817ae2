"""The command `merge`: several runs as one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cembench.api.merge import merge as merge_runs
from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, out, print_json, warn
from cembench.commands.from_api import Call, from_api

if TYPE_CHECKING:
    from cembench.results.merging import Conflict


@app.command(epilog="Example:  cembench merge results/a results/b -o results/both")
@from_api(merge_runs, without=("reporter",), runs="RUN", require_signed="--require-signed SIGNERS")
def merge(call: Call, *, as_json: Json = False) -> None:
    """Print how many cells the run holds, and which of them several machines measured."""
    merged = call(reporter=SHOWN)
    if as_json:
        print_json(merged.as_dict())
    else:
        out.print(f"{merged.cells} cells in {merged.output}", soft_wrap=True)
        _show_conflicts(merged.conflicts, merged.output)
    if len(merged.environments) > 1:
        warn(
            f"measured in {len(merged.environments)} environments, on {len(merged.machines)} "
            "machines; only ratios measured in one sitting can be compared"
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
