"""How often are intervals over surfaces right where some surfaces show one object?"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from benchmarks.pages import Section, Table
from cembench.results.families import average_interval, family_means, share_interval, votes
from cembench.results.intervals import ERROR, Interval
from cembench.results.multiple_testing import sign_test

PAGE = "docs/measuring.md"
#: Families of a run: most of one surface, some of two and three, and one of a hundred faces.
SIZES = {
    "20 families": [1] * 12 + [2] * 5 + [3] * 2 + [100],
    "130 families": [1] * 95 + [2] * 25 + [3] * 9 + [100],
}
#: Number of bootstrap draws.
DRAWS = 400
METHODS = ("surfaces as independent", "bootstrap of families", "here")
LAYOUT = f"""
| what | {" | ".join(f"{sizes}: {method}" for sizes in SIZES for method in METHODS)} |
|---|{"---:|" * len(SIZES) * len(METHODS)}
| {{what}} | {" | ".join(f"{{{sizes}/{method}:.1%}}" for sizes in SIZES for method in METHODS)} |"""
Array = NDArray[np.float64]
#: Figures of all surfaces, their families, and a generator: to the three intervals.
Intervals = Callable[[Array, list[str], np.random.Generator], tuple[Interval, Interval, Interval]]


def family_intervals(*, runs: int = 2000) -> Section:
    """Simulate how often 95 % intervals over families hold the truth, and how often wins deceive.

    Each run draws families of the sizes of a real collection, among them one of a hundred faces of
    a model. What holds for a family is drawn first, then its surfaces scatter around that. The
    truth is the mean over all families that there could be. Three methods: as if each surface were
    independent (Wilson's interval, Student's, the sign test); a percentile bootstrap of families;
    and that of `cembench.results.families`.
    """
    rows: list[dict[str, Any]] = []
    for what, draw, truth, intervals in CASES:
        row: dict[str, Any] = {"what": what}
        for name, sizes in SIZES.items():
            rng = np.random.default_rng(0)
            held = np.zeros(len(METHODS))
            for _ in range(runs):
                figures, families = drawn(sizes, draw, rng)
                held += [truth in interval for interval in intervals(figures, families, rng)]
            row |= dict(zip((f"{name}/{m}" for m in METHODS), held / runs, strict=True))
        rows.append(row)
    rows.append(false_wins(runs))
    about = f"{runs:,} runs each; an interval should hold the truth in 95 %, wins deceive in 5 %."
    return Section([about, Table(rows, LAYOUT)], PAGE)


def drawn(
    sizes: list[int], draw: Callable[[np.random.Generator, int], Array], rng: np.random.Generator
) -> tuple[Array, list[str]]:
    """Return the figures of all surfaces of a run, and the family of each."""
    figures = np.concatenate([draw(rng, size) for size in sizes])
    return figures, [str(k) for k, size in enumerate(sizes) for _ in range(size)]


def succeeding(share: float, alike: float) -> Callable[[np.random.Generator, int], Array]:
    """Return a family of surfaces that are mapped or not; `alike` is the correlation within it."""
    a, b = share * (1 / alike - 1), (1 - share) * (1 / alike - 1)

    def draw(rng: np.random.Generator, size: int) -> Array:
        return (rng.random(size) < rng.beta(a, b)).astype(float)

    return draw


def ratios(between: float, skew: bool = False) -> Callable[[np.random.Generator, int], Array]:
    """Return a family of ratios of figures around 2, with this scatter of families on logarithms.

    A family scatters by a third of that. Skew scatter is exponential, as of ratios of seconds.
    """

    def draw(rng: np.random.Generator, size: int) -> Array:
        own = rng.exponential() - 1 if skew else rng.standard_normal()
        return np.asarray(2 * np.exp(between * (own + rng.standard_normal(size) / 3)))

    return draw


def share_intervals(
    figures: Array, families: list[str], rng: np.random.Generator
) -> tuple[Interval, Interval, Interval]:
    """Return the three intervals of a share."""
    n = len(figures)
    naive = binomtest(int(figures.sum()), n).proportion_ci(method="wilson")
    own = np.array(family_means(figures.tolist(), families))
    return (
        Interval(naive.low, naive.high),
        bootstrap(own, rng),
        share_interval(float(own.mean()), len(own)),
    )


def average_intervals(
    figures: Array, families: list[str], rng: np.random.Generator
) -> tuple[Interval, Interval, Interval]:
    """Return the three intervals of a geometric mean."""
    own = np.array(family_means(np.log(figures).tolist(), families))
    around = bootstrap(own, rng)
    naive, apart = average_interval(figures.tolist()), average_interval(figures.tolist(), families)
    assert naive
    assert apart
    return naive, Interval(float(np.exp(around.low)), float(np.exp(around.high))), apart


def bootstrap(own: Array, rng: np.random.Generator) -> Interval:
    """Return the percentile interval of a mean over families that are drawn with replacement."""
    means = own[rng.integers(0, len(own), (DRAWS, len(own)))].mean(axis=1)
    low, high = np.quantile(means, [ERROR / 2, 1 - ERROR / 2])
    return Interval(float(low), float(high))


#: What is estimated, how a family is drawn, the truth, and the intervals.
CASES: tuple[tuple[str, Callable[[np.random.Generator, int], Array], float, Intervals], ...] = (
    ("valid maps, 90 %, alike .5", succeeding(0.9, 0.5), 0.9, share_intervals),
    ("valid maps, 98 %, alike .5", succeeding(0.98, 0.5), 0.98, share_intervals),
    ("valid maps, 98 %, alike .1", succeeding(0.98, 0.1), 0.98, share_intervals),
    ("geometric mean of ratios", ratios(0.5), 2.0, average_intervals),
    ("the same, skew", ratios(0.5, skew=True), 2.0, average_intervals),
)


def false_wins(runs: int) -> dict[str, Any]:
    """Return how often sign tests name a winner of two algorithms that are equally good."""
    row: dict[str, Any] = {"what": "wins: a winner of two equals"}
    for name, sizes in SIZES.items():
        rng = np.random.default_rng(0)
        wrong = np.zeros(2)
        for _ in range(runs):
            figures, families = drawn(sizes, ratios(0.5), rng)
            one = [2.0] * len(families)
            singles = [str(k) for k in range(len(families))]
            wrong += [
                sign_test(*votes(figures.tolist(), one, of)) <= ERROR for of in (singles, families)
            ]
        naive, apart = wrong / runs
        row |= dict(zip((f"{name}/{m}" for m in METHODS), (naive, None, apart), strict=True))
    return row
