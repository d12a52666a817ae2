"""Arithmetic on the printed tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from cembench.results.papers import Row


def _cells(table: Mapping[str, Row], column: str) -> dict[str, float]:
    """Return the printed figures of a column by model, without empty cells."""
    cells = {model: row.get(column) for model, row in table.items()}
    return {model: cell for model, cell in cells.items() if cell is not None}


def ratios(table: Mapping[str, Row], column: str, base: str) -> dict[str, float]:
    """Return the ratios of two columns by model, where both are printed."""
    over, under = _cells(table, column), _cells(table, base)
    return {model: round(over[model] / under[model], 2) for model in over if model in under}


def count_within(figures: Mapping[str, float], low: float, high: float) -> int:
    """Return how many figures are between two, inclusive."""
    return sum(low <= figure <= high for figure in figures.values())


def agreeing(
    figures: Mapping[str, float], table: Mapping[str, Row], column: str, near: float
) -> int:
    """Return how many figures are within `near` of the printed ones of a column."""
    printed = _cells(table, column)
    return sum(abs(figure - printed[model]) <= near for model, figure in figures.items())


def as_words(figures: Mapping[str, float]) -> str:
    """Return figures with their models."""
    return ", ".join(f"{model} {figure:g}" for model, figure in figures.items())


def slower(table: Mapping[str, Row], base: str, others: Sequence[str]) -> tuple[int, int]:
    """Return how many cells of the other columns exceed the base's, and how many there are."""
    slowdowns = [ratio for column in others for ratio in ratios(table, column, base).values()]
    return sum(ratio > 1 for ratio in slowdowns), len(slowdowns)


def exponents(table: Mapping[str, Row], columns: Sequence[str]) -> str:
    """Return the slopes of log seconds over log triangles, as words."""
    fitted = []
    for column in columns:
        seconds = _cells(table, column)
        faces = [float(table[model]["faces"] or 0) for model in seconds]
        slope = np.polyfit(np.log(faces), np.log([*seconds.values()]), 1)[0]
        fitted.append(f"{column} {slope:.2f}")
    return ", ".join(fitted)
