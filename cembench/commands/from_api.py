"""Commands made from the functions of the Python API.

An argument of the function becomes an option with its range, default and meaning; the command adds
what only a shell has, calls the function, and prints what it returns.
"""

from __future__ import annotations

import inspect
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, Literal, get_origin

import typer
from rich.markup import escape
from typer.models import ArgumentInfo

from cembench.commands.console import assignments, hushed, split
from cembench.core.arguments import Argument, arguments_of, summary_of
from cembench.core.names import did_you_mean

_KEYWORD = inspect.Parameter.KEYWORD_ONLY
_QUIET = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only, and --json.")]
#: The options of arguments that several functions have, and what their values are called.
SPELLINGS = {
    "algorithm": "-a --algorithm",
    "algorithms": "-a --algorithms",
    "memory_bytes": "--memory SIZE",
    "output": "-o --output",
    "overwrite": "--force",
    "parameters": "-p --parameter NAME=VALUE",
    "plugins": "--plugin",
    "rounds": "--rounds --repeats",
}
#: Arguments that may be names or paths.
PATHS = ("plugins", "sets")
NONE: Mapping[str, Any] = MappingProxyType({})
#: What the values of options are called in the help.
_METAVARS = {Path: "PATH", str: "NAME", int: "N", float: "N"}
#: From here on an upper bound is no help to a reader; the function still refuses what is above it.
LARGEST_BOUND_SHOWN = 1_000_000
#: Choices with more characters than this are listed in the help, not as the value's name.
LONGEST_CHOICES = 16
#: A call of the function with the arguments of the command line; `call(x=1)` makes it.
Call = partial[Any]


