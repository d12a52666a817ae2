"""A validation, printed for a terminal of 80 columns."""

from __future__ import annotations

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from cembench.report.render.grid import GridColumn, figures, grid, names, words
from cembench.results.comparison import NOT_DETECTED
from cembench.validation.finding import ValidationFinding
from cembench.validation.quality import BaselineComparison, Pair
from cembench.validation.scaling import GrowthComparison
from cembench.validation.verdict import STAGES, Validation, sentence


def validation_text(validation: Validation) -> RenderableType:
    """Return the findings, the figures, and the verdict at the end."""
    parts: list[RenderableType] = []
    for stage in STAGES:
        found = [finding for finding in validation.findings if finding.stage == stage]
        why = validation.skipped.get(stage)
        if found or why:
            parts.append(Text(stage, style="bold"))
        parts += [part for finding in found for part in _finding_lines(finding)]
        if why:
            parts.append(Text(f"  --  {why}", style="yellow"))
        if stage == "quality":
            for against in validation.against:
                parts += [Text(), _pairs_table(against, validation.title), Text()]
        if stage == "scaling" and validation.growth:
            parts += [Text(), growth_table(validation.growth)]
    style = "bold green" if validation.passed else "bold red"
    parts += [Text(), Text(f"{validation.title}: {sentence(validation)}.", style=style)]
    if any(against.speed is not None for against in validation.against):
        parts.append(Text(NOT_DETECTED, style="dim"))
    return Group(*parts)


def _finding_lines(finding: ValidationFinding) -> Iterator[RenderableType]:
    mark = Text("  ok  ", style="green") if finding.ok else Text("  BAD ", style="bold red")
    if finding.undecided:
        mark = Text("  ??  ", style="yellow")
    told = Text.assemble((finding.name, "bold"), f": {finding.measured}")
    yield grid([GridColumn(), GridColumn(wraps=True)], [[mark, told]], gap=0)
    if not finding.ok:
        for label, said in (("allowed", finding.allowed), ("to do", finding.remedy)):
            yield Padding(Text(f"{label}: {said}", style="dim"), (0, 0, 0, 8))


def _pairs_table(against: BaselineComparison, title: str) -> Table:
    program = bool(against.solve_time)
    times = ("wall", "start", "solve") if program else ("seconds",)
    heads = figures("faces", "E_C", "ratio", "mean °", "ratio", *times, "ratio")
    table = grid(
        [names("surface", 12 if program else 18), *heads],
        [_pair_cells(pair, program=program) for pair in against.pairs],
        title=f"{title} / {against.title}",
    )
    if program:
        table.caption = (
            "external program: wall is its process, start the same on a small mesh, solve "
            f"{against.solve_time}; the last ratio is of solve"
        )
        table.caption_justify = "left"
    return table


def _pair_cells(pair: Pair, *, program: bool) -> tuple[str, ...]:
    more = (pair.start_seconds, pair.solve_seconds) if program else ()
    return (
        pair.surface,
        f"{pair.faces:,}",
        _number(pair.energy, ".5f"),
        ratio_text(pair.energy, pair.baseline_energy),
        _number(pair.angle, ".3f"),
        ratio_text(pair.angle, pair.baseline_angle),
        *(_number(seconds, ".3f" if program else ".4f") for seconds in (pair.seconds, *more)),
        _number(pair.seconds_ratio, ".2f"),
    )


def ratio_text(ours: float | None, theirs: float | None) -> str:
    """Return ours over theirs; a dash if one is missing or theirs is not positive."""
    if ours is None or theirs is None or theirs <= 0:
        return "-"
    return f"{ours / theirs:.3f}"


def growth_table(found: GrowthComparison) -> Table:
    """Return a table of seconds by size with the exponents and their intervals."""
    growths = (found.ours, *found.others)
    sizes = [f"{faces:,} faces" for faces in found.ours.faces]
    rows = [
        [
            growth.what,
            *(f"{seconds:.4f}" for seconds in growth.seconds),
            f"{growth.exponent:.2f}",
            "-" if growth.low is None else f"{growth.low:.2f}-{growth.high:.2f}",
        ]
        for growth in growths
    ]
    columns = [
        GridColumn(head, figures=True, wraps=True) for head in (*sizes, "exponent", "interval")
    ]
    seconds = "CPU seconds" if found.clock == "cpu" else "seconds"
    return grid([*words(seconds), *columns], rows)


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
