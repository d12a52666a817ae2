"""The tables of the paper's exhibits: exhibits.toml declares their titles, columns and notes."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from cembench.results.exhibits import ExhibitTable


@cache
def _declared() -> dict[str, dict[str, Any]]:
    return tomllib.loads(Path(__file__).with_name("exhibits.toml").read_text(encoding="utf-8"))


def exhibit_table(name: str, rows: Iterable[Mapping[str, Any]], **more: Any) -> ExhibitTable:
    """Return a declared table of these rows; `more` fields of it are given."""
    return ExhibitTable.of(_declared()[name], rows, **more)
