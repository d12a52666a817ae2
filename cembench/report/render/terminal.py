"""Tables of records for a terminal of 80 columns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from types import MappingProxyType

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cembench.conformal.atlas import ATLAS_METRICS
from cembench.conformal.metrics import METRICS, Metric, metrics_shown
from cembench.report.render.grid import GridColumn, figures, grid, names, words
from cembench.report.surface_facts import SurfaceFacts, row_check
from cembench.results.comparison import (
    UNSTABLE_WIDTH,
    Comparison,
    circumstances,
    compare,
    is_unstable,
    references,
    seconds_interval,
)
from cembench.results.external_words import mark_of, marks_explained, seconds_words
from cembench.results.machines import Environments, Marks, marks
from cembench.results.many import corrected
from cembench.results.papers import paper_of
from cembench.results.records import DEFAULT_ROUNDS, Cell, Record
from cembench.results.runs_compared import Change
from cembench.running.estimate import Estimate

_STYLES = {"ok": "green", "skipped": "yellow"}


def status_style(status: str) -> str:
    """Return the colour of a status."""
    return _STYLES.get(status, "bold red")


def results_table(
    records: Iterable[Record], environments: Environments = MappingProxyType({})
) -> RenderableType:
    """Return the results, one row per cell, grouped by surface, with a table per policy.

    `environments` are the store's: seconds are marked if they come from several machines. angle°
    and SD° are the mean and the standard deviation of the angle errors in degrees. Seconds are the
    median of the rounds, followed by half the width of its 95 % interval in percent, with a ! if
    that is wide. The causes of cells that did not end ok are listed below.
    """
    ordered = list(records)
    marked = marks(ordered, environments)
    policies = list(dict.fromkeys(record.cell.solves for record in ordered))
    parts: list[RenderableType] = []
    for policy in policies:
        chosen = [record for record in ordered if record.cell.solves == policy]
        if len(policies) > 1:
            parts.append(Text(f"\nsolves: {policy}", style="bold"))
        parts.append(_cells_table(chosen, marked))
    told = [Text(line, style="yellow") for line in marked.explained()]
    return Group(*parts, *told, *_remarks(ordered))


def _cells_table(records: Sequence[Record], marked: Marks) -> Table:
    longest = max((len(_name(record)) for record in records), default=9)
    shown = metrics_shown("overview")
    columns = [
        names("surface", max(8, min(16, 80 - 54 - longest))),
        names("algorithm"),
        *figures(*(metric.heading for metric in shown), "iter", "seconds", "±%"),
        names("status"),
    ]
    rows: list[list[str | Text]] = []
    for mesh, group in groupby(records, key=lambda record: record.cell.mesh):
        for k, record in enumerate(group):
            outcome = record.outcome
            rows.append(
                [
                    mesh if k == 0 else "",
                    _name(record),
                    *(_figure(record, metric) for metric in shown),
                    "-" if outcome.iterations is None else str(outcome.iterations),
                    "-"
                    if outcome.median_seconds is None
                    else f"{outcome.median_seconds:.3f} {marked.of(record)}".rstrip(),
                    _spread(record),
                    Text(outcome.status, style=status_style(outcome.status)),
                ]
            )
    return grid(columns, rows)


def _name(record: Record) -> str:
    """Return an algorithm's name with marks for another target and for external code."""
    marks = ("" if record.target == "disk" else "*") + mark_of(record)
    return f"{record.cell.algorithm} {marks}".rstrip()


def _spread(record: Record) -> Text:
    interval, figure = seconds_interval(record), record.outcome.median_seconds
    if interval is None or not figure:
        return Text("-")
    half = f"{50 * (interval.high - interval.low) / figure:.0f}"
    return Text(half + "!", style="yellow") if is_unstable(record) else Text(half)


