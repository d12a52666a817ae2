"""A validation as a report document: the verdict, the findings and their figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from cembench.report.document import (
    Column,
    Gap,
    Item,
    Origin,
    Report,
    Section,
    Table,
    Text,
    Value,
    missing,
    words,
)
from cembench.report.palette import series_styles
from cembench.report.plots import Axis, Plot, PlotPanel, PlotSeries, write_plot
from cembench.results.comparison import NOT_DETECTED
from cembench.results.record_rows import row
from cembench.results.records import Record
from cembench.results.store import Store
from cembench.validation.finding import ValidationFinding
from cembench.validation.quality import BaselineComparison, Pair, PairedComparison
from cembench.validation.scaling import Growth, GrowthComparison
from cembench.validation.verdict import STAGES, Validation, sentence

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


def document_of(validation: Validation, runs: Path, folder: Path) -> Report:
    """Return the report; records are read from `runs`, and plots are written to `folder`."""
    sections = [
        Section("verdict", "Verdict", (Text(f"{validation.title}: {sentence(validation)}."),))
    ]
    records: dict[str, Record] = {}
    for stage in STAGES:
        if stage not in validation.skipped and (runs / stage / "records").is_dir():
            records |= {record.cell.key: record for record in Store(runs / stage).records()}
    for stage in STAGES:
        items = list(_items(validation, stage, folder, records))
        sections.append(Section(stage, _TITLES[stage], tuple(items)))
    asked = ", ".join(f"{name}={value}" for name, value in validation.parameters.items())
    facts = (
        ("algorithm", f"{validation.title} ({validation.algorithm})"),
        ("maps to", validation.target),
        ("declared in", validation.source),
        ("parameters", asked or "none"),
        ("environment", validation.environment),
        ("examined in", f"{validation.seconds:.0f} s"),
    )
    used = {key for against in validation.against for p in against.pairs for key in p.records}
    return Report(
        title=f"Validation of {validation.title}",
        command=validation.command,
        facts=facts,
        sections=tuple(sections),
        records={key: row(record) for key, record in records.items() if key in used},
    )


def _items(
    validation: Validation, stage: str, folder: Path, records: dict[str, Record]
) -> Iterator[Item]:
    for skipped, why in validation.skipped.items():
        if skipped == stage:
            command = "cembench validate PLUGIN.py" if stage in validation.not_asked_for else ""
            yield Gap(_TITLES[stage], why, command)
    findings = [finding for finding in validation.findings if finding.stage == stage]
    if findings:
        yield _findings_table(stage, findings)
    if stage == "quality" and validation.against:
        yield _summary_table(validation.against)
        for against in validation.against:
            yield _pairs_table(against, validation.title, records)
    if stage == "scaling" and validation.growth:
        yield _growth_table(validation.growth)
        yield write_plot(_growth_plot(validation.growth), folder)


def _findings_table(stage: str, findings: Sequence[ValidationFinding]) -> Table:
    columns = ("check", "found", "measured", "allowed")
    return Table(
        name=f"{stage}-findings",
        title="Checks",
        columns=tuple(Column(title, numeric=False) for title in columns),
        rows=tuple(
            (
                words(finding.name),
                words(_found(finding)),
                words(finding.measured),
                words(finding.allowed),
            )
            for finding in findings
        ),
        notes=tuple(f"{f.name}: {f.remedy}" for f in findings if not f.ok),
    )


def _found(finding: ValidationFinding) -> str:
    if finding.undecided:
        return "cannot be told"
    return "ok" if finding.ok else "fault"


def _summary_table(compared: Sequence[BaselineComparison]) -> Table:
    rows = []
    for against in compared:
        for what, found in (
            (against.energy_name, against.energy),
            ("mean angle error", against.angle),
        ):
            rows.append(_sides_row(f"{what} / {against.title}", found))
        speed = against.speed
        if speed is not None:
            rows.append(
                (
                    words(f"seconds / {against.title}"),
                    *(missing("of the rounds, not of the surfaces") for _ in range(3)),
                    _ratio(speed.ratio),
                    _ratio(speed.low),
                    _ratio(speed.high),
                )
            )
    return Table(
        name="summary",
        title="Beside the baselines",
        columns=(
            Column("figure", numeric=False),
            Column("lower", "surfaces"),
            Column("equal", "surfaces"),
            Column("higher", "surfaces"),
            Column("median ratio"),
            Column("low", "95 % interval"),
            Column("high", "95 % interval"),
        ),
        rows=tuple(rows),
        caption="Ratios of this algorithm's figure to the baseline's: below 1 is better. Equal "
        "means within 1 %. The interval of E_C and angles is over the surfaces, that of the "
        f"seconds over the rounds. {NOT_DETECTED}",
    )


def _sides_row(what: str, found: PairedComparison) -> tuple[Value, ...]:
    counts = (found.lower, found.equal, found.higher)
    return (
        words(what),
        *(Value(str(count), count, "derived") for count in counts),
        _ratio(found.ratio),
        _ratio(found.low),
        _ratio(found.high),
    )


def _ratio(value: float | None) -> Value:
    if value is None:
        return missing("too few surfaces or rounds")
    return Value(f"{value:.3f}", value, "derived")


def _pairs_table(against: BaselineComparison, title: str, records: dict[str, Record]) -> Table:
    groups = (against.energy_name, "mean angle error, °", "seconds")
    columns = [Column("surface", numeric=False), Column("faces")]
    for group in groups:
        columns += [Column(title, group), Column(against.title, group), Column("ratio", group)]
    return Table(
        name=f"against-{against.baseline}",
        title=f"{title} and {against.title}, surface by surface",
        columns=tuple(columns),
        rows=tuple(_pair_row(pair, records) for pair in against.pairs),
        notes=(
            "a dash: no valid map, or no positive figure to divide by",
            *_about_solve_time(against),
        ),
    )


def _about_solve_time(against: BaselineComparison) -> tuple[str, ...]:
    if not against.solve_time:
        return ()
    of = (
        f"{p.surface} {p.solve_seconds:.4f} of {p.seconds:.4f}"
        for p in against.pairs
        if p.solve_seconds is not None and p.seconds is not None
    )
    return (
        "an external program: its seconds are the wall clock of a process, with its start and its "
        f"files; the ratio is of its solve time ({against.solve_time}): {', '.join(of)}",
    )


def _pair_row(pair: Pair, records: dict[str, Record]) -> tuple[Value, ...]:
    ours, theirs = pair.records
    known = records.get(ours)
    origin: Origin = known.mesh.origin if known else "surface"

    def both(mine: float | None, other: float | None, form: str) -> tuple[Value, ...]:
        return (_measured(mine, form, origin, ours), _measured(other, form, origin, theirs))

    return (
        words(pair.surface),
        Value(f"{pair.faces:,}", pair.faces),
        *both(pair.energy, pair.baseline_energy, ".6f"),
        _ratio(quotient(pair.energy, pair.baseline_energy)),
        *both(pair.angle, pair.baseline_angle, ".3f"),
        _ratio(quotient(pair.angle, pair.baseline_angle)),
        *both(pair.seconds, pair.baseline_seconds, ".4f"),
        _ratio(pair.seconds_ratio),
    )


def _measured(value: float | None, form: str, origin: Origin, record: str) -> Value:
    if value is None:
        return missing("no valid map")
    return Value(format(value, form), value, origin, record)


def quotient(ours: float | None, theirs: float | None) -> float | None:
    """Return ours over theirs; None if one is missing or theirs is not positive."""
    return None if ours is None or theirs is None or theirs <= 0 else ours / theirs


def _growth_table(found: GrowthComparison) -> Table:
    growths = (found.ours, *found.others)
    sizes = dict.fromkeys(faces for growth in growths for faces in growth.faces)
    rows = []
    for growth in growths:
        at = dict(zip(growth.faces, growth.seconds, strict=True))
        cells = [
            Value(f"{at[f]:.4f}", at[f], "surface") if f in at else missing("not timed")
            for f in sizes
        ]
        rows.append(
            (
                words(growth.what),
                *cells,
                *(_exponent(value) for value in (growth.exponent, growth.low, growth.high)),
            )
        )
    return Table(
        name="growth",
        title="Seconds by number of triangles",
        columns=(
            Column("what", numeric=False),
            *(Column(f"{faces:,}", "faces") for faces in sizes),
            Column("exponent"),
            Column("low", "95 % interval"),
            Column("high", "95 % interval"),
        ),
        rows=tuple(rows),
        caption="Exponent: of the seconds between the two largest sizes, the median over the "
        f"rounds. {_CLOCKS[found.clock]}",
    )


def _exponent(value: float | None) -> Value:
    return missing("too few rounds") if value is None else Value(f"{value:.2f}", value, "derived")


def _growth_plot(found: GrowthComparison) -> Plot:
    growths: Sequence[Growth] = (found.ours, *found.others)
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
