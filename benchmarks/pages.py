"""What a study returns, and the marks of a page that it goes between."""

from __future__ import annotations

import string
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cembench.core.atomic import write_bytes, write_text

if TYPE_CHECKING:
    from pandas import DataFrame

ROOT = Path(__file__).parents[1]


@dataclass(frozen=True)
class Table:
    """Rows of figures, and their layout.

    The layout is Markdown: the heading, its rule, and one row with fields of :meth:`str.format`. A
    field without a value is shown as a dash.
    """

    rows: Sequence[Mapping[str, Any]]
    layout: str

    @property
    def frame(self) -> DataFrame:
        """The figures as a frame; those of a mapping in a row have its name before a point."""
        from pandas import json_normalize  # a process that measures memory does without

        return json_normalize(list(self.rows))

    def __str__(self) -> str:
        *head, row = self.layout.strip().splitlines()
        return "\n".join([*head, *(_DASHES.vformat(row, (), one) for one in self.rows)])


class _Dashes(string.Formatter):
    def format_field(self, value: Any, form: str) -> str:
        return "-" if value is None or value != value else super().format_field(value, form)


_DASHES = _Dashes()


@dataclass(frozen=True)
class Section:
    """Tables and text of a study, and where they belong."""

    parts: Sequence[Table | str]
    #: The page with the study's marks, from the root of the repository; none: it is only printed.
    page: str = ""
    #: What else belongs into the repository: pictures and figures, by their paths.
    files: Mapping[str, bytes | str] = field(default_factory=dict)

    def __str__(self) -> str:
        return "\n\n".join(str(part).strip() for part in self.parts)

    def write(self, study: str) -> None:
        """Fill the page, and write the files."""
        if self.page:
            fill(ROOT / self.page, study, str(self))
        self.write_files(ROOT)

    def write_files(self, folder: Path) -> None:
        """Write the files to another folder than the repository."""
        for name, content in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(path, content.encode() if isinstance(content, str) else content)


def marks(study: str) -> tuple[str, str]:
    """Return the marks around what a study of this folder returns."""
    return f"<!-- made by benchmarks/{study}.py -->", f"<!-- end of benchmarks/{study}.py -->"


def filled(page: str, study: str, content: str) -> str:
    """Return a page's text with this content between the study's marks."""
    begin, end = marks(study)
    before, opened, rest = page.partition(begin)
    _, closed, after = rest.partition(end)
    if not (opened and closed):
        raise SystemExit(f"the page lacks the marks {begin} and {end}.")
    return f"{before}{begin}\n\n{content.strip()}\n\n{end}{after}"


def fill(page: Path, study: str, content: str) -> None:
    """Put content between the study's marks in a page."""
    write_text(page, filled(page.read_text(encoding="utf-8"), study, content))
