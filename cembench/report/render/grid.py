"""The common table for terminals of 80 columns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rich.table import Table
from rich.text import Text


@dataclass(frozen=True)
class GridColumn:
    """A column: its heading, its alignment, and its largest width.

    A wrapping column breaks into lines; other columns are shortened to `room` characters.
    """

    heading: str = ""
    figures: bool = False
    wraps: bool = False
    room: int | None = None
    width: int | None = None
    style: str = ""


def names(heading: str, room: int | None = None) -> GridColumn:
    """Return a column of names, shortened to `room` characters."""
    return GridColumn(heading, room=room)


def figures(*headings: str) -> list[GridColumn]:
    """Return right-aligned columns of figures."""
    return [GridColumn(heading, figures=True) for heading in headings]


def words(*headings: str) -> list[GridColumn]:
    """Return columns of text that wraps."""
    return [GridColumn(heading, wraps=True) for heading in headings]


def grid(
    columns: Sequence[GridColumn],
    rows: Iterable[Sequence[str | Text]],
    *,
    title: str = "",
    gap: int = 1,
    styles: Iterable[str] = (),
) -> Table:
    """Return a table without lines.

    Parameters
    ----------
    columns : sequence of GridColumn
        The columns; if none has a heading, there is no heading row.
    rows : iterable of sequences of str or Text
        The rows, with one entry per column.
    title : str
        Title above the table, at the left.
    gap : int
        Spaces between columns.
    styles : iterable of str
        Styles of the rows, used cyclically.

    """
    table = Table(
        box=None,
        pad_edge=False,
        padding=(0, gap, 0, 0),
        header_style="bold",
        show_header=any(column.heading for column in columns),
        title=title or None,
        title_justify="left",
        title_style="bold",
        row_styles=list(styles) or None,
    )
    for column in columns:
        table.add_column(
            column.heading,
            justify="right" if column.figures else "left",
            no_wrap=not column.wraps,
            overflow="ellipsis" if column.room else "fold",
            max_width=column.room,
            min_width=column.width,
            style=column.style,
        )
    for row in rows:
        table.add_row(*row)
    return table
