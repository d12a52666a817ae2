"""What declarations of tables and plots share: how they are read, checked and filled in."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from cembench.core.errors import ParameterError
from cembench.results.expressions import with_words
from cembench.results.papers import Declaration as Declaration

D = TypeVar("D", bound=Declaration)


def read(path: Path) -> dict[str, Any]:
    """Return what a TOML file declares.

    Raises
    ------
    ParameterError
        The file cannot be read.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise ParameterError(f"{path} cannot be read: {error}. Name a TOML file.") from error
    except tomllib.TOMLDecodeError as error:
        raise ParameterError(f"{path} is not TOML: {error}.") from error


@cache
def own(name: str) -> Mapping[str, Any]:
    """Return what a file of this package declares."""
    return tomllib.loads((files("cembench.report") / name).read_text(encoding="utf-8"))


def parsed(declared: Mapping[str, Any], kind: type[D], where: str) -> dict[str, D]:
    """Return the declarations in a part of a file, by name; `where` says which part.

    Raises
    ------
    ParameterError
        A declaration is wrong.
    """
    if not isinstance(declared, Mapping):
        raise ParameterError(f"{where}: write each declaration as a table of its own, [NAME].")
    entries = {}
    for name, table in declared.items():
        try:
            entries[name] = kind.model_validate(table)
        except ValidationError as error:
            first = error.errors()[0]
            place = " / ".join([name, *map(str, first["loc"])])
            what = first["msg"].removeprefix("Value error, ")
            raise ParameterError(f"{where}, {place}: {what}.") from error
    return entries


def filled(text: str, known: Mapping[str, Any]) -> str:
    """Return a declared text with what stands for its names in braces.

    Raises
    ------
    ParameterError
        A name in braces is unknown, or the braces are wrong.
    """
    try:
        return with_words(text, **known)
    except (LookupError, ValueError, TypeError, AttributeError) as error:
        names = ", ".join(sorted(map(str, known)))
        raise ParameterError(
            f"{text!r} cannot be filled in ({type(error).__name__}: {error}); known in braces are "
            f"{names}. Write {{{{ and }}}} for braces themselves."
        ) from error
