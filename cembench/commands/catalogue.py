"""The commands `list` and `doctor`: what is registered, and what is installed."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer
from rich.text import Text

from cembench.api.catalogue import catalogue
from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, err, out, print_json
from cembench.commands.from_api import Call, from_api


@app.command(
    "list",
    epilog="Examples:  cembench list  ·  cembench list algorithms --verbose  ·  "
    "cembench list surfaces --measure  ·  cembench list --plugin mine.py",
)
@from_api(catalogue, without=("reporter",))
def list_(
    call: Call,
    *,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Show all details.")] = False,
    as_json: Json = False,
) -> None:
    """Print what is registered as tables."""
    from cembench.report.listings import algorithms_table, surfaces_table

    entries = call(reporter=SHOWN)
    if as_json:
        print_json(entries.as_dict())
        return
    if entries.algorithms is not None:
        out.print(algorithms_table(entries.algorithms, verbose=verbose))
        if entries.peers:
            words = f"\nSolvers by others (see `cembench peers`): {', '.join(entries.peers)}"
            out.print(words, style="dim")
        if entries.surfaces is not None:
            out.print()
    if entries.surfaces is not None:
        out.print(surfaces_table(entries.surfaces, verbose=verbose))
    known = {name: facts for name, facts in entries.facts.items() if facts}
    if known:
        from cembench.report.surface_facts import facts_table

        out.print()
        out.print(facts_table(known))
    missing = len(entries.facts) - len(known)
    if missing:
        out.print(
            f"\n{missing} of {len(entries.facts)} stand-ins are not measured yet: "
            "run `cembench list surfaces --measure` (takes minutes).",
            style="dim",
        )


#: How `doctor` marks what is not ok, by whether it is required.
_MARKS = {True: ("bad", "bold red"), False: ("--", "yellow")}


@app.command(epilog="Example:  cembench doctor --json")
def doctor(*, as_json: Json = False) -> None:
    """Check the installation, and say how to install what is missing."""
    from cembench.api.doctor import doctor as examined

    with err.status("checking", spinner="line"):
        findings = examined()
    if as_json:
        print_json([asdict(finding) for finding in findings])
    else:
        for finding in findings:
            mark = ("ok", "green") if finding.ok else _MARKS[finding.required]
            line = Text.assemble(mark).append(" " * (4 - len(mark[0])))
            out.print(line.append(f"{finding.name:<11}{finding.detail}"), soft_wrap=True)
            if not finding.ok:
                out.print(f"    {'':<11}{finding.remedy}", style="dim", soft_wrap=True)
    if any(finding.required and not finding.ok for finding in findings):
        raise typer.Exit(1)
