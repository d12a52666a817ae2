"""Exhibit of the tests of Section 4 of the paper on a surface: tables, and a picture of plots."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cembench.core.arrays import Real
from cembench.core.atomic import write_bytes
from cembench.report.palette import PLAIN, series_styles
from cembench.report.plots import Axis, Kind, Plot, PlotPanel, PlotSeries, picture_of
from cembench.results.exhibits import (
    Exhibit,
    ExhibitPicture,
    ExhibitTable,
    place_of,
    write_exhibit,
)

from .exhibit_tables import exhibit_table
from .theory_facts import TheoryFacts

#: Below this, the excess of an energy over the lowest is rounding.
LEAST = 1e-12
#: The file of the picture.
PICTURE = "theory.png"


def exhibit_name(surface: str) -> str:
    """Return the name of a surface's exhibit."""
    return f"theory-{surface}"


def add_exhibit(run: Path, of_disk: TheoryFacts, command: str) -> None:
    """Add the exhibit of what was found to a run; `command` is the one that makes it again."""
    exhibit = theory_exhibit(of_disk, command)
    write_bytes(place_of(run, exhibit.name, PICTURE), picture_of(_plot(of_disk)))
    write_exhibit(run, exhibit)


def theory_exhibit(of_disk: TheoryFacts, command: str) -> Exhibit:
    """Return what was found as an exhibit: a summary, tables, and the name of a picture."""
    facts = dict(of_disk.facts)
    return Exhibit(
        name=exhibit_name(facts["mesh"]),
        title=f"Section 4 on {facts['mesh']}",
        text=f"{_size(facts)}. {_summary(facts)}"
        + (f" {of_disk.missing}" if of_disk.missing else ""),
        command=command,
        origin=facts["origin"],
        pictures=(
            ExhibitPicture(
                file=PICTURE,
                caption="Spectrum of K, conformal energy and steps of the bare iterations.",
                alternative=_summary(facts),
            ),
        ),
        tables=tuple(_tables(facts)),
        facts=facts,
    )


def _size(facts: Mapping[str, Any]) -> str:
    return f"{facts['vertices']:,} vertices, {facts['boundary_vertices']} on the boundary"


def _summary(facts: dict[str, Any]) -> str:
    broken = [check["name"] for check in facts["premises"] if not check["holds"]]
    fails = [check["name"] for check in facts["statements"] if not check["holds"]]
    count = len(facts["statements"])
    words = "All premises hold." if not broken else f"Premises that fail: {'; '.join(broken)}."
    words += (
        f" All {count} statements hold."
        if not fails
        else f" Of {count} statements these fail: {'; '.join(fails)}; the others hold."
    )
    speed = (
        f" The gap of K is {facts['gap']:.4g}; a step of (23) shrinks to {facts['rate_23']:.4f} of "
        f"the one before (predicted {facts['rate_predicted']:.4f}), of (30) to "
        f"{facts['rate_30']:.4f}."
    )
    return words + speed


def _tables(facts: dict[str, Any]) -> Iterator[ExhibitTable]:
    for part in ("premises", "statements"):
        rows = [{**check, "holds": "yes" if check["holds"] else "NO"} for check in facts[part]]
        yield exhibit_table("checks", rows, title=part.capitalize())
    yield exhibit_table("energies", facts["energies"])
    certificate = facts["certificate"]
    if "missing" in certificate:
        yield exhibit_table("certificate", (), notes=(certificate["missing"],), forms={})
        return
    modulus, reciprocal = certificate["modulus"], certificate["reciprocal_error"]
    rows = [
        {"name": "surface, at least", "modulus": certificate["lower"]},
        {"name": "surface, at most", "modulus": certificate["upper"]},
        {"name": "middle of both", "modulus": modulus, "off": reciprocal},
    ]
    for name, off in certificate["off"].items():
        own = None if off is None else modulus * (1 + off)
        rows.append({"name": name, "modulus": own, "off": off})
    yield exhibit_table("certificate", rows)


def _plot(of_disk: TheoryFacts) -> Plot:
    """Return the spectrum of K, the energies by iteration, and the step lengths as a plot."""
    facts, paths = of_disk.facts, of_disk.trajectories
    curves = {name: path.energies for name, path in paths.items()}
    curves |= {name: np.asarray(history) for name, history in of_disk.others.items()}
    lowest = min(float(curve.min()) for curve in curves.values())
    styles = dict(zip(curves, series_styles([]).values(), strict=False))

    def line(name: str, start: int, y: Real, kind: Kind = "line") -> PlotSeries:
        look = styles.get(name, PLAIN)
        numbers = range(start, start + len(y))
        return PlotSeries(name, numbers, y.tolist(), kind, look, named=kind == "line")

    spectrum = line("eigenvalues", 2, 1 - np.asarray(of_disk.spectrum)[1:], "points")
    energies = [line(name, 0, np.maximum(y - lowest, LEAST)) for name, y in curves.items()]
    steps = [line(name, 1, path.steps) for name, path in paths.items()]
    rate, lengths = facts["rate_predicted"], next(iter(paths.values())).steps
    if np.isfinite(rate) and len(lengths):
        predicted = lengths[-1] * rate ** np.arange(1 - len(lengths), 1.0)
        steps.append(line(f"predicted, {rate:.4f} a step", 1, predicted))
    iteration, log = Axis("iteration"), partial(Axis, log=True)
    panels = (
        (log("number k"), log("1 - eigenvalue of K"), [spectrum], "Eigenvalues of K crowd at 1"),
        (iteration, log("E_C less the lowest found"), energies, "Conformal energy"),
        (iteration, log("r.m.s. step of the boundary"), steps, "The gap of K sets the speed"),
    )
    title = f"{facts['mesh']}: {_size(facts)}"
    return Plot(PICTURE, title, tuple(PlotPanel(x, y, tuple(s), name) for x, y, s, name in panels))
