"""What every verb of the command line shares: where it writes to, and how it says things."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape

from cembench.core.errors import ParameterError

if TYPE_CHECKING:
    from cembench.registry import Registry

out = Console(highlight=False)
err = Console(stderr=True, highlight=False)

Json = Annotated[bool, typer.Option("--json", help="Print JSON on standard output.")]


def print_json(data: Any) -> None:
    """Print data as JSON, and nothing else, on standard output."""
    sys.stdout.write(json.dumps(data, indent=2) + "\n")


def complain(message: str) -> None:
    """Say on standard error what is wrong."""
    err.print(f"error: {message}", style="bold red", markup=False, soft_wrap=True)


def warn(message: str) -> None:
    """Say on standard error what the user should know."""
    err.print(f"warning: {message}", style="yellow", markup=False, soft_wrap=True)


def registry_with(plugins: Sequence[str]) -> Registry:
    """Load the registry with the user's plug-ins, and show which while that takes its time."""
    from cembench.registry import load_registry

    if not plugins:
        return load_registry()
    from cembench.running.plugins import load_with_plugins

    with err.status(f"importing {escape(', '.join(plugins))}", spinner="line"):
        return load_with_plugins(plugins)


def split(names: list[str]) -> list[str]:
    """Names out of options that were repeated, or hold several with commas."""
    return [part.strip() for name in names for part in name.split(",") if part.strip()]


def assignments(given: Sequence[str]) -> dict[str, str]:
    """The parameters that ``-p NAME=VALUE`` sets.

    Raises
    ------
    ParameterError
        One that is not of that form.

    """
    pairs = {}
    for assignment in given:
        name, equals, value = assignment.partition("=")
        if not equals or not name:
            raise ParameterError(f"-p {assignment!r} is not of the form NAME=VALUE.")
        pairs[name.strip()] = value.strip()
    return pairs
