"""Tables whose rows are given: a file declares their title, columns, caption and notes.

The file is ``given_tables.toml`` of a package. In titles, captions and notes, names in braces stand
for what the call gives.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache, partial
from importlib.resources import files
from itertools import groupby, product
from types import MappingProxyType
from typing import Any

from pydantic import model_validator

from cembench.report.declarations import Declaration, filled, parsed
from cembench.report.document import Column, Origin, Plain, Table

_FILE = "given_tables.toml"
_NONE: Mapping[str, Any] = MappingProxyType({})


class GivenColumn(Declaration):
    """A column; a text in its place is the title of a column of texts."""

    title: str
    group: str = ""
    unit: str = ""
    form: str = ""
    lacking: str = "no figure"
    detail: bool = False
    #: Whether its entries are texts.
    words: bool = False
    #: It and its neighbours with the same name are repeated for each text that the call gives under
    #: that name; {each} stands for it.
    each: str = ""

    @model_validator(mode="before")
    @classmethod
    def _named(cls, value: Any) -> Any:
        return {"title": value, "words": True} if isinstance(value, str) else value

    def heading(self, known: Mapping[str, Any]) -> Column:
        """Return the column of a table."""
        title, group = (filled(text, known) for text in (self.title, self.group))
        numeric = not self.words
        return Column(title, group, self.unit, numeric, self.form, self.lacking, self.detail)


class GivenTable(Declaration):
    """A table without its rows."""

    title: str = ""
    columns: tuple[GivenColumn, ...]
    caption: str = ""
    notes: tuple[str, ...] = ()


@cache
def _declared(package: str) -> Mapping[str, GivenTable]:
    text = (files(package) / _FILE).read_text(encoding="utf-8")
    return parsed(tomllib.loads(text), GivenTable, _FILE)


def given_table(
    name: str,
    rows: Iterable[Sequence[Plain]],
    known: Mapping[str, Any] = _NONE,
    *,
    package: str = "cembench.report",
    called: str = "",
    each: Mapping[str, Sequence[str]] = _NONE,
    notes: Iterable[str] = (),
    origin: Origin = "derived",
) -> Table:
    """Return a declared table with these rows, which have an entry for each of its columns.

    Names in braces stand for what is `known`, and `each` has the texts that columns are repeated
    for. A table that is not `called` otherwise has the name of its declaration.
    """
    spec = _declared(package)[name]
    columns = [
        one.heading({**known, "each": text})
        for key, several in groupby(spec.columns, lambda one: one.each)
        for text, block in product(each[key] if key else [""], [list(several)])
        for one in block
    ]
    fill = partial(filled, known=known)
    return Table.of(
        *(called or name, fill(spec.title), columns, rows),
        origin=origin,
        caption=fill(spec.caption),
        notes=(*map(fill, spec.notes), *notes),
    )
