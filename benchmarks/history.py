"""How fast algorithms and shared steps were at commits of this project's past, kept by asv."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from itertools import pairwise, product
from math import exp, isnan, log, nan
from typing import Any

import matplotlib as mpl

from benchmarks.measuring import png
from benchmarks.pages import ROOT, Section, Table

mpl.use("Agg")
import matplotlib.pyplot as plt

KEPT = ROOT / "benchmarks/kept_history"
#: Smaller changes from one commit to the next are no steps: of seconds, and of mean angle errors.
STEP, WORSE = 1.15, 1.01
STEPS = """
| what | commit | before | after | times |
|---|---|---:|---:|---:|
| {what} | `{commit}` | {before:.4g} {unit} | {after:.4g} {unit} | {times:.2f} |"""
#: Figures of algorithms or steps by commit; of seconds the geometric mean over surfaces.
Series = Mapping[str, list[float]]


def history(*, machine: str = "reference") -> Section:
    """Draw the seconds of algorithms and shared steps over commits of this project's past.

    The figures are those that asv keeps in `benchmarks/kept_history`, on one machine; its file
    `steps.toml` explains steps. ``make history`` measures the commits that have no figures.
    """
    listed = (KEPT / "commits.txt").read_text(encoding="utf-8").split()
    found = {one: run for one in listed if (run := results(machine, one))}
    if not found:
        return Section(["No commit has figures yet; `make history` measures them."])
    runs = list(found.values())
    maps, steps = series(runs, "history.Maps.time_map"), series(runs, "history.Steps.time_step")
    angles = series(runs, "history.Quality.track_angle_error", 1.0)
    times = {name: first(values) / first(values[::-1]) for name, values in maps.items()}
    fastest = ", ".join(f"{name} {times[name]:.1f}" for name in sorted(times, key=times.get))
    head = (
        f"From the first of {len(found)} commits that has it to the last, each algorithm became "
        f"this many times as fast: {fastest}."
    )
    picture = "![Milliseconds of algorithms and of shared steps by commit](history.png)"
    rows = changes(maps | steps, list(found), STEP, "ms")
    errors = {f"{name}, mean angle error": values for name, values in angles.items()}
    rows += changes(errors, list(found), WORSE, "degrees")
    table = Table(sorted(rows, key=lambda row: row["number"]), STEPS)
    known = tomllib.loads((KEPT / "steps.toml").read_text(encoding="utf-8"))
    why = [f"**{title}.** {text.strip()}" for title, text in known.items()]
    missing = ", ".join(f"`{one[:8]}`" for one in listed if one not in found)
    left_out = (
        [f"Without figures, not measured or impossible to build: {missing}."] if missing else []
    )
    drawing = {"history.png": png(drawn(maps | steps, list(found)), dpi=110)}
    return Section([head, picture, table, *why, *left_out], files=drawing)


def results(machine: str, commit: str) -> dict[str, Any] | None:
    """Return asv's results of a commit, if there are any."""
    for path in (KEPT / machine).glob(f"{commit[:8]}-*.json"):
        run: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        if any(series([run], "history.Maps.time_map").values()):
            return run
    return None


def first(values: Sequence[float]) -> float:
    """Return the first value that is there."""
    return next(value for value in values if not isnan(value))


def series(runs: Sequence[Mapping[str, Any]], benchmark: str, scale: float = 1e3) -> Series:
    """Return figures by commit; nan where a commit has none."""
    values: dict[str, list[float]] = {}
    for run in runs:
        row = dict(zip(run["result_columns"], run["results"].get(benchmark, ()), strict=False))
        logs: dict[str, list[float]] = {}
        places = product(*row.get("params", ()))
        for place, figure in zip(places, row.get("result") or (), strict=False):
            logs.setdefault(place[0].strip("'"), []).append(log(scale * figure) if figure else nan)
        for name, each in logs.items():
            values.setdefault(name, []).append(exp(sum(each) / len(each)))
    return {name: each for name, each in values.items() if not all(map(isnan, each))}


def changes(found: Series, commits: Sequence[str], step: float, unit: str) -> list[dict[str, Any]]:
    """Return the steps from one commit to the next, with the number of the commit."""
    about = {"unit": unit}
    return [
        {"what": name, "number": n, "commit": commits[n][:8], "before": old, "after": new}
        | about
        | {"times": new / old}
        for name, values in found.items()
        for n, (old, new) in enumerate(pairwise(values), 1)
        if abs(log(new / old)) > log(step)
    ]


def drawn(found: Series, commits: Sequence[str]) -> Any:
    """Draw a panel for each series over the commits, in the order of history."""
    rows = -(-len(found) // 3)
    figure, axes = plt.subplots(rows, 3, figsize=(11, 2.4 * rows), squeeze=False)
    shown = range(0, len(commits), max(1, len(commits) // 6))
    names = [commits[n][:8] for n in shown]
    for axis, (name, values) in zip(axes.flat, found.items(), strict=False):
        axis.plot(values, ".-", color="tab:blue")
        axis.set(title=name, ylim=(0, 1.1 * max(v for v in values if not isnan(v))))
        axis.set(xlim=(-0.5, len(commits) - 0.5), ylabel="ms")
        axis.set_xticks(list(shown), names, rotation=30, ha="right", fontsize=7)
        axis.grid(alpha=0.3)
    for axis in axes.flat[len(found) :]:
        axis.axis("off")
    figure.tight_layout()
    return figure
