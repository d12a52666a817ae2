"""p-values from Student's t, for differences beyond the resolution of ranks.

With n rounds, signs and ranks alone give no p-value below 2 / 2^n, however large the difference is:
too large for one of a hundred statements. Student's t has no such limit, for noise that is roughly
normal on logarithms. One degree of freedom is taken off, which covers noise with flatter tails,
such as from a steady drift; for heavier tails the test is conservative anyway.
`benchmarks/precision.py` simulates the resulting error rates.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, sqrt
from statistics import mean, variance


def paired_p(logs: Sequence[float]) -> float:
    """Return the two-sided p-value of Student's t for mean 0; 1 for fewer than three values."""
    if len(logs) < 3:
        return 1.0
    return _two_sided(mean(logs), sqrt(variance(logs) / len(logs)), len(logs) - 2)


def unpaired_p(ours: Sequence[float], theirs: Sequence[float]) -> float:
    """Return the two-sided p-value of two samples with unequal variances."""
    fewest = min(len(ours), len(theirs))
    if fewest < 3:
        return 1.0
    error = sqrt(variance(ours) / len(ours) + variance(theirs) / len(theirs))
    return _two_sided(mean(ours) - mean(theirs), error, fewest - 2)


def _two_sided(difference: float, error: float, freedom: int) -> float:
    from scipy.special import stdtr

    if difference == 0:
        return 1.0
    t = abs(difference) / error if error > 0 else inf
    return float(2 * stdtr(freedom, -t))
