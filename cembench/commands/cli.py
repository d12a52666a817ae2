"""The command line. Exit code 0 if every cell ended ok, 1 if one did not, 2 on wrong usage.

Other codes (a closed pipe, a signal, a fault of cembench itself) are in
:mod:`cembench.commands.exit_codes`.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer
from rich.text import Text

from cembench.api.catalogue import catalogue
from cembench.commands import benchmark as benchmark_verbs
from cembench.commands import cut as cut_verbs
from cembench.commands import fetch as fetch_verbs
from cembench.commands import holes as holes_verbs
from cembench.commands import map as map_verbs
from cembench.commands import morph as morph_verbs
from cembench.commands import peers as peers_verbs
from cembench.commands import publish as publish_verbs
from cembench.commands import repair as repair_verbs
from cembench.commands import report as report_verbs
from cembench.commands import reproduce as reproduce_verbs
from cembench.commands import run as run_verbs
from cembench.commands import sign as sign_verbs
from cembench.commands import submit as submit_verbs
from cembench.commands import theory as theory_verbs
from cembench.commands import validate as validate_verbs
from cembench.commands.console import SHOWN, Json, err, out, print_json
from cembench.commands.exit_codes import Verbs, ending
from cembench.commands.from_api import Call, from_api

app = typer.Typer(
    cls=Verbs,
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Benchmark conformal parameterizations of surfaces: fair, checked, repeatable.",
)


def _print_version(asked: bool) -> None:
    if asked:
        from cembench.core.version import installed_version

        out.print(f"cembench {installed_version()}")
        raise typer.Exit


@app.callback()
def _global_options(
    *,
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    """Handle the options that belong to no command."""


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

    found = call(reporter=SHOWN)
    if as_json:
        print_json(found.as_dict())
        return
    if found.algorithms is not None:
        out.print(algorithms_table(found.algorithms, verbose=verbose))
        if found.peers:
            words = f"\nSolvers by others (see `cembench peers`): {', '.join(found.peers)}"
            out.print(words, style="dim")
        if found.surfaces is not None:
            out.print()
    if found.surfaces is not None:
        out.print(surfaces_table(found.surfaces, verbose=verbose))
    known = {name: facts for name, facts in found.facts.items() if facts}
    if known:
        from cembench.report.surface_facts import facts_table

        out.print()
        out.print(facts_table(known))
    missing = len(found.facts) - len(known)
    if missing:
        out.print(
            f"\n{missing} of {len(found.facts)} stand-ins are not measured yet: "
            "run `cembench list surfaces --measure` (takes minutes).",
            style="dim",
        )


app.command("map", epilog=map_verbs.EXAMPLES)(map_verbs.map_)
for _verb, _example in benchmark_verbs.VERBS:
    app.command(epilog=_example)(_verb)


#: How `doctor` marks what is not ok, by whether it is required.
_MARKS = {True: ("bad", "bold red"), False: ("--", "yellow")}


@app.command(epilog="Example:  cembench doctor --json")
def doctor(*, as_json: Json = False) -> None:
    """Check the installation, and say how to install what is missing."""
    from cembench.api.doctor import examine

    with err.status("checking", spinner="line"):
        findings = examine()
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


#: Modules that hold the other commands.
_MORE = (
    reproduce_verbs,
    run_verbs,
    report_verbs,
    publish_verbs,
    sign_verbs,
    submit_verbs,
    validate_verbs,
    holes_verbs,
    theory_verbs,
    morph_verbs,
    fetch_verbs,
    repair_verbs,
    cut_verbs,
    peers_verbs,
)
for verb, example in (entry for module in _MORE for entry in module.VERBS):
    app.command(epilog=example)(verb)


def main() -> None:
    """Run the command line; :mod:`cembench.commands.exit_codes` chooses the exit code."""
    with ending():
        app()


if __name__ == "__main__":
    main()
