"""The options that name an external program to measure."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from cembench.core.errors import ParameterError

Command = Annotated[
    str | None,
    typer.Option(
        "--command",
        metavar="COMMAND",
        help="A program to run as an algorithm, in any language: 'mysolver {input} -o {output}'. "
        "See external_solvers.md in docs.",
    ),
]
Settings = Annotated[
    list[str],
    typer.Option(
        "--program",
        metavar="KEY=VALUE",
        help="Settings of --command: name, target, input, output, seconds, version, circle, fit. "
        "Repeatable.",
    ),
]
#: The keys that `--program` may set.
KEYS = ("name", "target", "input", "output", "seconds", "version", "circle", "fit")
_TRUTH = {"yes": True, "no": False}


def declared_command(command: str | None, settings: list[str]) -> tuple[list[str], list[str]]:
    """Return the plug-in made from a command and its algorithm's name; empty without a command.

    Raises
    ------
    ParameterError
        A setting has no command, is unknown, or has the wrong type.
    RegistryError
        The declaration is inconsistent.
    """
    from cembench.registry import COMMAND, declared_by, load_registry

    if command is None:
        if settings:
            raise ParameterError(f"--program {settings[0]} needs --command COMMAND.")
        return [], []
    declared = {"command": command, "folder": str(Path.cwd())}
    plugin = COMMAND + json.dumps(declared | dict(_setting(one) for one in settings))
    (spec,) = declared_by(plugin)
    if spec.name in load_registry().algorithms:
        raise ParameterError(
            f"the command's name would be {spec.name!r}, which is a registered algorithm; choose "
            "another with --program name=NAME."
        )
    return [plugin], [spec.name]


def _setting(text: str) -> tuple[str, Any]:
    key, equals, value = text.partition("=")
    if key not in KEYS or not equals:
        raise ParameterError(
            f"--program {text!r} is unknown; write KEY=VALUE, where KEY is one of: "
            f"{', '.join(KEYS)}."
        )
    if key == "fit" and value not in _TRUTH:
        raise ParameterError(f"--program fit={value!r} is not allowed; write yes or no.")
    if key == "circle":
        try:
            return key, float(value)
        except ValueError:
            raise ParameterError(
                f"--program circle={value!r} is not a number; write a tolerance."
            ) from None
    return key, _TRUTH[value] if key == "fit" else value
