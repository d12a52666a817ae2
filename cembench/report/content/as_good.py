"""Which maps are about as good as the best; the fastest algorithm is named only among those."""

from __future__ import annotations

from collections.abc import Sequence

#: A map is as good as another if its mean angle error is at most this many times as large, or this
#: many degrees larger.
AS_GOOD, DEGREES = 1.25, 0.25


def as_good(angles: Sequence[float], best: Sequence[float]) -> bool:
    """Whether maps are about as good as the best ones on every surface.

    Both are mean angle errors in degrees, one per surface.
    """
    return all(a <= max(AS_GOOD * b, b + DEGREES) for a, b in zip(angles, best, strict=True))
