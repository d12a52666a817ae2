"""Sections for the exhibits that commands added to a run."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

from cembench.core.atomic import write_bytes
from cembench.core.loading import damaged, is_there, read_bytes
from cembench.core.names import digest, distinct_slugs
from cembench.report.content.evidence import Evidence
from cembench.report.document import (
    ORIGINS,
    Column,
    Figure,
    Gallery,
    Gap,
    Item,
    Section,
    Table,
    Text,
)
from cembench.report.pictures import pixel_suffix
from cembench.results.exhibits import Exhibit, ExhibitTable, place_of
from cembench.results.records import MeshOrigin


def exhibit_gaps(evidence: Evidence) -> list[Gap]:
    """Return gaps for the paper's figures whose exhibit is missing in the run."""
    return [
        Gap(
            f"{one.figure}: {one.shows}",
            "the run has no exhibit for it.",
            f"cembench {one.command} --run {evidence.store.folder}",
        )
        for one in evidence.paper.exhibits
        if not any(one.figure in figures_of(e) for e in evidence.exhibits)
    ]


def figures_of(exhibit: Exhibit) -> list[str]:
    """Return the figures of the paper that an exhibit reproduces, as a list."""
    return [name.strip() for name in exhibit.figure.split(",") if name.strip()]


def exhibit_sections(evidence: Evidence, folder: Path) -> list[Section]:
    """Return a section for each exhibit; its pictures are copied into the report.

    Raises
    ------
    RecordError
        The file of a picture holds something else, or a link leads to it.
    """
    names = distinct_slugs({digest(exhibit.name): exhibit.name for exhibit in evidence.exhibits})
    return [
        _section(evidence, exhibit, f"exhibit-{names[digest(exhibit.name)]}", folder)
        for exhibit in evidence.exhibits
    ]


def _section(evidence: Evidence, exhibit: Exhibit, name: str, folder: Path) -> Section:
    stems = distinct_slugs({digest(p.file): Path(p.file).stem for p in exhibit.pictures})
    items: list[Item] = [Text(part) for part in exhibit.text.split("\n\n") if part.strip()]
    items.append(Text(f"Made on: {ORIGINS[exhibit.origin][0].removeprefix('measured here on ')}."))
    figures, lost = [], []
    for k, picture in enumerate(exhibit.pictures):
        run = evidence.store.folder
        file = place_of(run, exhibit.name, picture.file)
        if not is_there(file):
            lost.append(Gap(picture.caption, f"the picture {file} is gone.", exhibit.command))
            continue
        content = read_bytes(file, run)
        suffix = pixel_suffix(content)
        if suffix is None:
            raise damaged(file, "a picture", "it holds no PNG, JPEG or WebP")
        path = PurePosixPath("figures", f"{name}-{stems[digest(picture.file)]}{suffix}")
        write_bytes(folder / path, content)
        figures.append(
            Figure(
                f"{name}-{k + 1}", picture.caption, (path,), picture.caption,
                alternative=picture.alternative or picture.caption, paper=exhibit.figure,
            )
        )  # fmt: skip
    if len(figures) == 1:
        items += figures
    elif figures:
        items.append(Gallery(f"{name}-pictures", exhibit.title, tuple(figures)))
    items += lost
    items += [
        exhibit_table(table, f"{name}-table-{k + 1}", exhibit.origin)
        for k, table in enumerate(exhibit.tables)
    ]
    items.append(Text(f"Made by: {exhibit.command}"))
    title = exhibit.title + (f" ({exhibit.figure})" if exhibit.figure else "")
    return Section(name, title, tuple(items))


def exhibit_table(table: ExhibitTable, name: str, origin: MeshOrigin) -> Table:
    """Return a table of an exhibit as one of a report; a column is numeric if it has no text."""
    columns = [
        Column(
            title,
            numeric=not any(isinstance(row[k], str) for row in table.rows),
            form=table.forms.get(title, ""),
            lacking="not measured",
            detail=title in table.details,
        )
        for k, title in enumerate(table.columns)
    ]
    return Table.of(name, table.title, columns, table.rows, origin=origin, notes=table.notes)


def tables_shown(exhibit: Exhibit) -> Section:
    """Return the tables of an exhibit, as a command prints them."""
    tables = (exhibit_table(table, "", exhibit.origin) for table in exhibit.tables)
    return Section(exhibit.name, "", tuple(tables))