def _remarks(records: Sequence[Record]) -> list[Text]:
    remarks = []
    if any(record.target != "disk" for record in records):
        kinds = sorted({f"{r.cell.algorithm}: {r.target}" for r in records if r.target != "disk"})
        remarks.append(Text(f"* not a map to the disk ({'; '.join(kinds)})", style="dim"))
    remarks += [Text(line, style="dim") for line in marks_explained(list(records))]
    if any(is_unstable(record) for record in records):
        told = f"! unstable: the 95 % interval is wider than {UNSTABLE_WIDTH:.0%} of the figure"
        remarks.append(Text(told, style="yellow"))
    noted = [r.neighbours for record in records for r in record.outcome.rounds if r.neighbours]
    busy = sum(neighbours.busy for neighbours in noted)
    if busy:
        told = f"The machine was busy during {busy} of {len(noted)} processes; close other programs"
        remarks.append(Text(f"{told}, or add --repeat-busy.", style="yellow"))
    for record in records:
        name = f"{record.cell.mesh} / {record.cell.algorithm}"
        told = seconds_words(record)
        remarks += [Text(f"{name}: {told}")] if told else []
        remarks += [Text(f"{name}: {note}") for note in record.outcome.notes]
        if record.outcome.cause:
            remarks.append(Text(f"{name}: {record.outcome.cause}"))
    return remarks


def speedups_table(records: Sequence[Record], reference: str) -> RenderableType | None:
    """Return the speedups of the reference over the others, with their intervals.

    If no cell has enough rounds for an interval, a remark says so, and each surface has one row.
    None if there is nothing to compare.
    """
    known = references(records, reference)
    compared = []
    for record in records:
        base = known.get(circumstances(record.cell))
        if base is None or base.cell.algorithm == record.cell.algorithm:
            continue
        found = compare(record, base)
        if found is not None:
            compared.append((record, found))
    if not compared:
        return None
    heading = Text(f"\nSpeedup of {reference} over the others: t / t_{reference} - 1", style="bold")
    if all(found.verdict == "too few rounds" for _, found in compared):
        told = (
            f"There are no intervals: they need {DEFAULT_ROUNDS} rounds "
            f"(cembench run --rounds {DEFAULT_ROUNDS}, or --precision 5%)."
        )
        return Group(heading, _bare_speedups(compared), Text(told, style="dim"))
    table = _sure_speedups(compared, reference)
    return Group(heading, table, *_corrected_words([found for _, found in compared]))


def _corrected_words(found: Sequence[Comparison]) -> list[Text]:
    """Return a remark on the correction of the verdicts, and its effect."""
    tested = [one for one in found if one.interval is not None]
    if len(tested) < 2:
        return []
    lost = sum(
        one.verdict != alone.verdict for one, alone in zip(corrected(tested), tested, strict=True)
    )
    told = (
        f"All verdicts together hold with 95 % (Holm, {len(tested)} comparisons); "
        "each interval holds by itself."
    )
    if lost:
        told += f" Taken alone, {lost} more would be called different; more rounds would decide."
    return [Text(told, style="dim")]


def _sure_speedups(compared: Sequence[tuple[Record, Comparison]], reference: str) -> Table:
    """Return a table with one row per comparison."""
    several = _several_policies(compared)
    rows = []
    together = corrected([found for _, found in compared])
    for (record, _), found in zip(compared, together, strict=True):
        i = found.speedup_interval
        sure = "unknown" if i is None else f"{i.low:.2f} to {i.high:.2f}"
        name = _name(record) + (f" ({record.cell.solves})" if several else "")
        rows.append([record.cell.mesh, name, f"{found.speedup:.2f}", sure, found.verdict])
    return grid(
        [
            names("surface", 16),
            names("algorithm"),
            *figures("speedup", "95 % interval"),
            *words(f"than {reference}"),
        ],
        rows,
    )


