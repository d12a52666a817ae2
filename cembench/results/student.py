"""How unlikely is a difference, far beyond what ranks can tell?

Of n rounds, signs and ranks alone exclude nothing with more certainty than 2 / 2^n, however large a
difference is: too little for the first of a hundred statements. Student's t tells more, for noise
that is about normal on logarithms. It has one degree of freedom less here than for normal values:
that pays for noise with flatter tails, as a steady drift makes it; for heavier tails it errs on the
safe side as it is. `benchmarks/precision.py` simulates what that comes to.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, sqrt
from statistics import mean, variance


def paired_p(logs: Sequence[float]) -> float:
    """Return the two-sided probability of values as far from 0 as these; 1 for fewer than three."""
    if len(logs) < 3:
        return 1.0
    return _two_sided(mean(logs), sqrt(variance(logs) / len(logs)), len(logs) - 2)


def unpaired_p(ours: Sequence[float], theirs: Sequence[float]) -> float:
    """Return the same of two samples as far apart as these, their scatter being different."""
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
