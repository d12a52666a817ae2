"""The application to which the modules of this package add their commands.

A command loads its own module alone: all of them take a tenth of a second.
"""

from __future__ import annotations

from importlib import import_module
from typing import Annotated

import typer

from cembench.commands.console import out
from cembench.commands.exit_codes import Verbs, ending

#: The modules that add commands, and these, in the order of the help.
MODULES = {
    "catalogue": ("list", "doctor"),
    "map": ("map",),
    "benchmark": ("run",),
    "report": ("report",),
    "reproduce": ("reproduce",),
    "run": ("status", "show", "compare", "merge", "export"),
    "submit": ("submit", "submissions", "publish", "sign"),
    "validate": ("validate",),
    "peers": ("peers",),
    "exhibits": (),  # those of papers
    "morph": ("morph",),
    "fetch": ("fetch",),
    "repair": ("repair",),
    "cut": ("cut",),
}

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


def load(word: str = "") -> None:
    """Load the module of the command that a command line begins with; all if it is none."""
    chosen = [module for module, verbs in MODULES.items() if word in verbs]
    for module in chosen or MODULES:
        import_module(f"cembench.commands.{module}")


def run() -> None:
    """Run the command line; :mod:`cembench.commands.exit_codes` chooses the exit code."""
    with ending():
        app()
