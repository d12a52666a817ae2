"""The application to which the modules of this package add their commands.

A command loads its own module alone: all of them take a tenth of a second.
"""

from __future__ import annotations

import re
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from cembench.commands.console import out
from cembench.commands.exit_codes import Verbs, ending

#: The modules that add commands, these in the order of the help, and the function that describes
#: each.
MODULES = {
    "catalogue": {"list": "api.catalogue:catalogue", "doctor": "api.doctor:doctor"},
    "measure": {"measure": "api.measure:measure"},
    "benchmark": {"run": "api.benchmark:benchmark"},
    "report": {"report": "api.benchmark:report"},
    "reproduce": {"reproduce": "api.reproduce:reproduce"},
    "status": {"status": "api.benchmark:status"},
    "show": {"show": "api.benchmark:show"},
    "merge": {"merge": "api.merge:merge"},
    "export": {"export": "api.benchmark:export"},
    "compare": {"compare": "commands.compare:compare"},
    "paper": {"paper": "commands.paper:paper"},
    "validate": {"validate": "api.validate:validate"},
    "peers": {"peers": "commands.peers:peers"},
    "fetch": {"fetch": "api.fetch:fetch"},
    "repair": {"repair": "api.repair:repair"},
    "cut": {"cut": "api.cut:cut"},
}
#: The verbs that the help shows before all others.
FIRST = ("list", "doctor", "map")
#: Options after which no command is called: their answer needs the first lines of the help alone.
OF_NO_COMMAND = ("-h", "--help", "-V", "--version")

app = typer.Typer(
    cls=Verbs,
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
            "--version", "-V", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    """Handle the options that belong to no command."""


def load(word: str = "") -> None:
    """Load the module of the command that a command line begins with; all if it is none."""
    if word in OF_NO_COMMAND:
        for verb, described in descriptions().items():
            app.command(verb, help=described)(_global_options)
        return
    own = [module for module, verbs in MODULES.items() if word in verbs]
    others = [entry for entry in brought() if entry.name == word]
    if not own and not others:
        own, others = [*MODULES], brought()
    for module in own:
        import_module(f"cembench.commands.{module}")
    for entry in others:
        from cembench.commands.exhibits import add

        add(entry)
    app.registered_commands.sort(key=lambda one: _place(one.name or one.callback.__name__))  # type: ignore[union-attr]


def brought() -> list[EntryPoint]:
    """Return the verbs that come by entry points, sorted by their names."""
    return sorted(entry_points(group="cembench.verbs"), key=lambda entry: entry.name)


def descriptions() -> dict[str, str]:
    """Return the first sentence of each command's help, read without importing its module."""
    own = {v: f"cembench.{where}" for verbs in MODULES.values() for v, where in verbs.items()}
    others = {entry.name: f"{entry.module}:{entry.attr or entry.name}" for entry in brought()}
    places = own | others
    return {verb: _first_line(*places[verb].split(":")) for verb in sorted(places, key=_place)}


def _place(verb: str) -> int:
    return FIRST.index(verb) if verb in FIRST else len(FIRST)


def _first_line(module: str, name: str) -> str:
    """Return the first paragraph of a function's docstring."""
    spec = find_spec(module)
    file = None if spec is None or spec.origin is None else Path(spec.origin)
    source = "" if file is None else file.read_text(encoding="utf-8")
    begin = re.search(rf'^ *def {name}\(.*?"""(.*?)(?:\n\n|""")', source, re.M | re.S)
    return " ".join(begin[1].split()) if begin else ""


def run() -> None:
    """Run the command line; :mod:`cembench.commands.exit_codes` chooses the exit code."""
    with ending():
        app()
