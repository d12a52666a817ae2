"""The figures of one record as a table, as `map` and `show` print them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from cembench.conformal.texel_density import ISLANDS, density_words, needs_islands, texture_words
from cembench.report.declarations import own
from cembench.report.document import Table
from cembench.results.columns import COLUMNS, FIGURES, seconds_words, significant
from cembench.results.frame import filled, phrase
from cembench.results.papers import paper_of
from cembench.results.records import Record


def figures_table(
    record: Record, *, full: bool = True, more: Iterable[tuple[str, str]] = ()
) -> Table:
    """Return the figures of one record, one row each: all of them, or those most looked at.

    `more` are further rows, of a name and words each; those without words are left out.
    """
    known, rows = _known(record), list[tuple[str, str]]()
    for line in own("record.toml")["lines"]:
        if line.get("in", "") == ("few" if full else "full"):
            continue
        if line["name"] == "metrics":
            rows += _metrics(record)
        elif words := phrase([line], {}, known):
            rows.append((filled(line["name"], {}, known), words))
    rows += (("note", str(note)) for note in record.outcome.notes)
    if full and (advice := texture_advice(record)):
        rows.append(("note", advice))
    rows += ((name, words) for name, words in more if words)
    return Table.of("record", "", ["", ""], rows)


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


def _known(record: Record) -> dict[str, Any]:
    """Return the columns of a record, and what of it needs words of its own.

    `tried` are the angle errors of the algorithms that one was `chosen` from.
    """
    outcome, known = record.outcome, {name: one.of(record) for name, one in COLUMNS.items()}
    seconds, spoken = outcome.median_seconds, seconds_words(record)
    chosen, tried = (outcome.extras.get(key) for key in ("chosen", "tried"))
    phases = ", ".join(f"{name} {significant(s)}" for name, s in outcome.phases.items())
    compared = tried if isinstance(chosen, str) and isinstance(tried, Mapping) else {}
    return known | {
        "in_the_paper": _printed(record) if record.mesh.paper_row else "",
        "took": "" if seconds is None else f", {spoken or f'{significant(seconds)} s'}",
        "timing": "" if seconds is None else spoken or f"{significant(seconds)} ({phases})",
        "given": [f"{name}={value}" for name, value in record.cell.parameters.items()],
        "chosen": chosen,
        "tried": [f"{name} {_compared(one)}" for name, one in compared.items()],
        "texture": texture_words(outcome.metrics),
    }


def _compared(one: Any) -> str:
    """Return the figures of a map that was compared, or "none"; records before them have errors."""
    if not isinstance(one, Mapping):
        return f"{one:.2f}" if isinstance(one, float) else "none"
    return f"{one['angle_error_mean_deg']:.2f} ({density_words(one['texel_density_ratio'])})"


def _metrics(record: Record) -> Iterator[tuple[str, str]]:
    held = record.outcome.metrics
    for metric in FIGURES:
        if metric.name in held:
            text = metric.text(held[metric.name], precise=True)
            yield metric.title, f"{text} {metric.unit}".rstrip()


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