def from_api(
    function: Callable[..., Any],
    *,
    without: Sequence[str] = (),
    only: Sequence[str] | None = None,
    defaults: Mapping[str, Any] = NONE,
    often: Sequence[str] = (),
    **options: str,
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that makes a command of a function of the API.

    Parameters
    ----------
    function : callable
        The function of the API.
    without : sequence of str
        Its arguments that are no options.
    only : sequence of str, optional
        The arguments that are options of a command that does more than the function, and so has a
        text of its own; default: all others.
    defaults : mapping
        Defaults that this command has instead of the function's.
    often : sequence of str
        The arguments and options that most people need: the help shows them before the others.
    **options
        For an argument, its options where they do not follow from its name, and what its value is
        called in the help: ``output="-o --output FILE"``.

    Returns
    -------
    callable
        A decorator of a function that takes the call and the arguments that only the shell has.
        One of these replaces the argument of that name.
    """

    def decorate(body: Callable[..., None]) -> Callable[..., None]:
        own = inspect.signature(body, eval_str=True).parameters
        arguments = {
            name: replace(argument, default=defaults.get(name, argument.default))
            for name, argument in arguments_of(function).items()
            if name not in {*without, *own} and (only is None or name in only)
        }
        spelled = {
            name: words for name, words in (SPELLINGS | options).items() if name in arguments
        }
        names = {k: words.split()[0] for k, words in spelled.items() if words[0] == "-"}
        words = partial(_help, names={name: names.get(name, _option(name)) for name in arguments})
        positional = inspect.signature(function).parameters
        parameters = []
        for name, argument in arguments.items():
            named = positional[name].kind is _KEYWORD or name in names
            kind, default = _option_of(argument, spelled.get(name, ""), words, named=named)
            parameters.append(inspect.Parameter(name, _KEYWORD, default=default, annotation=kind))

        def command(**rest: Any) -> None:
            taken = {name: _value(argument, rest.pop(name)) for name, argument in arguments.items()}
            with hushed(rest.pop("quiet")):
                body(partial(function, **taken), **rest)

        more = [p.replace(kind=_KEYWORD) for p in [*own.values()][1:]]
        quiet = inspect.Parameter("quiet", _KEYWORD, default=False, annotation=_QUIET)
        arguments_first = sorted([*parameters, *more, quiet], key=_is_option)
        if often:
            arguments_first = [
                one if one.name in often else _in_panel(one, "More options")
                for one in sorted(arguments_first, key=partial(_place, often))
            ]
        command.__signature__ = inspect.Signature(arguments_first)  # type: ignore[attr-defined]
        command.__name__, command.__module__ = body.__name__, body.__module__
        command.__doc__ = words(summary_of(function)) if only is None else body.__doc__
        command.body, command.arguments = body, arguments  # type: ignore[attr-defined]
        return command

    return decorate


def _place(often: Sequence[str], parameter: inspect.Parameter) -> int:
    return often.index(parameter.name) if parameter.name in often else len(often)


def _in_panel(parameter: inspect.Parameter, panel: str) -> inspect.Parameter:
    """Return a parameter whose option the help shows in another panel."""
    kind, info = parameter.annotation.__origin__, copy(parameter.annotation.__metadata__[0])
    info.rich_help_panel = panel
    return parameter.replace(annotation=Annotated[kind, info])


def _is_option(parameter: inspect.Parameter) -> bool:
    """Whether it is an option, not an argument; arguments come first in the usage."""
    return not isinstance(parameter.annotation.__metadata__[0], ArgumentInfo)


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _help(text: str, names: Mapping[str, str]) -> str:
    """Return a text of the API in the words of the command line."""
    text = re.sub(
        r":\w+:`~?(?:[\w.]*\.)?(\w+)`", lambda m: f"`cembench {m[1].replace('_', ' ')}`", text
    )
    text = re.sub(r"(?<=\S)\n(?=\S)", " ", text.replace("``", "`"))
    return escape(re.sub(r"`(\w+)`", lambda m: names.get(m[1], m[0]), text))


def _option_of(
    argument: Argument, spelling: str, words: Callable[[str], str], *, named: bool
) -> tuple[Any, Any]:
    """Return the annotation and the default of an argument for the command-line library."""
    spelled = spelling.split()
    flags = [word for word in spelled if word.startswith("-")]
    kind, choices = _kind(argument), argument.choices or ()
    usual = _METAVARS.get(kind)
    metavar = next((word for word in spelled if not word.startswith("-")), usual)
    repeatable = " Repeatable." if named and not _is_single(argument) else ""
    if _is_split(argument):
        repeatable = " Comma-separated."
    elif len(allowed := ", ".join(argument.choices or ())) > LONGEST_CHOICES:
        metavar, repeatable = metavar or "NAME", f" One of {allowed}."
    more: dict[str, Any] = {"help": words(argument.meaning) + repeatable, "metavar": metavar}
    if choices and not argument.many:
        more |= {"parser": one_of(choices)}
        more["metavar"] = more["metavar"] or "|".join(choices)
        kind = str
    if kind in (int, float) and argument.range is not None:
        least, most = argument.range.least, argument.range.most
        more |= {"min": least, "max": most if most < LARGEST_BOUND_SHOWN else None}
    if kind is float:
        more["callback"] = finite
    is_list = not _is_single(argument)
    default = argument.default
    if is_list and default is not inspect.Parameter.empty:
        default = list(default or ())
    whole = list[kind] if is_list else kind if default is not None else kind | None  # type: ignore[valid-type]
    # Messages call an argument by its name, so that is always one of its options.
    info = typer.Option(*dict.fromkeys([*flags, _option(argument.name)]), **more)
    return Annotated[whole, info if named else typer.Argument(**more)], default


def _is_split(argument: Argument) -> bool:
    """Whether commas separate its values; they may be part of paths."""
    return argument.many and argument.name not in PATHS and _kind(argument) is not Path


def _is_single(argument: Argument) -> bool:
    return not (argument.many or _is_mapping(argument))


def _is_mapping(argument: Argument) -> bool:
    return any(get_origin(kind) is Mapping for kind in argument.kinds)


def _kind(argument: Argument) -> Any:
    """Return the type to which the command-line library converts a word."""
    if argument.choices and not argument.many:
        return Literal[argument.choices]
    if any(get_origin(kind) is os.PathLike or kind is os.PathLike for kind in argument.kinds):
        return Path
    return next((k for k in (str, bool, int, float) if k in argument.kinds), str)


def _value(argument: Argument, passed: Any) -> Any:
    """Return a value of the command line as the function takes it."""
    if not isinstance(passed, list | tuple):
        return passed
    if _is_mapping(argument):
        return assignments(passed)
    items = split(list(passed)) if _is_split(argument) else passed
    return items or argument.default


def one_of(choices: Sequence[str]) -> Callable[[str], str]:
    """Return a parser of words that are one of the choices; its error has the nearest of them."""

    def choice(value: str) -> str:
        if value not in choices:
            near = did_you_mean(value, choices)
            raise typer.BadParameter(f"{value!r} is not one of {', '.join(choices)}.{near}")
        return value

    return choice


def finite(value: float | None) -> float | None:
    """Raise on NaN, which passes any comparison with a bound."""
    if value is not None and math.isnan(value):
        raise typer.BadParameter("nan is not allowed; write a number within the range.")
    return value
