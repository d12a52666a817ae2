"""What a map costs once its surface is factored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pandas as pd

#: The phases of BFF that another boundary takes again.
AGAIN = ("boundary sweeps", "solves")


def amortised(
    seconds: pd.Series, phases: pd.Series, algorithm: pd.Series, place: pd.Series
) -> dict[str, float]:
    """Return the seconds of CETM over those of BFF's repeated phases, by the surface's number."""
    by_surface = {}
    for surface in sorted(set(place)):
        rows = place == surface
        others, own = seconds[rows & (algorithm == "cetm")], phases[rows & (algorithm == "bff")]
        again = [sum(spent.get(name, 0.0) for name in AGAIN) for spent in own if spent]
        if len(others) and again and again[0] > 0:
            by_surface[str(surface + 1)] = float(others.iloc[0]) / again[0]
    return by_surface


def middle(ratios: Mapping[str, float]) -> float:
    """Return the median."""
    return float(np.median([*ratios.values()]))


def as_words(ratios: Mapping[str, float]) -> str:
    """Return the ratios with the surfaces' numbers in the report."""
    return ", ".join(f"{ratio:.0f} (surface {surface})" for surface, ratio in ratios.items())
