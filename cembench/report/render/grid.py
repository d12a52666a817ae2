"""The one kind of table that a terminal of 80 columns shows: columns, and rows of words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rich.table import Table
from rich.text import Text


@dataclass(frozen=True)
class GridColumn:
    """A column: its heading, whether figures stand at its right side, how wide it may become.

    A column that wraps breaks its words into lines; others are shortened to `room` characters.
    """

    heading: str = ""
    figures: bool = False
    wraps: bool = False
    room: int | None = None
    width: int | None = None
    style: str = ""


def names(heading: str, room: int | None = None) -> GridColumn:
    """Return a column of names, shortened where they are longer than `room`."""
    return GridColumn(heading, room=room)


def figures(*headings: str) -> list[GridColumn]:
    """Return columns of figures."""
    return [GridColumn(heading, figures=True) for heading in headings]


def words(*headings: str) -> list[GridColumn]:
    """Return columns of words that wrap."""
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
        If none has a heading, there is no line of headings.
    rows : iterable of sequences of str or Text
        As long as `columns`.
    title : str
        Above it, at the left.
    gap : int
        Spaces between columns.
    styles : iterable of str
        Of the rows, in turn, again and again.

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
