"""Runs over sets of surfaces: what `run --set` reads, prints and stores."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cembench.commands.console import err, note
from cembench.core.errors import ParameterError

if TYPE_CHECKING:
    from cembench.registry import Algorithm, Registry
    from cembench.workflows.providers import Provided
    from cembench.workflows.sets import Gathered

#: Maximum number of surfaces named on the terminal that cannot be measured.
NAMED = 5


def gather(
    sets: Sequence[str], registry: Registry, chosen: Sequence[Algorithm], limit: int | None
) -> Gathered:
    """Fetch and read the surfaces of the sets, and print which cannot be measured.

    Raises
    ------
    ParameterError
        A set is unknown, or none of its surfaces can be measured.

    """
    from cembench.commands.fetch import bars
    from cembench.workflows.sets import gathered, surfaces_of_set

    given: list[Provided] = []
    with bars([]) as progress:
        for name in dict.fromkeys(sets):
            err.print(f"reading the surfaces of {name}", style="dim", soft_wrap=True)
            given += surfaces_of_set(name, registry, limit=limit, progress=progress)
    found = gathered(given, registry, chosen)
    for one in found.refused[:NAMED]:
        note(f"{one.name} is left out: {_first_problem(one.error)}")
    more = len(found.refused) - NAMED
    if more > 0:
        note(f"{more} more are left out; the report lists them")
    if not found.surfaces:
        raise ParameterError(
            f"--set {', '.join(sets)} gives no surface that the chosen algorithms take; "
            "`cembench fetch --group disks` shows whether files can be fetched."
        )
    return found


def _first_problem(error: str) -> str:
    """Return the first of what may be several problems, one a line."""
    first, *more = error.splitlines() or [""]
    return f"{first} {more[0].strip()}{' ...' if len(more) > 1 else ''}" if more else first


def write_set_exhibit(run: Path, found: Gathered, sets: Sequence[str]) -> None:
    """Store in a run's folder which surfaces its sets gave, for the report."""
    from cembench.results.exhibits import write_exhibit
    from cembench.workflows.sets import exhibit_of

    write_exhibit(run, exhibit_of(found, sets, shlex.join(["cembench", *sys.argv[1:]])))
