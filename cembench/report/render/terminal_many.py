"""A run over many surfaces on a terminal, one row per algorithm."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from statistics import median, quantiles

from rich.console import Group, RenderableType
from rich.text import Text

from cembench.report.render.grid import figures, grid, names
from cembench.results.machines import Environments, marks
from cembench.results.records import Record

#: Maximum number of causes listed.
TOLD = 8


def many_table(records: Sequence[Record]) -> RenderableType:
    """Return valid maps, angle errors, seconds and failures by algorithm."""
    by_algorithm: dict[str, list[Record]] = {}
    for record in records:
        by_algorithm.setdefault(record.cell.algorithm, []).append(record)
    columns = [
        names("algorithm", 24),
        *figures("surfaces", "ok", "share", "median°", "90 %°", "worst°", "seconds"),
    ]
    lines = [_line(name, found) for name, found in by_algorithm.items()]
    surfaces = len({record.cell.mesh_hash for record in records})
    title = f"Valid maps, angle errors and median seconds over {surfaces} surfaces"
    causes = Counter(
        (record.cell.algorithm, record.outcome.status, fault.kind.replace("_", " "))
        for record in records
        for fault in record.outcome.faults
    )
    told = [
        Text(f"{count:>6}  {name}: {status}, {kind}", style="dim")
        for (name, status, kind), count in causes.most_common(TOLD)
    ]
    if len(causes) > TOLD:
        told.append(Text(f"        and {len(causes) - TOLD} other kinds", style="dim"))
    return Group(grid(columns, lines, title=title), *([Text("")] if told else []), *told)


def machine_lines(records: Sequence[Record], environments: Environments) -> list[Text]:
    """Say that the median seconds are of several machines, if they are."""
    marked = marks(records, environments)
    if not marked.letters:
        return []
    told = f"! median seconds are over surfaces on {len(marked.letters)} machines, which mixes them"
    return [Text(told, style="yellow"), *(Text(t, style="dim") for t in marked.explained())]


def _line(name: str, records: Sequence[Record]) -> list[str]:
    ok = [record for record in records if record.outcome.status == "ok"]
    errors = [
        float(error)
        for record in ok
        if (error := record.outcome.metrics.get("angle_error_mean_deg")) is not None
    ]
    seconds = [s for record in ok if (s := record.outcome.median_seconds) is not None]
    told = ["-", "-", "-"]
    if errors:
        ninth = quantiles(errors, n=10, method="inclusive")[8] if len(errors) > 1 else errors[0]
        told = [f"{value:.2f}" for value in (median(errors), ninth, max(errors))]
    share = f"{100 * len(ok) / len(records):.1f}%"
    time = f"{median(seconds):.3g}" if seconds else "-"
    return [name, str(len(records)), str(len(ok)), share, *told, time]
