"""Comparisons of two maps' figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pandas as pd


def apart(figures: pd.Series) -> float:
    """Return the relative difference of the largest and the smallest figure."""
    return float(figures.max() / figures.min() - 1)


def farthest(differences: Sequence[float]) -> float:
    """Return the largest difference."""
    return max(differences)
