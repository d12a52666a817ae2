"""Records as tables on a terminal of 80 columns."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from cembench.records import Record
from cembench.registry import Algorithm, Surface

_STYLES = {"ok": "green", "skipped": "yellow"}


def results_table(records: Iterable[Record]) -> RenderableType:
    """One line a cell, surfaces apart; the causes of what did not end ok stand below.

    Mean and SD are of the angles' errors in degrees; seconds are the median of the timed calls.
    """
    table = Table(box=None, pad_edge=False, collapse_padding=True, header_style="bold")
    table.add_column("surface", overflow="ellipsis", no_wrap=True, max_width=16)
    table.add_column("algorithm", no_wrap=True)
    for heading in ("E_C", "mean", "SD", "folds", "iter", "seconds"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("status", no_wrap=True)
    below: list[Text] = []
    ordered = list(records)
    for mesh, group in groupby(ordered, key=lambda record: record.cell.mesh):
        for k, record in enumerate(group):
            outcome = record.outcome
            table.add_row(
                mesh if k == 0 else "",
                record.cell.algorithm + ("" if record.target == "disk" else " *"),
                _figure(record, "conformal_energy", ".4f"),
                _figure(record, "angle_error_mean_deg", ".2f"),
                _figure(record, "angle_error_sd_deg", ".2f"),
                _figure(record, "flipped_triangles", "d"),
                "-" if outcome.iterations is None else str(outcome.iterations),
                "-" if outcome.median_seconds is None else f"{outcome.median_seconds:.3f}",
                Text(outcome.status, style=_STYLES.get(outcome.status, "bold red")),
            )
            if outcome.cause:
                below.append(Text(f"{mesh} / {record.cell.algorithm}: {outcome.cause}"))
        table.add_section()
    if any(record.target != "disk" for record in ordered):
        kinds = sorted({f"{r.cell.algorithm}: {r.target}" for r in ordered if r.target != "disk"})
        below.insert(0, Text(f"* not a map to the disk ({'; '.join(kinds)})", style="dim"))
    return Group(table, *below)


def _figure(record: Record, name: str, form: str) -> str:
    if name not in record.outcome.metrics:
        return "-"
    value = record.outcome.metrics[name]
    return "inf" if value is None else format(value, form)


def figures_table(record: Record) -> Table:
    """All figures of one record, a line each."""
    outcome, facts = record.outcome, record.mesh
    table = Table(box=None, show_header=False, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    table.add_row(
        "surface",
        f"{record.cell.mesh}: {facts.vertices:,} vertices, {facts.faces:,} "
        f"faces, {facts.boundary_vertices:,} on the boundary, "
        f"{facts.non_delaunay_share:.1%} of the edges not Delaunay",
    )
    table.add_row("algorithm", f"{record.title} ({record.target})" + _given(record))
    for label, name, form, unit in (
        ("conformal energy", "conformal_energy", ".6f", ""),
        ("angle error", "angle_error_mean_deg", ".4f", " degrees in the mean"),
        ("", "angle_error_sd_deg", ".4f", " degrees standard deviation"),
        ("folded triangles", "flipped_triangles", "d", ""),
        ("dilatation", "dilatation_mean", ".4f", " in the mean"),
        ("", "dilatation_max", ".4f", " at most"),
        ("image area", "image_area", ".6f", ""),
        ("circularity", "boundary_circularity", ".1e", " off the circle at most"),
    ):
        if name in outcome.metrics:
            table.add_row(label, _figure(record, name, form) + unit)
    if outcome.iterations:
        table.add_row("iterations", str(outcome.iterations))
    if outcome.seconds:
        phases = ", ".join(f"{name} {seconds:.3f}" for name, seconds in outcome.phases.items())
        table.add_row("seconds", f"{outcome.median_seconds:.3f} ({phases})")
    return table


def _given(record: Record) -> str:
    shown = ", ".join(f"{name}={value}" for name, value in record.cell.parameters.items())
    return f" with {shown}" if shown else ""


def algorithms_table(algorithms: Sequence[Algorithm], *, verbose: bool) -> RenderableType:
    """What algorithms are there; with `verbose` also what each is faithful to and decides."""
    if not verbose:
        table = Table(box=None, pad_edge=False, header_style="bold")
        for heading in ("algorithm", "maps to", "from", "parameters (defaults)"):
            table.add_column(heading)
        for a in algorithms:
            table.add_row(a.name, a.target, a.mesh_type.__name__, _parameters(a))
        return table
    parts: list[RenderableType] = []
    for a in algorithms:
        parts += [
            Text.assemble((a.name, "bold"), f"  {a.title}: {a.mesh_type.__name__} to {a.target}"),
            Text(f"  source: {a.source or 'not given'}"),
            Text(f"  parameters: {_parameters(a) or 'none'}"),
            Padding(_flowing(a.notes), (0, 0, 1, 2)),
        ]
    return Group(*parts)


def surfaces_table(surfaces: Sequence[Surface], *, verbose: bool) -> RenderableType:
    """What surface families are there?"""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("surface", "title", "parameters (defaults)"):
        table.add_column(heading)
    if verbose:
        table.add_column("about")
    for s in surfaces:
        row = [s.name, s.title, _parameters(s)]
        table.add_row(*row, *([_flowing(s.notes)] if verbose else []))
    return table


def _flowing(text: str) -> str:
    """Let paragraphs of a docstring wrap at the terminal's width."""
    return "\n\n".join(" ".join(part.split()) for part in text.split("\n\n"))


def _parameters(registered: Algorithm | Surface) -> str:
    return ", ".join(f"{p.name}={p.default}" for p in registered.parameters)
