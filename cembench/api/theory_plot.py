"""Three plots for Section 4: the spectrum of K, E_C by iteration, and the step lengths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from cembench.api.boundary_operator import Trajectory
from cembench.core.atomic import write

#: Colours, which also differ in lightness: for (23) and (30), and for other algorithms.
COLOURS = ("#1f5f99", "#c8553d")
OTHERS = ("#3f7d4e", "#8a5a9e", "#b8860b", "#5f6b73", "#0f8b8d", "#a0405f")
#: An axis with fewer values has ticks at 2 and 5 too.
DECADES = 300
#: Below this, the excess of an energy over the lowest is rounding.
LEAST = 1e-12


def write_theory_plot(
    path: Path,
    title: str,
    eigenvalues: Sequence[float],
    trajectories: Mapping[str, Trajectory],
    others: Mapping[str, Sequence[float]],
    rate: float,
) -> None:
    """Draw the plots of a surface, and write them to a PNG file.

    Parameters
    ----------
    path : Path
        The PNG file.
    title : str
        The surface's name.
    eigenvalues : sequence of float
        Eigenvalues of K in descending order; the first is 1.
    trajectories : mapping
        Trajectories of the bare iteration, by the name of the step.
    others : mapping
        Energies E_C by iteration of other algorithms, by title.
    rate : float
        The predicted factor from step to step.

    """
    figure = Figure(figsize=(13, 4.2), dpi=120, layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(title, fontweight="bold")
    spectrum, energy, steps = figure.subplots(1, 3)
    _draw_spectrum(spectrum, np.asarray(eigenvalues))
    _draw_energies(energy, trajectories, others)
    _draw_steps(steps, trajectories, rate)
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
