"""Tables of what is registered, without records of measurements, so that they are shown quickly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cembench.registry import Algorithm, Surface
from cembench.report.document import Column, Plain, Section, Table, Text


def algorithms_table(algorithms: Sequence[Algorithm], *, verbose: bool) -> Table | Section:
    """Return the algorithms; with `verbose` also their titles, sources and notes."""
    if verbose:
        return Section("algorithms", "", sections=tuple(map(_described, algorithms)))
    rows = [[a.name, a.target, a.mesh_type.__name__, _parameters(a)] for a in algorithms]
    columns = ("algorithm", "maps to", "from", "parameters (defaults)")
    return Table.of("algorithms", "", columns, rows)


def _described(a: Algorithm) -> Section:
    title = f"{a.name}  {a.title}: {a.mesh_type.__name__} to {a.target}"
    facts = [f"source: {a.source or 'not given'}", f"parameters: {_parameters(a) or 'none'}"]
    return Section(a.name, title, tuple(map(Text, [*facts, _flowing(a.notes)])))


def surfaces_table(surfaces: Sequence[Surface], *, verbose: bool) -> Table:
    """Return the surface families; with `verbose` also their notes."""
    columns = ("surface", "title", "parameters (defaults)", *["about"] * verbose)
    rows = [
        [s.name, s.title, _parameters(s), *([_flowing(s.notes)] if verbose else [])]
        for s in surfaces
    ]
    return Table.of("surfaces", "", columns, rows)


def datasets_table(datasets: Sequence[Mapping[str, Any]]) -> Table:
    """Return the rows of :func:`cembench.fetch`, with those already fetched marked."""
    rows: list[list[Plain]] = []
    for d in datasets:
        faces = "-" if d["faces"] is None else d["faces"]
        size = "-" if d["size"] is None else bytes_text(d["size"])
        fetched = "yes" if d["fetched"] else "no"
        rows.append([d["name"], d["group"] or "-", faces, size, d["licence"], fetched])
    sizes = Column("faces"), Column("size")
    return Table.of("datasets", "", ["dataset", "group", *sizes, "licence", "here"], rows)


def bytes_text(size: int) -> str:
    """Return a number of bytes in a readable form.

    >>> bytes_text(45_743), bytes_text(2_555_599)
    ('46 kB', '2.6 MB')
    """
    return f"{size / 1e6:.1f} MB" if size >= 1e6 else f"{size / 1e3:.0f} kB"


def _flowing(text: str) -> str:
    """Join the lines of paragraphs, so that the terminal wraps them."""
    return "\n\n".join(" ".join(part.split()) for part in text.split("\n\n"))


def _parameters(registered: Algorithm | Surface) -> str:
    return ", ".join(f"{p.name}={p.default}" for p in registered.parameters)
