"""A validation on a terminal of 80 columns."""

from __future__ import annotations

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from cembench.validation.finding import ValidationFinding
from cembench.validation.quality import BaselineComparison, Pair, PairedComparison
from cembench.validation.scaling import Growth
from cembench.validation.verdict import STAGES, Validation, sentence


def validation_text(validation: Validation) -> RenderableType:
    """The findings, the figures, and the verdict at the end."""
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
        if stage == "scaling" and validation.growths:
            parts += [Text(), growths_table(validation.growths)]
    style = "bold green" if validation.passed else "bold red"
    return Group(*parts, Text(), Text(f"{validation.title}: {sentence(validation)}.", style=style))


def _finding_lines(finding: ValidationFinding) -> Iterator[RenderableType]:
    mark = Text("  ok  ", style="green") if finding.ok else Text("  BAD ", style="bold red")
    line = Table.grid()
    line.add_column(width=6)
    line.add_column()
    line.add_row(mark, Text.assemble((finding.name, "bold"), f": {finding.measured}"))
    yield line
    if not finding.ok:
        for label, words in (("allowed", finding.allowed), ("to do", finding.remedy)):
            yield Padding(Text(f"{label}: {words}", style="dim"), (0, 0, 0, 8))


def _pairs_table(against: BaselineComparison, title: str) -> Table:
    table = Table(
        box=None,
        pad_edge=False,
        collapse_padding=True,
        header_style="bold",
        title=f"{title} / {against.title}",
        title_justify="left",
        title_style="bold",
    )
    program = bool(against.solve_time)
    table.add_column("surface", overflow="ellipsis", no_wrap=True, max_width=12 if program else 18)
    times = ("wall", "start", "solve") if program else ("seconds",)
    for heading in ("faces", "E_C", "ratio", "mean °", "ratio", *times, "ratio"):
        table.add_column(heading, justify="right", no_wrap=True)
    for pair in against.pairs:
        table.add_row(*_pair_cells(pair, program=program))
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
    """Ours over theirs; a dash where there is none, or where theirs is no positive figure."""
    if ours is None or theirs is None or theirs <= 0:
        return "-"
    return f"{ours / theirs:.3f}"


def growths_table(growths: tuple[Growth, ...]) -> Table:
    """Seconds by size and the fitted exponents."""
    table = Table(box=None, pad_edge=False, collapse_padding=True, header_style="bold")
    table.add_column("seconds")
    for faces in growths[0].faces:
        table.add_column(f"{faces:,} faces", justify="right")
    table.add_column("exponent", justify="right")
    table.add_column("rounds", justify="right")
    for growth in growths:
        table.add_row(
            growth.what,
            *(f"{seconds:.4f}" for seconds in growth.seconds),
            f"{growth.exponent:.2f}",
            f"{growth.low:.2f}-{growth.high:.2f}",
        )
    return table


def sides_text(found: PairedComparison) -> str:
    """On how many lower, equal, higher, and the median ratio."""
    words = f"lower on {found.lower}, equal within 1 % on {found.equal}, higher on {found.higher}"
    if found.ratio is None:
        return words
    words += f"; median ratio {found.ratio:.3f}"
    return words if found.low is None else f"{words} ({found.low:.3f}-{found.high:.3f})"


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
