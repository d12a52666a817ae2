"""Tables of what is registered, without records of measurements, so that they are shown quickly."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.text import Text

from cembench.mesh.datasets import Dataset
from cembench.registry import Algorithm, Surface
from cembench.report.render.grid import figures, grid, words


def algorithms_table(algorithms: Sequence[Algorithm], *, verbose: bool) -> RenderableType:
    """Return the algorithms; with `verbose` also their parameters, sources and notes."""
    if not verbose:
        rows = [[a.name, a.target, a.mesh_type.__name__, _parameters(a)] for a in algorithms]
        columns = words("algorithm", "maps to", "from", "parameters (defaults)")
        return grid(columns, rows, gap=2)
    parts: list[RenderableType] = []
    for a in algorithms:
        parts += [
            Text.assemble((a.name, "bold"), f"  {a.title}: {a.mesh_type.__name__} to {a.target}"),
            Text(f"  source: {a.source or 'not given'}"),
            Text(f"  parameters: {_parameters(a) or 'none'}"),
            Padding(_flowing(a.notes), (0, 0, 1, 2)),
        ]
    return Group(*parts)


def surfaces_table(surfaces: Sequence[Surface], *, verbose: bool) -> RenderableType:
    """Return the surface families; with `verbose` also their parameters and sources."""
    more = ["about"] if verbose else []
    rows = [
        [s.name, s.title, _parameters(s), *([_flowing(s.notes)] if verbose else [])]
        for s in surfaces
    ]
    return grid(words("surface", "title", "parameters (defaults)", *more), rows, gap=2)


def datasets_table(datasets: Sequence[tuple[Dataset, bool]]) -> RenderableType:
    """Return the datasets, with those already fetched marked."""
    rows = []
    for d, here in datasets:
        size = "-" if d.size is None else bytes_text(d.size)
        faces = "-" if d.faces is None else f"{d.faces:,}"
        where = "yes" if here else "no"
        rows.append([d.name, d.group or "-", faces, size, d.licence, where])
    columns = [
        *words("dataset", "group"),
        *figures("faces", "size"),
        *words("licence", "here"),
    ]
    return grid(columns, rows, gap=2)


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
