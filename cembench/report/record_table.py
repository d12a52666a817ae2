"""The figures of one record as a table, as `map` and `show` print them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from cembench.conformal.texel_density import ISLANDS, density_words, needs_islands, texture_words
from cembench.report.document import Table
from cembench.results.columns import FIGURES, MIB, seconds_words, significant
from cembench.results.comparison import is_unstable, seconds_interval
from cembench.results.frame import listed
from cembench.results.papers import paper_of
from cembench.results.records import Record


def figures_table(
    record: Record, *, full: bool = True, more: Iterable[tuple[str, str]] = ()
) -> Table:
    """Return the figures of one record, one row each: all of them, or those most looked at.

    `more` are further rows, of a name and words each; those without words are left out.
    """
    rows = [*(_whole(record) if full else _most_looked_at(record))]
    rows += (("note", str(note)) for note in record.outcome.notes)
    rows += [("note", texture_advice(record))] if full else []
    return Table.of("record", "", ["", ""], [row for row in (*rows, *more) if row[1]])


def texture_advice(record: Record) -> str:
    """Return what to do where a valid map is not usable as a texture; "" where it is.

    A map to the disk has a free boundary to try first.
    """
    if record.outcome.status != "ok" or not needs_islands(record.outcome.metrics):
        return ""
    free = "try a free boundary first, with the algorithm bff-free; else " * (
        record.target == "disk"
    )
    return ISLANDS.replace(": ", f": {free}", 1)


def _most_looked_at(record: Record) -> Iterator[tuple[str, str]]:
    mesh, outcome = record.mesh, record.outcome
    yield "surface", f"{record.cell.mesh}: {mesh.vertices:,} vertices, {mesh.faces:,} triangles"
    yield "in the paper", _printed(record)
    took = "" if outcome.median_seconds is None else f", {_seconds(record, ' s')}"
    yield "algorithm", f"{record.title} ({record.target}){took}"
    yield "chosen", _chosen(record)
    error, folds = map(outcome.metrics.get, ("angle_error_mean_deg", "flipped_triangles"))
    if error is not None:
        quality = f"{error:.2f} degrees mean angle error, {folds} folds"
        yield "quality", f"{quality}; -v prints all figures"
    yield "texture", texture_words(outcome.metrics)
    yield "folded before repair", str(outcome.folded_before_repair or "")


def _whole(record: Record) -> Iterator[tuple[str, str]]:
    mesh, outcome = record.mesh, record.outcome
    yield (
        "surface",
        f"{record.cell.mesh}: {mesh.vertices:,} vertices, {mesh.faces:,} faces, "
        f"{mesh.boundary_vertices:,} on the boundary, {100 * mesh.non_delaunay_share:.1f} % of the "
        "edges not Delaunay",
    )
    yield "in the paper", _printed(record)
    given = (f"{name}={value}" for name, value in record.cell.parameters.items())
    yield "algorithm", f"{record.title} ({record.target}){listed(' with ', given, between=', ')}"
    yield "chosen", _chosen(record)
    if record.external is not None:
        yield f"external {record.external.kind}", record.external.name
    for metric in FIGURES:
        if metric.name in outcome.metrics:
            text = metric.text(outcome.metrics[metric.name], precise=True)
            yield metric.title, f"{text} {metric.unit}".rstrip()
    if outcome.folded_before_repair is not None:
        yield "folded before repair", str(outcome.folded_before_repair)
    yield "iterations", str(outcome.iterations or "")
    phases = ", ".join(f"{name} {significant(s)}" for name, s in outcome.phases.items())
    yield "seconds", "" if outcome.median_seconds is None else _seconds(record, f" ({phases})")
    if interval := seconds_interval(record):
        low, high = (significant(end, 4) for end in (interval.low, interval.high))
        unstable = ", unstable" if is_unstable(record) else ""
        yield "95 % interval", f"{low} to {high} s over {len(outcome.rounds)} rounds{unstable}"
        fastest = min(min(measured.calls) for measured in outcome.rounds)
        yield "fastest call", f"{significant(fastest, 4)} s"
    if outcome.memory_increase_bytes is not None and outcome.peak_memory_bytes is not None:
        more = f"{outcome.memory_increase_bytes / MIB:,.0f} more than before the call"
        about = "of the program's processes" if record.is_program else more
        yield "memory", f"{outcome.peak_memory_bytes / MIB:,.0f} MiB at most, {about}"


def _seconds(record: Record, after: str) -> str:
    """Return the seconds, and what comes after them; or those of an external program."""
    return seconds_words(record) or f"{significant(record.outcome.median_seconds or 0.0)}{after}"


def _chosen(record: Record) -> str:
    """Return which algorithm was chosen, and the figures of those that it was chosen from."""
    chosen, tried = (record.outcome.extras.get(key) for key in ("chosen", "tried"))
    if not (isinstance(chosen, str) and isinstance(tried, Mapping) and tried):
        return ""
    compared = ", ".join(f"{name} {_compared(one)}" for name, one in tried.items())
    return f"{chosen}, by the angle errors in degrees (and texel density): {compared}"


def _compared(one: Any) -> str:
    """Return the figures of a map that was compared, or "none"; records before them have errors."""
    if not isinstance(one, Mapping):
        return f"{one:.2f}" if isinstance(one, float) else "none"
    return f"{one['angle_error_mean_deg']:.2f} ({density_words(one['texel_density_ratio'])})"


def _printed(record: Record) -> str:
    """Return the paper's printed figures for this surface and algorithm; "" for other surfaces."""
    row, name = record.mesh.paper_row, record.cell.algorithm
    if not row:
        return ""
    what = f"it is {row}" if record.mesh.origin == "model" else f"it stands in for {row}"
    energy, mean, sd = (
        paper_of(row).printed_figure(column, name, row)
        for column in ("conformal_energy", "angle_error_mean_deg", "angle_error_sd_deg")
    )
    if energy is None or mean is None or sd is None:
        return what
    return f"{what}; printed: E_C {energy:.4f}, mean angle error {mean:.2f}, SD {sd:.2f}"
