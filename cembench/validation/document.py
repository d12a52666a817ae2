"""A validation as a report: the verdict, the findings and their figures, for a page or terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from cembench.report.document import (
    Figure,
    Findings,
    Gap,
    Item,
    Origin,
    Plain,
    Report,
    Section,
    Table,
    Value,
    entry,
    words,
)
from cembench.report.given_tables import given_table
from cembench.report.palette import series_styles
from cembench.report.plots import Axis, Plot, PlotPanel, PlotSeries, write_plot
from cembench.results.columns import row
from cembench.results.comparison import NOT_DETECTED
from cembench.results.intervals import Interval
from cembench.results.records import Record
from cembench.results.store import Store
from cembench.validation.finding import ValidationFinding
from cembench.validation.quality import BaselineComparison, Pair
from cembench.validation.scaling import Growth, GrowthComparison
from cembench.validation.solver import CheckedMap, worst_of
from cembench.validation.verdict import STAGES, Validation, sentences

if TYPE_CHECKING:
    from rich.console import RenderableType

_CLOCKS = {
    "cpu": "Seconds are of the processor, except those of a phase, which are wall clock.",
    "wall": "Seconds are wall clock.",
}
_TITLES = {
    "contract": "Does it keep its contract?",
    "correctness": "Are its maps right?",
    "quality": "Is it better, is it faster?",
    "scaling": "How do its seconds grow?",
}
_table = partial(given_table, package="cembench.validation")


def validation_text(validation: Validation) -> RenderableType:
    """Return the findings, the figures, and the verdict at the end, for a terminal."""
    from rich.console import Group
    from rich.text import Text as RichText

    sections = [section for section in stage_sections(validation, {}) if section.items]
    style = "bold green" if validation.passed else "bold red"
    verdict = RichText(f"{validation.title}: {' '.join(sentences(validation))}", style=style)
    return Group(*(part for section in sections for part in (section, "")), verdict)


def document_of(validation: Validation, runs: Path, folder: Path) -> Report:
    """Return the report; records are read from `runs`, and plots are written to `folder`."""
    records: dict[str, Record] = {}
    for stage in STAGES:
        if stage not in validation.skipped and (runs / stage / "records").is_dir():
            records |= {record.cell.key: record for record in Store(runs / stage).records()}
    sections = stage_sections(validation, records)
    worst = _worst_map(validation, records, runs, folder)
    if worst is not None:
        sections.insert(0, Section("worst", "The map with the largest angle errors", (worst,)))
    if validation.growth:
        plot = write_plot(_growth_plot(validation.growth), folder)
        sections[-1] = replace(sections[-1], items=(*sections[-1].items, plot))
    asked = ", ".join(f"{name}={value}" for name, value in validation.parameters.items())
    facts = (
        ("algorithm", f"{validation.title} ({validation.algorithm})"),
        ("maps to", validation.target),
        ("declared in", validation.source),
        ("parameters", asked or "none"),
        ("environment", validation.environment),
        ("examined in", f"{validation.seconds:.0f} s"),
    )
    first, *rest = sentences(validation)
    used = {key for against in validation.against for p in against.pairs for key in p.records}
    return Report(
        title=f"Validation of {validation.title}",
        command=validation.command,
        facts=facts,
        sections=tuple(sections),
        records={key: row(record) for key, record in records.items() if key in used},
        findings=Findings(
            ((f"{validation.title}: {first}",), *((one,) for one in rest)), picture=worst
        ),
    )


def _worst_map(
    validation: Validation, records: Mapping[str, Record], runs: Path, folder: Path
) -> Figure | None:
    """Return a picture of the map with the largest angle errors; None if there is no map."""
    from cembench.conformal.metrics import caption
    from cembench.drawing.preview import write_preview

    measured = []
    for stage in STAGES:
        for record in records.values():
            mesh, uv = Store(runs / stage).mesh(record.cell), Store(runs / stage).uv(record.cell)
            if record.cell.algorithm == validation.algorithm and mesh is not None:
                measured.append(CheckedMap(mesh, record.outcome, uv))
    worst = worst_of(measured) or validation.worst
    if worst is None or worst.uv is None:
        return None
    place = PurePosixPath("figures", "worst-map.png")
    (folder / place).parent.mkdir(exist_ok=True)
    write_preview(worst.mesh, worst.uv, folder / place)
    title = f"{worst.mesh.name} and its image by {validation.title}, its worst map"
    said = caption(worst.outcome.metrics)
    return Figure("worst-map", title, (place,), said, alternative=title)


def stage_sections(validation: Validation, records: Mapping[str, Record]) -> list[Section]:
    """Return a section for each stage; the origins of figures are those of the records."""
    return [
        Section(stage, _TITLES[stage], tuple(_items(validation, stage, records)))
        for stage in STAGES
    ]


def _items(validation: Validation, stage: str, records: Mapping[str, Record]) -> Iterator[Item]:
    for skipped, why in validation.skipped.items():
        if skipped == stage:
            command = "cembench validate PLUGIN.py" if stage in validation.not_asked_for else ""
            yield Gap("No figures", why, command)
    findings = [finding for finding in validation.findings if finding.stage == stage]
    if findings:
        yield _findings_table(stage, findings)
    if stage == "quality" and validation.against:
        yield _summary_table(validation.against)
        for against in validation.against:
            yield _pairs_table(against, validation.title, records)
    if stage == "scaling" and validation.growth:
        yield _growth_table(validation.growth)


def _findings_table(stage: str, findings: Sequence[ValidationFinding]) -> Table:
    bad = [finding for finding in findings if not finding.ok]
    notes = [f"{f.name}: allowed: {f.allowed}; to do: {f.remedy}" for f in bad]
    rows: list[list[Plain]] = [
        [one.name, _found(one), one.measured, one.allowed] for one in findings
    ]
    return _table("findings", rows, called=f"{stage}-findings", notes=dict.fromkeys(notes))


def _found(finding: ValidationFinding) -> Value:
    if finding.undecided:
        return words("inconclusive", "doubtful")
    return words("ok", "good") if finding.ok else words("fault", "bad")


def _summary_table(compared: Sequence[BaselineComparison]) -> Table:
    rows: list[list[Plain]] = []
    for against in compared:
        for name, pairs in (
            (against.energy_name, against.energy),
            ("mean angle error", against.angle),
            ("seconds", against.speed),
        ):
            if pairs is not None:
                counts = [getattr(pairs, side, None) for side in ("lower", "equal", "higher")]
                ratio = (pairs.ratio, *_ends(pairs.interval))
                rows.append([f"{name} / {against.title}", *counts, *ratio])
    timed = any(against.speed is not None for against in compared)
    return _table("summary", rows, {"limits": f" {NOT_DETECTED}" if timed else ""})


def _ends(interval: Interval | None) -> tuple[float | None, float | None]:
    return (interval.low, interval.high) if interval else (None, None)


def _pairs_table(against: BaselineComparison, title: str, records: Mapping[str, Record]) -> Table:
    program = ("start", "solve") if against.solve_time else ()
    note = (
        "an external program: its seconds are the wall clock of a process, with its start and its "
        "files; start is the same on a small mesh, and the ratio is of its solve time "
        f"({against.solve_time})"
    )
    rows = [list(_pair_row(pair, records, program=bool(program))) for pair in against.pairs]
    known = {"ours": title, "theirs": against.title, "energy": against.energy_name}
    return _table(
        *("against", rows, known),
        called=f"against-{against.baseline}",
        each={"program": program},
        notes=[note] * bool(program),
    )


def _pair_row(pair: Pair, records: Mapping[str, Record], *, program: bool) -> Iterator[Plain]:
    ours, theirs = pair.records
    known = records.get(ours)
    origin: Origin = known.mesh.origin if known else "surface"

    def measured(value: float | None, form: str, record: str = ours) -> Value:
        return entry(value, form, "no valid map", origin=origin, record=record)

    yield from (pair.surface, words(f"{pair.faces:,}"))
    yield measured(pair.energy, ".6f")
    yield measured(pair.baseline_energy, ".6f", theirs)
    yield pair.energy_ratio
    yield measured(pair.angle, ".3f")
    yield measured(pair.baseline_angle, ".3f", theirs)
    yield pair.angle_ratio
    yield measured(pair.seconds, ".4f")
    yield measured(pair.baseline_seconds, ".4f", theirs)
    if program:
        yield from (measured(s, ".4f") for s in (pair.start_seconds, pair.solve_seconds))
    yield pair.speed.ratio if pair.speed else None


def _growth_table(compared: GrowthComparison) -> Table:
    growths = (compared.ours, *compared.others)
    sizes = dict.fromkeys(faces for growth in growths for faces in growth.faces)
    rows: list[list[Plain]] = []
    for growth in growths:
        at = dict(zip(growth.faces, growth.seconds, strict=True))
        cells = [entry(at.get(f), ".4f", "not timed", origin="surface") for f in sizes]
        rows.append([growth.what, *cells, growth.exponent, *_ends(growth.interval)])
    titles = [f"{faces:,}" for faces in sizes]
    return _table("growth", rows, {"clock": _CLOCKS[compared.clock]}, each={"sizes": titles})


def _growth_plot(compared: GrowthComparison) -> Plot:
    growths: Sequence[Growth] = (compared.ours, *compared.others)
    styles = series_styles([growth.what for growth in growths])
    series = tuple(
        PlotSeries(growth.what, growth.faces, growth.seconds, "both", styles[growth.what])
        for growth in growths
    )
    axes = Axis("triangles", log=True), Axis("seconds", log=True)
    return Plot(
        "growth-plot",
        "Seconds against triangles",
        (PlotPanel(*axes, series),),
        "Medians of the rounds, on logarithmic axes.",
        "Lines that rise from left to right, one for each of the table's rows.",
    )
