"""The figures of a paper, drawn from a run, and the exhibits that commands added to it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePosixPath

from cembench.core.atomic import write_bytes
from cembench.core.loading import damaged, is_there, read_bytes
from cembench.core.names import digest, distinct_slugs
from cembench.report.content.evidence import Evidence, model_surface
from cembench.report.content.inspection import Inspection
from cembench.report.declared_plots import declared_plot, own_plots
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
from cembench.report.plot_rows import exponents_table
from cembench.report.plots import Plot, drawn
from cembench.results.exhibits import Exhibit, ExhibitTable, place_of
from cembench.results.papers import Picture
from cembench.results.records import MeshOrigin

Inspections = Mapping[str, Inspection]


def figures_section(evidence: Evidence, seen: Inspections, folder: Path) -> Section:
    """Return the section with the paper's figures."""
    gaps: list[Gap] = []
    items: list[Item] = []
    for picture in evidence.paper.pictures:
        pictures = _pictures(evidence, seen, picture)
        items += pictures
        if not pictures:
            gaps.append(_gap(evidence, seen, picture.model, picture.figure))
    plots: list[Plot | None] = []
    for name in OF_MODELS:
        plots.append(plot := paper_plot(evidence, name, seen))
        gaps += _lacking(evidence, name, plot, seen)
    cost = declared_plot(evidence, "cost-by-faces")
    over = [paper_plot(evidence, name, seen) for name in OVER_MODELS]
    items += drawn([*plots, cost, exponents_table(evidence), *over], folder)
    return Section("figures", "Figures of the paper", (*items, *gaps, *exhibit_gaps(evidence)))


#: Plots of a paper with a panel for each of some models, and of one with all of them.
OF_MODELS = ("energy-by-iteration", "angle-histograms")
OVER_MODELS = ("energy-over-models", "angles-over-models")


def paper_plot(evidence: Evidence, name: str, seen: Inspections) -> Plot | None:
    """Return a plot that the paper declares; None without one, or with nothing to draw."""
    declared = own_plots(evidence).get(name)
    return declared_plot(evidence, name, declared, seen=seen) if declared else None


def _lacking(evidence: Evidence, name: str, plot: Plot | None, seen: Inspections) -> list[Gap]:
    """Return a gap for each model that should have a panel and has none."""
    declared = own_plots(evidence).get(name)
    there = {panel.of for panel in plot.panels} if plot else set()
    models = declared.models if declared else ()
    figure = declared.figure if declared else ""
    return [_gap(evidence, seen, model, figure) for model in models if model not in there]


def _gap(evidence: Evidence, seen: Inspections, model: str, figure: str) -> Gap:
    """Return the gap for a model without a map by CEM in the run, or without the map itself."""
    surface = evidence.surface_for_model(model)
    series = evidence.series_of(evidence.reference)
    record = evidence.find(surface, series) if surface and series else None
    title = f"{figure}: {model}"
    if surface and record and record.outcome.status == "ok" and not seen[surface.mesh_hash].kept:
        return Gap(title, seen[surface.mesh_hash].missing_reason)
    why = (
        evidence.missing_reason(record)
        if surface
        else "no surface of this run is or stands in for it"
    )
    return Gap(
        title,
        f"no map of {model} by {evidence.reference_label}: {why}.",
        f"cembench run --surfaces {model_surface(model)} -a {evidence.reference} "
        f"-o {evidence.store.folder}",
    )


def _pictures(evidence: Evidence, inspections: Inspections, wanted: Picture) -> list[Figure]:
    """Return CEM's pictures of a model, as in the paper."""
    figure, model = wanted.figure, wanted.model
    surface = evidence.surface_for_model(model)
    series = evidence.series_of(evidence.reference)
    if surface is None or series is None:
        return []
    seen = inspections[surface.mesh_hash]
    checkerboard = seen.checkerboards.get(series.label)
    if checkerboard is None:
        return []
    kinds = {"checkerboard": checkerboard, "curvature": seen.curvature, "mesh": seen.mesh}
    chosen = [kinds[kind] for kind in wanted.shows]
    return [
        Figure(
            f"{figure.lower().replace(' ', '-')}-{k + 1}",
            f"{model} ({surface.origin}) and its map by {series.label}: {picture.title}",
            picture.files,
            picture.caption,
            alternative=picture.alternative,
            paper=figure,
        )
        for k, picture in enumerate(chosen)
        if picture
    ]


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
