"""The command `compare`: two runs, or two versions of solvers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cembench.api.compare import compare_versions
from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, fail, note, out, print_json, split, warn
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import Junit, Meshes, Surfaces, Verify
from cembench.core.errors import ParameterError, RecordError

if TYPE_CHECKING:
    from cembench.report.junit import Check
    from cembench.results.regressions import Regression
    from cembench.results.runs_compared import Change, Row

Compared = Annotated[
    str | None,
    typer.Argument(help="A run's folder or a report's; with -a, a commit or a plug-in file."),
]


@app.command(
    epilog="Examples:  cembench compare results/before results/after  ·  "
    "cembench compare HEAD~1 HEAD -a cem,direct-cem --fail-on slower,worse,invalid  ·  "
    "cembench compare old.py new.py -a mine --surfaces cone  ·  "
    "cembench compare --env old=old/bin/python --env new=new/bin/python -a mine"
)
@from_api(
    compare_versions,
    only=(
        *("algorithms", "env", "plugins", "sets", "limit", "faces", "rounds", "seed", "timeout"),
        *("threads", "output"),
    ),
    sets="--set",
    env="--env NAME=PYTHON",
)
def compare(
    call: Call,
    before: Compared = None,
    after: Compared = None,
    *,
    mesh: Meshes = [],  # noqa: B006 - typer copies defaults
    surfaces: Surfaces = [],  # noqa: B006
    fail_on: Annotated[
        list[str],
        typer.Option(
            metavar="WHAT",
            help="End with exit code 1 if something is slower, worse or invalid. Comma-separated.",
        ),
    ] = [],  # noqa: B006
    junit: Junit = None,
    verify: Verify = False,
    as_json: Json = False,
) -> None:
    """Show what became faster, slower or worse from one run, or version of solvers, to another.

    With -a NAME, two versions of solvers are measured: two commits of the
    repository in the current folder, two plug-in files, or two environments
    (--env). Each round measures both, in random order, in fresh processes.

    Without -a, two runs are compared. Their seconds are divided by those of a
    reference kernel, which every round times; this removes the machine's drift
    between the runs, as far as it affects the kernel. The test is a rank-sum
    test at the 5 % level. To compare two algorithms, measure both in one run;
    what the two runs say of that is compared too. A report with its records.csv
    stands for its run.
    """
    from cembench.report.junit import check_junit, write_junit
    from cembench.results.regressions import check_kinds, regressions

    check_kinds(kinds := split(fail_on))
    if junit:
        check_junit(junit, "compare")
    if call.keywords["algorithms"] or call.keywords["env"]:
        found = call(before, after, surfaces=[*mesh, *split(surfaces)], reporter=SHOWN)
        cells, changes = found.cells, found.changes
        _show_versions(found, as_json=as_json)
    else:
        cells, changes = _show_runs(before, after, verify=verify, as_json=as_json)
    bad = regressions(cells, changes, kinds)
    if junit:
        write_junit(junit, "compare", _checks(cells, bad, kinds))
    fail(map(str, bad))


def _checks(
    cells: Iterable[tuple[Row, Row]], bad: Sequence[Regression], kinds: Sequence[str]
) -> Iterator[Check]:
    """Yield a check for each kind of regression of each algorithm on each surface."""
    from cembench.report.junit import Check

    places = [(after["algorithm"], after["mesh"]) for _, after in cells]
    places += [(one.algorithm, one.surface) for one in bad]
    for kind, (name, surface) in product(kinds, dict.fromkeys(places)):
        here = [x.detail for x in bad if (x.kind, x.algorithm, x.surface) == (kind, name, surface)]
        yield Check(f"not {kind}", name, surface, "; ".join(here) or None)


def _show_versions(found: Any, *, as_json: bool) -> None:
    from cembench.report.run_tables import changes_table, maps_table

    if as_json:
        about = {"versions": found.versions, "run": str(found.run.folder)}
        print_json(about | {"cells": _rows(found.changes), "maps": _maps(found.cells)})
        return
    out.print(changes_table(found.changes, paired=True), "", maps_table(found.cells), sep="\n")
    out.print(f"\nbefore: {found.versions[0]}\nafter: {found.versions[1]}", soft_wrap=True)
    out.print(f"Records and maps: {found.run.folder.resolve()}", soft_wrap=True)


def _show_runs(
    before: str | None, after: str | None, *, verify: bool, as_json: bool
) -> tuple[list[tuple[Row, Row]], list[Change]]:
    """Show what changed between two runs; return their common cells, and the changes."""
    from cembench.report.run_tables import changes_table
    from cembench.results.machines import COMPARED, differences
    from cembench.results.runs_compared import common_cells, compare_runs

    if before is None or after is None:
        raise ParameterError(
            "name two folders of runs; or name solvers by -a, and two versions: cembench compare "
            "HEAD~1 HEAD -a cem."
        )
    (old, earlier, older), (new, later, more) = (
        _run(Path(one), verify=verify) for one in (before, after)
    )
    changes = compare_runs(old, new)
    if not changes:
        raise RecordError(
            f"{before} and {after} have no timed cell in common: the same algorithm with the same "
            "parameters on the same surface, solves, backend and threads."
        )
    pairs = {(c.before["environment"], c.after["environment"]) for c in changes}
    known = [(earlier[b], later[a]) for b, a in pairs if b in earlier and a in later]
    differing = sorted({d for one, other in known for d in differences(one, other, COMPARED)})
    if as_json:
        rows = _rows(changes)
        print_json({"differences": differing, "superseded": [older, more], "cells": rows})
    else:
        out.print(changes_table(changes))
    if older + more:
        note(f"left out: {older + more} older records of cells measured again")
    if differing:
        warn("the runs were measured under different conditions; their seconds are not comparable")
        for difference in differing:
            warn(difference)
    if not known:
        note("whether the machines are alike is unknown: a report's records do not describe them")
    return common_cells(old, new), changes


def _rows(changes: Sequence[Change]) -> list[dict[str, Any]]:
    """Return the changes of seconds as plain data."""
    from cembench.results.multiple_testing import corrected

    together = corrected([c.comparison for c in changes])
    return [
        {
            **{name: c.after[name] for name in ("mesh", "algorithm", "solves")},
            **{"seconds_before": c.before["seconds"], "seconds_after": c.after["seconds"]},
            **asdict(c.comparison),
            **{"verdict_corrected": both.verdict, "drift": c.drift, "verdicts": c.verdicts},
        }
        for c, both in zip(changes, together, strict=True)
    ]


def _maps(cells: Iterable[tuple[Row, Row]]) -> list[dict[str, Any]]:
    """Return status and figures of the maps of both versions as plain data."""
    from cembench.results.regressions import figures_of

    return [
        {
            **{name: after[name] for name in ("mesh", "algorithm")},
            **{"status_before": before["status"], "status_after": after["status"]},
            **{"before": figures_of(before, after), "after": figures_of(after, before)},
        }
        for before, after in cells
    ]


def _run(
    folder: Path, *, verify: bool
) -> tuple[list[dict[str, Any]], Mapping[str, Mapping[str, Any]], int]:
    """Return the rows of a run or a report, the run's environments, and how many it leaves out."""
    from cembench.results.columns import rows
    from cembench.results.comparison import latest
    from cembench.results.report_records import has_records, read_rows
    from cembench.results.store import Store
    from cembench.results.verify import Depth, sound_records

    if has_records(folder):
        return read_rows(folder), {}, 0
    store = Store(folder)
    records = sound_records(store, Depth.everything if verify else Depth.records)
    kept = {record.cell.key for record in latest(records)}
    compared = [row for row in rows(records) if row["key"] in kept]
    return compared, store.environments(), len(records) - len(compared)
