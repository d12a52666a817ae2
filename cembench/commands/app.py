"""The application to which the modules of this package add their commands."""

from __future__ import annotations

from typing import Annotated

import typer

from cembench.commands.console import out
from cembench.commands.exit_codes import Verbs

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
