"""Is the rule that measures until a figure is precise as seldom wrong as it says?"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from benchmarks import noise
from benchmarks.pages import Section, Table
from cembench.results.intervals import ERROR, LOOKS, USUAL_MAX_ROUNDS, USUAL_PRECISION, share
from cembench.results.rank_tests import cut, walsh_averages

LAYOUT = """
| noise | precision | wrong verdicts | at any look | rounds: mean | median | precise |
|---|---:|---:|---:|---:|---:|---:|
| {noise} | {precision:.0%} | {wrong:.1%} | {ever_wrong:.1%} | {mean:.1f} | {median:.0f} \
| {precise:.0%} |"""
CORRECTED = """
| noise | tables of 100 with a wrong verdict, corrected: at most |
|---|---:|
| {noise} | {wrong:.1%} |"""


@dataclass(frozen=True)
class Simulated:
    """What became of many runs under one kind of noise: an entry a run."""

    rounds: NDArray[np.int64]
    #: Was one called faster or slower in the end?
    wrong: NDArray[np.bool_]
    #: Did any look on the way show a difference?
    ever_wrong: NDArray[np.bool_]
    #: Was it precise in the end?
    precise: NDArray[np.bool_]


def intervals(logs: NDArray[np.float64], error: float) -> tuple[NDArray[np.float64], ...]:
    """Return the ends of the signed-rank interval of each row (runs, n)."""
    left_out = cut(logs.shape[1], error)
    averages = walsh_averages(logs)
    return averages[:, left_out], averages[:, averages.shape[1] - 1 - left_out]


def looks(most: int) -> list[int]:
    """Return after how many rounds is looked."""
    return [*(n for n in LOOKS if n < most), most]


def simulate(
    model: str, runs: int, precision: float, most: int = USUAL_MAX_ROUNDS, seed: int = 0
) -> Simulated:
    """Measure pairs of algorithms of equal cost until they are precise, or `most` rounds."""
    seconds = np.log(noise.pairs(model, np.random.default_rng(seed), runs, most))
    rounds = np.zeros(runs, dtype=np.int64)
    wrong, ever, precise = (np.zeros(runs, dtype=bool) for _ in range(3))
    for n in looks(most):
        error = ERROR * share(n)
        ratios = intervals(seconds[:, :n, 0] - seconds[:, :n, 1], error)
        own = [intervals(seconds[:, :n, k], error) for k in (0, 1)]
        excluded = (ratios[0] > 0) | (ratios[1] < 0)
        widths = [np.exp(high - low) - 1 for low, high in (ratios, *own)]
        narrow = np.max(widths, axis=0) <= 2 * precision
        ever |= excluded
        ends = (rounds == 0) & (narrow | (n == most))
        rounds[ends], wrong[ends], precise[ends] = n, excluded[ends], narrow[ends]
    return Simulated(rounds, wrong, ever, precise)


def family_error(model: str, runs: int, rng: np.random.Generator, comparisons: int = 100) -> float:
    """Return an upper bound on how often a table of equal algorithms has a wrong verdict.

    That is the chance that one of them passes Holm's first step at any look, times their number.
    """
    most = LOOKS[-2]
    seconds = np.log(noise.pairs(model, rng, runs, most))
    logs = seconds[..., 0] - seconds[..., 1]
    claimed = np.zeros(runs, dtype=bool)
    for n in looks(most):
        error = logs[:, :n].std(axis=1, ddof=1) / np.sqrt(n)
        p = 2 * stdtr(n - 2, -np.abs(logs[:, :n].mean(axis=1)) / error) / share(n)
        claimed |= p <= ERROR / comparisons
    return float(claimed.mean() * comparisons)


def precision(*, runs: int = 4000) -> Section:
    """Count the wrong verdicts of the rule that measures until a figure is precise.

    Simulates two algorithms of one cost on machines that are noisy in several ways (``noise.py``),
    with the rule as it is: looks, shares of the 5 %, intervals of the ratio and of both cells' own
    seconds. Counts how often one was called faster or slower, and after how many rounds it was
    over.
    """
    rows, corrected = [], []
    for model, width in product(noise.MODELS, (USUAL_PRECISION, 0.1)):
        simulated = simulate(model, runs, width)
        rows.append(
            {
                "noise": model,
                "precision": width,
                "wrong": simulated.wrong.mean(),
                "ever_wrong": simulated.ever_wrong.mean(),
                "mean": simulated.rounds.mean(),
                "median": np.median(simulated.rounds),
                "precise": simulated.precise.mean(),
            }
        )
    rng = np.random.default_rng(0)
    for model in noise.MODELS:
        chunks = [family_error(model, 50_000, rng) for _ in range(max(1, 40 * runs // 50_000))]
        corrected.append({"noise": model, "wrong": np.mean(chunks)})
    note = f"{runs:,} simulated runs a line, at most {USUAL_MAX_ROUNDS} rounds; "
    note += f"of the second table {40 * runs:,}."
    return Section(
        [Table(rows, LAYOUT), Table(corrected, CORRECTED), note], "docs/measuring_details.md"
    )
