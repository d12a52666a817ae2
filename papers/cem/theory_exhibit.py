"""Exhibit of the tests of Section 4 of the paper on a surface: tables, and a picture of plots."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from cembench.core.atomic import write
from cembench.results.exhibits import (
    Exhibit,
    ExhibitPicture,
    ExhibitTable,
    place_of,
    write_exhibit,
)

from .boundary_operator import Trajectory
from .theory_facts import LOOKS, TheoryFacts

#: Colours, which also differ in lightness: for (23) and (30), and for other algorithms.
COLOURS = ("#1f5f99", "#c8553d")
OTHERS = ("#3f7d4e", "#8a5a9e", "#b8860b", "#5f6b73", "#0f8b8d", "#a0405f")
#: An axis with fewer values has ticks at 2 and 5 too.
DECADES = 300
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
    _write_plots(place_of(run, exhibit.name, PICTURE), of_disk)
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
    checks = {"name": ("what", ""), "source": ("where", ""), "holds": ("holds", "")}
    checks |= {"figure": ("figure", ".3g"), "meaning": ("meaning", "")}
    for part in ("premises", "statements"):
        rows = [{**check, "holds": "yes" if check["holds"] else "NO"} for check in facts[part]]
        yield ExhibitTable.of(part.capitalize(), checks, rows, details=("meaning",))
    looks = {f"after_{k}": (f"after {k}", ".6f") for k in LOOKS} | {"last": ("last", ".6f")}
    columns = {"name": ("iteration", ""), **looks, "iterations": ("iterations", "d")}
    title = "Conformal energy E_C"
    yield ExhibitTable.of(title, columns, facts["energies"], details=("iterations",))
    yield _certificate_table(facts["certificate"])


def _certificate_table(of_disk: dict[str, Any]) -> ExhibitTable:
    title = "Modulus of the surface with four boundary points"
    columns = ("four boundary points", "modulus", "off by")
    if "missing" in of_disk:
        return ExhibitTable(title=title, columns=columns, rows=(), notes=(of_disk["missing"],))
    modulus = of_disk["modulus"]
    return ExhibitTable(
        title=title,
        columns=columns,
        rows=(
            ("surface, at least", of_disk["lower"], None),
            ("surface, at most", of_disk["upper"], None),
            ("middle of both", modulus, of_disk["reciprocal_error"]),
            *(
                (name, None if off is None else modulus * (1 + off), off)
                for name, off in of_disk["off"].items()
            ),
        ),
        forms={"modulus": ".5f", "off by": "+.1e"},
    )


def _write_plots(path: Path, of_disk: TheoryFacts) -> None:
    """Draw the spectrum of K, the energies by iteration, and the step lengths as a PNG file."""
    facts = of_disk.facts
    figure = Figure(figsize=(13, 4.2), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(f"{facts['mesh']}: {_size(facts)}", fontweight="bold")
    spectrum, energy, steps = figure.subplots(1, 3)
    _draw_spectrum(spectrum, np.asarray(of_disk.spectrum))
    _draw_energies(energy, of_disk.trajectories, of_disk.others)
    _draw_steps(steps, of_disk.trajectories, facts["rate_predicted"])
    write(path, lambda file: figure.savefig(file, format="png"))


def _draw_spectrum(axes: Axes, values: np.ndarray) -> None:
    axes.plot(np.arange(2, len(values) + 1), 1 - values[1:], ".", color=COLOURS[0], markersize=4)
    axes.set(xscale="log", yscale="log", xlabel="number k", ylabel="1 - eigenvalue of K")
    axes.set_title("Eigenvalues of K crowd at 1", fontsize=10)
    few = len(values) < DECADES
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5) if few else (1,)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    axes.xaxis.set_minor_formatter(NullFormatter())  # otherwise labels overlap
    axes.yaxis.set_minor_formatter(NullFormatter())


def _draw_energies(
    axes: Axes, trajectories: Mapping[str, Trajectory], others: Mapping[str, Sequence[float]]
) -> None:
    curves = {name: path.energies for name, path in trajectories.items()}
    curves |= {name: np.asarray(history) for name, history in others.items()}
    lowest = min(float(curve.min()) for curve in curves.values())
    colours = dict(zip(trajectories, COLOURS, strict=False))
    colours |= {name: OTHERS[k % len(OTHERS)] for k, name in enumerate(others)}
    for name, curve in curves.items():
        above = np.maximum(curve - lowest, LEAST)
        axes.plot(np.arange(len(curve)), above, color=colours[name], label=name)
    axes.set(yscale="log", xlabel="iteration", ylabel="E_C less the lowest found")
    axes.set_title("Conformal energy", fontsize=10)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(frameon=False, fontsize=9)


def _draw_steps(axes: Axes, trajectories: Mapping[str, Trajectory], rate: float) -> None:
    for (name, path), colour in zip(trajectories.items(), COLOURS, strict=False):
        axes.plot(np.arange(1, len(path.steps) + 1), path.steps, color=colour, label=name)
    first = next(iter(trajectories.values()))
    if np.isfinite(rate) and len(first.steps):
        k = np.arange(1, len(first.steps) + 1)
        line = first.steps[-1] * rate ** (k - k[-1])
        label = f"predicted, {rate:.4f} a step"
        axes.plot(k, line, "--", color="#7a8894", linewidth=1, label=label)
    axes.set(yscale="log", xlabel="iteration", ylabel="r.m.s. step of the boundary")
    axes.set_title("The gap of K sets the speed", fontsize=10)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(frameon=False, fontsize=9)
