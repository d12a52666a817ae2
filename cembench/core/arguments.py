"""Arguments of the functions of the Python API, read from their signatures and docstrings.

A function declares the type and the range of an argument in its annotation and the meaning in its
docstring; :func:`checked` refuses other values, and the command line makes its options of the same
declaration.
"""

from __future__ import annotations

import builtins
import inspect
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache, wraps
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, ParamSpec, TypeVar, Union, get_args, get_origin

from cembench.core.errors import ParameterError

#: The head of a section of a docstring.
_SECTION = re.compile(r"\n\n\w[\w ]*\n-+\n")
P = ParamSpec("P")
R = TypeVar("R")


@dataclass(frozen=True)
class Range:
    """The least and the largest allowed value of a number."""

    least: float
    most: float

    def __str__(self) -> str:
        return f"from {self.least:,} to {self.most:,}"


@dataclass(frozen=True)
class Argument:
    """An argument of a function.

    Parameters
    ----------
    name : str
        Its name.
    kinds : tuple
        Its types, or those of its items, without None: classes, generic aliases, or one Literal.
    many : bool
        Whether it is a sequence of such values.
    default : object
        Its default; ``inspect.Parameter.empty`` if it is required.
    range : Range, optional
        The allowed numbers.
    meaning : str
        Its description in the docstring, on one line.
    """

    name: str
    kinds: tuple[Any, ...]
    many: bool
    default: Any
    range: Range | None
    meaning: str

    @property
    def choices(self) -> tuple[str, ...]:
        """The allowed values, if it is a choice."""
        return next((get_args(kind) for kind in self.kinds if get_origin(kind) is Literal), ())

    def check(self, passed: Any) -> None:
        """Raise :class:`ParameterError` if a value is not allowed; None always is."""
        if passed is None or (self.range is None and not self.choices):
            return
        if self.range is not None:
            integer = float not in self.kinds
            allowed = f"{'an integer' if integer else 'a number'} {self.range}"
        else:
            allowed = f"one of {', '.join(map(repr, self.choices))}"
        for value in passed if self.many and not isinstance(passed, str) else (passed,):
            if value is not None and not (value in self.choices or self._is_in_range(value)):
                raise ParameterError(f"{self.name}={value!r} is not allowed; write {allowed}.")

    def _is_in_range(self, value: Any) -> bool:
        if self.range is None or isinstance(value, str):
            return str in self.kinds  # a text that the function reads itself
        is_number = hasattr(value, "__index__") or (float in self.kinds and hasattr(value, "real"))
        return is_number and self.range.least <= value <= self.range.most


@cache
def arguments_of(function: Callable[..., Any]) -> dict[str, Argument]:
    """Return the arguments of a function by name, in their order."""
    function = inspect.unwrap(function)
    meanings = _meanings(inspect.getdoc(function) or "")
    names = _Names(function.__globals__)
    arguments = {}
    for name, parameter in inspect.signature(function).parameters.items():
        annotation = parameter.annotation
        if isinstance(annotation, str):
            annotation = eval(annotation, {}, names)  # a string of our own source
        kinds = _parts(annotation)
        sequences = [kind for kind in kinds if get_origin(kind) in (Sequence, Iterable)]
        kinds = [part for kind in sequences or kinds for part in _items(kind)]
        ranges = [r for kind in kinds for r in get_args(kind)[1:] if isinstance(r, Range)]
        plain = tuple(get_args(k)[0] if get_origin(k) is Annotated else k for k in kinds)
        limits = next(iter(ranges), None)
        meaning = meanings.get(name, "")
        arguments[name] = Argument(name, plain, bool(sequences), parameter.default, limits, meaning)
    return arguments


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Make a function refuse arguments outside the ranges and choices that it declares."""
    signature = inspect.signature(function)

    @wraps(function)
    def call(*args: P.args, **options: P.kwargs) -> R:
        arguments = arguments_of(function)
        try:
            bound = signature.bind(*args, **options)
        except TypeError:
            return function(*args, **options)  # raises, and names the function
        for name, value in bound.arguments.items():
            arguments[name].check(value)
        return function(*args, **options)

    return call


def summary_of(function: Callable[..., Any]) -> str:
    """Return the text of a docstring above its first section."""
    return _SECTION.split(inspect.getdoc(function) or "")[0].strip()


class _Names(dict[str, Any]):
    """The names of a module; one imported only for type checkers is any type."""

    def __missing__(self, name: str) -> Any:
        return getattr(builtins, name, Any)


def _parts(annotation: Any) -> list[Any]:
    if get_origin(annotation) in (Union, UnionType):
        return [part for kind in get_args(annotation) for part in _parts(kind)]
    return [] if annotation in (NoneType, None) else [annotation]


def _items(kind: Any) -> list[Any]:
    return _parts(get_args(kind)[0]) if get_origin(kind) in (Sequence, Iterable) else [kind]


def _meanings(text: str) -> dict[str, str]:
    """Return the descriptions in the section Parameters of a docstring."""
    section = re.search(r"^Parameters\n-+\n(.*?)(?:\n\n\w[\w ]*\n-+\n|\Z)", text, re.M | re.S)
    entries = re.findall(
        r"^(\S[^\n]*?)(?: : [^\n]*)?\n((?: +[^\n]*\n?|\n)*)", section[1] if section else "", re.M
    )
    return {
        name.strip(): " ".join(meaning.split())
        for names, meaning in entries
        for name in names.split(",")
    }
