"""What a reader can filter a page by: surfaces, algorithms and statuses of its records."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

#: The facets, each with the columns of a record whose values name a choice.
FACETS: Mapping[str, tuple[str, ...]] = {
    "surface": ("mesh", "paper_row"),
    "algorithm": ("algorithm", "title"),
    "status": ("status",),
}
Rows = Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Facets:
    """The choices of a report's filter.

    Parameters
    ----------
    choices : mapping
        The choices of each of :data:`FACETS`, as printed.
    names : mapping
        Names in tables and plots that mean one choice: its facet and its place among the choices.
    cells : mapping
        The places of each record's choices, by its key.

    """

    choices: Mapping[str, list[str]]
    names: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    cells: Mapping[str, list[int]] = field(default_factory=dict)


def facets_of(records: Rows) -> Facets:
    """Return the choices that records offer. Names that mean several choices are left out."""
    printed = _printed(records)
    choices = [sorted({own[k] for own in printed.values()}, key=str.casefold) for k in range(3)]
    cells = {
        key: [choices[k].index(name) for k, name in enumerate(own)] for key, own in printed.items()
    }
    meant: dict[str, set[tuple[int, int]]] = {}
    for key, row in records.items():
        for k, columns in enumerate(FACETS.values()):
            for name in filter(None, (printed[key][k], *map(row.get, columns))):
                meant.setdefault(str(name), set()).add((k, cells[key][k]))
    names = {name: found.pop() for name, found in meant.items() if len(found) == 1}
    return Facets(dict(zip(FACETS, choices, strict=True)), names, cells)


def _printed(records: Rows) -> dict[str, tuple[str, str, str]]:
    """Return the surface, algorithm and status of each record; algorithms of one title differ."""
    titles = {r.get("algorithm"): r.get("title") or r.get("algorithm") for r in records.values()}
    often = Counter(titles.values())

    def of(row: Mapping[str, Any]) -> tuple[str, str, str]:
        name = row.get("algorithm")
        title = titles[name] if often[titles[name]] == 1 else f"{titles[name]} ({name})"
        surface = row.get("paper_row") or row.get("mesh")
        return str(surface or ""), str(title or ""), str(row.get("status") or "")

    return {key: of(row) for key, row in records.items()}