def _bare_speedups(compared: Sequence[tuple[Record, Comparison]]) -> Table:
    """Return a table with one row per surface and one column per algorithm."""
    several = _several_policies(compared)
    algorithms = list(dict.fromkeys(_name(record) for record, _ in compared))
    lines: dict[tuple[str, str], dict[str, str]] = {}
    for record, found in compared:
        line = lines.setdefault((record.cell.mesh, record.cell.solves), {})
        line[_name(record)] = f"{found.speedup:.2f}"
    rows = [
        [f"{mesh} ({solves})" if several else mesh, *(line.get(name, "-") for name in algorithms)]
        for (mesh, solves), line in lines.items()
    ]
    columns = [GridColumn(name, figures=True, wraps=True) for name in algorithms]
    return grid([names("surface", 28), *columns], rows)


def _several_policies(compared: Sequence[tuple[Record, Comparison]]) -> bool:
    return len({record.cell.solves for record, _ in compared}) > 1


def changes_table(changes: Sequence[Change]) -> RenderableType:
    """Return the changes from one run to another, as ratios of seconds.

    The ratio is corrected for the drift of the reference kernel, if both runs timed it.
    """
    rows = []
    together = corrected([change.comparison for change in changes])
    for change, found in zip(changes, together, strict=True):
        i = found.interval
        rows.append(
            [
                change.after.cell.mesh,
                change.after.cell.algorithm,
                f"{change.before.outcome.median_seconds:.3f}",
                f"{change.after.outcome.median_seconds:.3f}",
                f"{found.ratio:.2f}",
                "unknown" if i is None else f"{i.low:.2f}-{i.high:.2f}",
                found.verdict,
            ]
        )
    table = grid(
        [
            names("surface", 16),
            names("algorithm"),
            *figures("before", "after", "ratio", "interval"),
            *words("verdict"),
        ],
        rows,
    )
    words_below = [Text(_drift_words(changes), style="dim")]
    return Group(table, *words_below, *_corrected_words([c.comparison for c in changes]))


def _drift_words(changes: Sequence[Change]) -> str:
    """Return a remark on the machine's drift between two runs, and its correction."""
    known = [change.drift for change in changes if change.drift is not None]
    if not known:
        return (
            "The machine's drift between the runs is unknown: not both runs timed the reference "
            "kernel."
        )
    told = "Seconds are divided by those of the reference kernel (rank-sum test, 5 %)"
    told += f", which took {min(known):.2f}"
    told += f" to {max(known):.2f}" if f"{min(known):.2f}" != f"{max(known):.2f}" else ""
    told += " times as long in the later run."
    if len(known) < len(changes):
        told += f" Not corrected: {len(changes) - len(known)}."
    return told


def plan_table(lines: Sequence[tuple[Cell, int, str, Estimate | None]]) -> RenderableType:
    """Return the plan: cells, triangles, what is recorded already, and the estimated cost."""
    rows = []
    for cell, faces, state, cost in lines:
        costs = ("-", "-", "-")
        if cost is not None:
            gib = f"{cost.memory_bytes / 2**30:.1f} GiB"
            costs = (f"{cost.call_seconds:.2g} s", f"{cost.seconds:.0f} s", gib)
        rows.append([cell.mesh, cell.algorithm, cell.solves, f"{faces:,}", *costs, state])
    return grid(
        [
            names("surface", 18),
            names("algorithm"),
            names("solves"),
            *figures("faces", "a call", "in all", "memory"),
            names("from"),
        ],
        rows,
    )


def _figure(record: Record, metric: Metric) -> str:
    found = record.outcome.metrics
    return metric.text(found[metric.name]) if metric.name in found else "-"


