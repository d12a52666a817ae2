"""Two algorithms of one cost, measured on machines that are noisy in several ways."""

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Seconds = NDArray[np.float64]


def _quiet(rng: Generator, runs: int, calls: int) -> Seconds:
    return rng.lognormal(0, 0.02, (runs, calls))


def _lognormal(rng: Generator, runs: int, calls: int) -> Seconds:
    return rng.lognormal(0, 0.08, (runs, calls))


def _spikes(rng: Generator, runs: int, calls: int) -> Seconds:
    return np.where(rng.random((runs, calls)) < 0.05, 3.0, 1.0) * rng.lognormal(
        0, 0.05, (runs, calls)
    )


def _drift(rng: Generator, runs: int, calls: int) -> Seconds:
    along = np.arange(calls) / calls
    drift = np.exp(rng.normal(0, 0.7, (runs, 1)) * along)
    return drift * rng.lognormal(0, 0.05, (runs, calls))


def _steps(rng: Generator, runs: int, calls: int) -> Seconds:
    times = np.arange(calls)
    when = rng.uniform(0, calls, (runs, 2, 1))
    size = rng.uniform(0.7, 1.6, (runs, 2, 1))
    steps = np.where(times > when, size, 1.0).prod(axis=1)
    return steps * rng.lognormal(0, 0.05, (runs, calls))


def _heavy_tails(rng: Generator, runs: int, calls: int) -> Seconds:
    return np.exp(0.04 * np.abs(rng.standard_t(1.5, (runs, calls))).clip(0, 100))


#: By name, a function of a generator and of how many runs and calls; seconds (runs, calls).
MODELS = {
    "quiet (lognormal, 2 %)": _quiet,
    "lognormal, 8 %": _lognormal,
    "spikes": _spikes,
    "drift": _drift,
    "steps": _steps,
    "heavy tails": _heavy_tails,
}


def pairs(model: str, rng: Generator, runs: int, rounds: int) -> Seconds:
    """Seconds of both in each round (runs, rounds, 2), in random order within a round."""
    return rng.permuted(MODELS[model](rng, runs, 2 * rounds).reshape(runs, rounds, 2), axis=2)
