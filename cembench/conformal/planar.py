"""Small facts about polygons and triangles in the complex plane."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]

#: So many pairs of segments are looked at in one go.
PAIRS_AT_ONCE = 1_000_000


def polygon_area(z: Complex) -> float:
    """What area does a closed polygon enclose (Eq. 8)? Positive when counter-clockwise."""
    w = z - z[0]  # far from the origin the products would cancel
    return 0.5 * float(np.imag(np.conj(w) * np.roll(w, -1)).sum())


def signed_areas(uv: Complex, F: NDArray[np.int64]) -> NDArray[np.float64]:
    """What area has each triangle's image? Shape (m,); positive when counter-clockwise."""
    a, b, c = (uv[F[:, k]] for k in range(3))
    return 0.5 * np.imag(np.conj(b - a) * (c - a))


def backward_arcs(f_b: Complex) -> int:
    """How many arcs between consecutive points of a loop do not run counter-clockwise about 0?"""
    return int(np.count_nonzero(~(np.imag(np.conj(f_b) * np.roll(f_b, -1)) > 0)))


def fitted_circle(z: Complex) -> tuple[complex, float]:
    """Which circle lies closest to these points? Centre and radius, algebraic least squares (Kasa).

    Radius NaN where the points do not determine a circle.
    """
    middle = z.mean()
    w = z - middle
    scale = float(np.abs(w).max())
    if scale == 0:
        return complex(middle), float("nan")
    w = w / scale
    system = np.stack([w.real, w.imag, np.ones(len(w))], axis=1)
    (a, b, c), _, rank, _ = np.linalg.lstsq(system, np.abs(w) ** 2, rcond=None)
    if rank < 3:
        return complex(middle), float("nan")
    centre = complex(a, b) / 2
    return complex(middle + scale * centre), scale * float(np.sqrt(c + abs(centre) ** 2))


def crossing_segments(curves: Sequence[Complex]) -> tuple[int, int] | None:
    """Which two closed polygons cross each other, or which one crosses itself? None for none.

    Two equal numbers for a polygon that crosses itself. That neighbours in a polygon share an end
    is no crossing; a point of one polygon on a segment of another is.
    """
    a = np.concatenate(curves)
    b = np.concatenate([np.roll(z, -1) for z in curves])
    of = np.repeat(np.arange(len(curves)), [len(z) for z in curves])
    low, high = np.minimum(a.real, b.real), np.maximum(a.real, b.real)
    order = np.argsort(low, kind="stable")
    a, b, of, low, high = a[order], b[order], of[order], low[order], high[order]
    # A segment can only meet those that begin, in x, before it ends.
    reach = np.searchsorted(low, high, side="right")
    width = max(1, PAIRS_AT_ONCE // len(a))
    for shift in range(1, int((reach - np.arange(len(a))).max()), width):
        i, step = np.nonzero(np.arange(len(a))[:, None] + shift + np.arange(width) < reach[:, None])
        j = i + shift + step
        neighbours = (of[i] == of[j]) & ((b[i] == a[j]) | (a[i] == b[j]))
        hit = _meet(a[i], b[i], a[j], b[j]) & ~neighbours
        if hit.any():
            first = int(np.argmax(hit))
            one, other = sorted((int(of[i[first]]), int(of[j[first]])))
            return one, other
    return None


def _meet(p: Complex, q: Complex, r: Complex, s: Complex) -> NDArray[np.bool_]:
    """Do the segments pq and rs meet?"""
    across = _side(p, q, r) * _side(p, q, s) <= 0
    return across & (_side(r, s, p) * _side(r, s, q) <= 0) & _boxes_meet(p, q, r, s)


def _side(p: Complex, q: Complex, r: Complex) -> NDArray[np.float64]:
    """Positive where r lies left of the line from p to q."""
    return np.sign(np.imag(np.conj(q - p) * (r - p)))


def _boxes_meet(p: Complex, q: Complex, r: Complex, s: Complex) -> NDArray[np.bool_]:
    meet = np.ones(len(p), dtype=bool)
    for part in (np.real, np.imag):
        u, v, w, x = part(p), part(q), part(r), part(s)
        meet &= (np.maximum(u, v) >= np.minimum(w, x)) & (np.maximum(w, x) >= np.minimum(u, v))
    return meet
