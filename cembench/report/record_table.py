"""The figures of one record as a table, as `map` and `show` print them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from cembench.conformal.texel_density import ISLANDS, needs_islands, texture_words
from cembench.report.document import Column, Table
from cembench.results.columns import FIGURES, seconds_words
from cembench.results.comparison import is_unstable, seconds_interval
from cembench.results.papers import paper_of
from cembench.results.records import Record


def figures_table(record: Record, *, full: bool = True) -> Table:
    """Return the figures of one record, one row each: all of them, or those most looked at."""
    columns = [Column("", numeric=False)] * 2
    return Table.of("record", "", columns, list((_figures if full else _few_figures)(record)))


def _few_figures(record: Record) -> Iterator[tuple[str, str]]:
    facts, outcome = record.mesh, record.outcome
    size = f"{facts.vertices:,} vertices, {facts.faces:,} triangles"
    yield "surface", f"{record.cell.mesh}: {size}"
    if facts.paper_row:
        yield "in the paper", _printed(record)
    seconds = outcome.median_seconds
    took = "" if seconds is None else f", {seconds_words(record) or f'{seconds:.3f} s'}"
    yield "algorithm", f"{record.title} ({record.target}){took}"
    yield from _chosen(record)
    if outcome.metrics.get("angle_error_mean_deg") is not None:
        angles, folds = (outcome.metrics[n] for n in ("angle_error_mean_deg", "flipped_triangles"))
        shown = f"{angles:.2f} degrees mean angle error, {folds} folds"
        yield "quality", f"{shown}; -v prints all figures"
    if texture := texture_words(outcome.metrics):
        yield "texture", texture
    if outcome.folded_before_repair:
        yield "folded before repair", str(outcome.folded_before_repair)
    yield from _notes(record)


def _chosen(record: Record) -> Iterator[tuple[str, str]]:
    """Yield which of several algorithms made the map, and the angle errors of all of them."""
    chosen, tried = (record.outcome.extras.get(key) for key in ("chosen", "tried"))
    if isinstance(chosen, str) and isinstance(tried, Mapping):
        errors = (f"{n} {e:.2f}" if isinstance(e, float) else f"{n} none" for n, e in tried.items())
        yield "chosen", f"{chosen}, by the angle errors in degrees: {', '.join(errors)}"


def _notes(record: Record) -> Iterator[tuple[str, str]]:
    yield from (("note", str(note)) for note in record.outcome.notes)
    if record.outcome.status == "ok" and needs_islands(record.outcome.metrics):
        yield "note", ISLANDS


def _figures(record: Record) -> Iterator[tuple[str, str]]:
    outcome, facts = record.outcome, record.mesh
    yield (
        "surface",
        f"{record.cell.mesh}: {facts.vertices:,} vertices, {facts.faces:,} "
        f"faces, {facts.boundary_vertices:,} on the boundary, "
        f"{facts.non_delaunay_share:.1%} of the edges not Delaunay",
    )
    if facts.paper_row:
        yield "in the paper", _printed(record)
    given = ", ".join(f"{name}={value}" for name, value in record.cell.parameters.items())
    with_given = f" with {given}" if given else ""
    yield "algorithm", f"{record.title} ({record.target}){with_given}"
    yield from _chosen(record)
    if record.external is not None:
        yield f"external {record.external.kind}", record.external.name
    for metric in FIGURES:
        if metric.name in outcome.metrics:
            text = metric.text(outcome.metrics[metric.name], precise=True)
            yield metric.title, f"{text} {metric.unit}".rstrip()
    if outcome.folded_before_repair is not None:
        yield "folded before repair", str(outcome.folded_before_repair)
    if outcome.iterations:
        yield "iterations", str(outcome.iterations)
    if outcome.seconds:
        phases = ", ".join(f"{name} {seconds:.3f}" for name, seconds in outcome.phases.items())
        yield "seconds", seconds_words(record) or f"{outcome.median_seconds:.3f} ({phases})"
    interval = seconds_interval(record)
    if interval is not None:
        unstable = ", unstable" if is_unstable(record) else ""
        ends = f"{interval.low:.4f} to {interval.high:.4f} s"
        yield "95 % interval", f"{ends} over {len(outcome.rounds)} rounds{unstable}"
        yield "fastest call", f"{min(min(r.calls) for r in outcome.rounds):.4f} s"
    if outcome.memory_increase_bytes is not None and outcome.peak_memory_bytes is not None:
        more = f"{outcome.memory_increase_bytes / 2**20:,.0f} more than before the call"
        whose = "of the program's processes" if record.is_program else more
        yield "memory", f"{outcome.peak_memory_bytes / 2**20:,.0f} MiB at most, {whose}"
    yield from _notes(record)


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
