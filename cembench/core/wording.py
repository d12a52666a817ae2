"""Messages that name arguments of a call, as Python or as the shell writes them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from string import Formatter
from typing import Any


def counted(number: int, noun: str) -> str:
    """Return a number of things in words.

    >>> counted(1, "island"), counted(2500, "fold")
    ('1 island', '2,500 folds')
    """
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


@dataclass(frozen=True)
class Setting:
    """An argument in a message: its name and, unless empty, its value as Python writes it."""

    name: str
    value: str = ""

    def in_python(self) -> str:
        """Return it as an argument of a call."""
        return f"{self.name}={self.value}" if self.value else f"`{self.name}`"

    def in_shell(self, options: Mapping[str, str]) -> str:
        """Return it as an option; `options` has irregular ones, and words without a dash."""
        option = options.get(self.name, f"--{self.name.replace('_', '-')}")
        value = self.value.strip("'\"")
        if not option.startswith("-"):
            return value or option
        return option if value in ("", "True") else f"{option} {value}".strip()


@dataclass(frozen=True)
class Advice:
    """What to do, in a message: a call in Python, a command or option in the shell."""

    python: str
    shell: str

    def in_python(self) -> str:
        """Return it for a reader in Python."""
        return self.python

    def in_shell(self, options: Mapping[str, str]) -> str:
        """Return it for a reader in the shell."""
        return self.shell


class _Sentence(Formatter):
    """Formats a message; a field without a value is a :class:`Setting`, its format the value."""

    def __init__(self, word: Callable[[Setting | Advice], str]) -> None:
        self.word = word

    def get_value(self, key: int | str, args: Any, kwargs: Any) -> Any:
        return kwargs.get(str(key), Setting(str(key)))

    def format_field(self, value: Any, format_spec: str) -> str:
        if not isinstance(value, Setting | Advice):
            return str(super().format_field(value, format_spec))
        if format_spec and isinstance(value, Setting):
            value = Setting(value.name, format_spec)
        return self.word(value)


def in_python(template: str, values: Mapping[str, object]) -> str:
    """Return a message with its arguments as in a call."""
    return _Sentence(lambda one: one.in_python()).vformat(template, (), values)


def in_shell(template: str, values: Mapping[str, object], options: Mapping[str, str]) -> str:
    """Return a message with its arguments as options; `options` has the irregular names."""
    return _Sentence(lambda one: one.in_shell(options)).vformat(template, (), values)