def figures_table(record: Record) -> Table:
    """Return all figures of one record, one row each."""
    outcome, facts = record.outcome, record.mesh
    about = (
        f"{record.cell.mesh}: {facts.vertices:,} vertices, {facts.faces:,} "
        f"faces, {facts.boundary_vertices:,} on the boundary, "
        f"{facts.non_delaunay_share:.1%} of the edges not Delaunay"
    )
    rows = [("surface", about)]
    if facts.paper_row:
        rows.append(("in the paper", _printed(record)))
    rows.append(("algorithm", f"{record.title} ({record.target})" + _given(record)))
    if record.external is not None:
        rows.append((f"external {record.external.kind}", record.external.name))
    for metric in (*METRICS, *ATLAS_METRICS):
        if metric.name in outcome.metrics:
            text = metric.text(outcome.metrics[metric.name], precise=True)
            rows.append((metric.title, f"{text} {metric.unit}".rstrip()))
    if outcome.folded_before_repair is not None:
        rows.append(("folded before repair", str(outcome.folded_before_repair)))
    if outcome.iterations:
        rows.append(("iterations", str(outcome.iterations)))
    if outcome.seconds:
        phases = ", ".join(f"{name} {seconds:.3f}" for name, seconds in outcome.phases.items())
        told = seconds_words(record) or f"{outcome.median_seconds:.3f} ({phases})"
        rows.append(("seconds", told))
    interval = seconds_interval(record)
    if interval is not None:
        sure = f"{interval.low:.4f} to {interval.high:.4f} s over {len(outcome.rounds)} rounds"
        rows.append(("95 % interval", sure + (", unstable" if is_unstable(record) else "")))
        rows.append(("fastest call", f"{min(min(r.calls) for r in outcome.rounds):.4f} s"))
    if outcome.memory_increase_bytes is not None and outcome.peak_memory_bytes is not None:
        more = f"{outcome.memory_increase_bytes / 2**20:,.0f} more than before the call"
        whose = "of the program's processes" if record.is_program else more
        peak = f"{outcome.peak_memory_bytes / 2**20:,.0f} MiB at most"
        rows.append(("memory", f"{peak}, {whose}"))
    rows += [("note", str(note)) for note in outcome.notes]
    return grid([GridColumn(style="bold"), GridColumn(wraps=True)], rows, gap=2)


def _printed(record: Record) -> str:
    """Return the paper's printed figures for this surface and algorithm, as text."""
    row, name = record.mesh.paper_row, record.cell.algorithm
    what = f"it is {row}" if record.mesh.origin == "model" else f"it stands in for {row}"
    energy, mean, sd = (
        paper_of(row).printed_figure(column, name, row)
        for column in ("conformal_energy", "angle_error_mean_deg", "angle_error_sd_deg")
    )
    if energy is None or mean is None or sd is None:
        return what
    return f"{what}; printed: E_C {energy:.4f}, mean angle error {mean:.2f}, SD {sd:.2f}"


def _given(record: Record) -> str:
    shown = ", ".join(f"{name}={value}" for name, value in record.cell.parameters.items())
    return f" with {shown}" if shown else ""


def facts_table(known: Mapping[str, SurfaceFacts]) -> RenderableType:
    """Return counts of surfaces, whether these are the paper's, and conformal-factor spans."""
    rows: list[list[str | Text]] = []
    for name, facts in sorted(known.items(), key=lambda item: item[1].mesh.faces):
        mesh, check = facts.mesh, row_check(facts.mesh)
        verdict = "-" if check is None else "ok" if check["ok"] else "off"
        rows.append(
            [
                name,
                f"{mesh.vertices:,}",
                f"{mesh.faces:,}",
                f"{mesh.boundary_vertices:,}",
                f"{mesh.non_delaunay_share:.1%}",
                f"{facts.conformal_factor_span:.2g}",
                Text(verdict, style="bold red" if verdict == "off" else ""),
            ]
        )
    heads = figures("vertices", "faces", "boundary", "not Delaunay", "span")
    table = grid([names("surface"), *heads, names("in print")], rows)
    folders = dict.fromkeys(str(Path(facts.thumbnail).parent) for facts in known.values())
    span = "span: largest over smallest conformal factor of a triangle (ratio of lengths), by CEM"
    return Group(table, Text(f"{span}\nthumbnails: {', '.join(folders)}", style="dim"))
