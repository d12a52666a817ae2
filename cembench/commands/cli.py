"""The command line. Exit code 0 if every cell ended ok, 1 if one did not, 2 on wrong usage.

Other codes (a closed pipe, a signal, a fault of cembench itself) are in
:mod:`cembench.commands.exit_codes`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from cembench.api.catalogue import list_algorithms
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
from cembench.commands import theory as theory_verbs
from cembench.commands import validate as validate_verbs
from cembench.commands.console import Json, err, out, print_json, registry_with
from cembench.commands.exit_codes import Verbs, ending
from cembench.commands.from_api import Call, from_api
from cembench.core.errors import ParameterError

if TYPE_CHECKING:
    from cembench.registry import Algorithm, Registry, Surface
    from cembench.report.surface_facts import SurfaceFacts

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


class Kind(StrEnum):
    """The kinds of things that `list` lists."""

    algorithms = "algorithms"
    surfaces = "surfaces"


@app.command(
    "list",
    epilog="Examples:  cembench list  ·  cembench list algorithms --verbose  ·  "
    "cembench list surfaces --measure  ·  cembench list --plugin mine.py",
)
@from_api(list_algorithms, only=("plugins",))
def list_(
    call: Call,
    kind: Annotated[Kind | None, typer.Argument(help="List only these.")] = None,
    *,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Show all details.")] = False,
    measure: Annotated[
        bool,
        typer.Option("--measure", help="Measure the stand-ins not yet measured (takes minutes)."),
    ] = False,
    as_json: Json = False,
) -> None:
    """List the algorithms and surfaces.

    `list surfaces` also describes the stand-ins for the paper's models: their
    counts, whether these match the printed ones, how unevenly CEM scales
    them, and where their thumbnails are. Only stand-ins that were measured are
    shown; --measure measures the others.
    """
    from cembench.report.listings import algorithms_table, surfaces_table

    registry = registry_with(call.keywords["plugins"])
    if measure and kind is not Kind.surfaces:
        raise ParameterError("--measure is only for surfaces: cembench list surfaces --measure.")
    facts = _facts(registry, measure=measure) if kind is Kind.surfaces else {}
    if as_json:
        print_json(_registry_as_json(registry, kind, facts))
        return
    if kind in (None, Kind.algorithms):
        out.print(algorithms_table(call(), verbose=verbose))
        if registry.peers:
            words = f"\nSolvers by others (see `cembench peers`): {', '.join(registry.peers)}"
            out.print(words, style="dim")
    if kind is None:
        out.print()
    if kind in (None, Kind.surfaces):
        out.print(surfaces_table(list(registry.surfaces.values()), verbose=verbose))
    if facts:
        from cembench.report.surface_facts import facts_table

        known = {name: found for name, found in facts.items() if found}
        if known:
            out.print()
            out.print(facts_table(known))
        missing = len(facts) - len(known)
        if missing:
            out.print(
                f"\n{missing} of {len(facts)} stand-ins are not measured yet: "
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


def _facts(registry: Registry, *, measure: bool) -> dict[str, SurfaceFacts | None]:
    """Return the recorded facts of each kept surface; with `measure`, find the missing ones."""
    from cembench.report.surface_facts import find_facts, kept_facts

    families = [family for family in registry.surfaces.values() if family.kept]
    facts = {family.name: kept_facts(registry, family) for family in families}
    todo = [family for family in families if measure and facts[family.name] is None]
    for k, family in enumerate(todo, start=1):
        words = f"[{k}/{len(todo)}] {family.name}"
        if not err.is_terminal:
            err.print(words)
        with err.status(f"{words}: making, mapping, drawing", spinner="line"):
            facts[family.name] = find_facts(registry, family)
    return facts


def _registry_as_json(
    registry: Registry, kind: Kind | None, facts: Mapping[str, SurfaceFacts | None]
) -> dict[str, Any]:
    from cembench.report.surface_facts import row_check

    def about(registered: Any) -> dict[str, Any]:
        return {
            "name": registered.name,
            "title": registered.title,
            "source": registered.source,
            "parameters": {p.name: p.default for p in registered.parameters},
            "notes": registered.notes,
            "origin": registered.origin,
        }

    def about_algorithm(a: Algorithm) -> dict[str, Any]:
        more = {"target": a.target, "takes": a.mesh_type.__name__}
        return about(a) | more | {"usual": a.usual, "conformal": a.conformal}

    def about_surface(s: Surface) -> dict[str, Any]:
        known = facts.get(s.name)
        more = {"paper_row": s.paper_row or None, "landmarks": s.landmarks is not None}
        if known is None:
            return about(s) | more | {"facts": None}
        flat = known.mesh.model_dump() | known.model_dump(exclude={"mesh"})
        return about(s) | more | {"facts": flat | {"table2": row_check(known.mesh)}}

    listed: dict[str, Any] = {}
    if kind in (None, Kind.algorithms):
        listed["algorithms"] = [about_algorithm(a) for a in registry.algorithms.values()]
    if kind in (None, Kind.surfaces):
        listed["surfaces"] = [about_surface(s) for s in registry.surfaces.values()]
    return listed


def main() -> None:
    """Run the command line; :mod:`cembench.commands.exit_codes` chooses the exit code."""
    with ending():
        app()


if __name__ == "__main__":
    main()
