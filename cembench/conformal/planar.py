"""Small facts about polygons and triangles in the complex plane."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]

#: An area computed in doubles has a certain sign where it exceeds this share of its terms
#: (Shewchuk 1997, the filter of `orient2d`), and these are not so small that they underflow.
CERTAIN = (3 + 16 * 2.0**-53) * 2.0**-53
UNDERFLOW = 1e-280
#: An angle between neighbours on the unit circle is known to within this many radians.
ANGLE_ROUNDING = 4 * float(np.finfo(float).eps)


def polygon_area(z: Complex) -> float:
    """What area does a closed polygon enclose (Eq. 8)? Positive when counter-clockwise."""
    w = z - z[0]  # far from the origin the products would cancel
    return 0.5 * float(np.imag(np.conj(w) * np.roll(w, -1)).sum())


def signed_areas(uv: Complex, F: NDArray[np.int64]) -> NDArray[np.float64]:
    """What area has each triangle's image? Shape (m,); positive when counter-clockwise."""
    a, b, c = (uv[F[:, k]] for k in range(3))
    return 0.5 * np.imag(np.conj(b - a) * (c - a))


def folded_triangles(uv: Complex, F: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the triangles whose image has no positive area, judged by its exact sign."""
    return np.flatnonzero(orientations(uv, F) <= 0)


def orientations(uv: Complex, F: NDArray[np.int64]) -> NDArray[np.int8]:
    """Return the exact sign of each triangle's image area: 1, 0 or -1, shape (m,).

    Exact for the given doubles: where rounding could hide the sign, whole numbers decide. A corner
    that is NaN or infinite gives 0.
    """
    a, b, c = (uv[F[:, k]] for k in range(3))
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        p, q = b - a, c - a
        left, right = p.real * q.imag, p.imag * q.real
        area, terms = left - right, np.abs(left) + np.abs(right)
        certain = (np.abs(area) > CERTAIN * terms) & (terms > UNDERFLOW) & np.isfinite(terms)
    signs = np.sign(np.where(certain, area, 0)).astype(np.int8)
    # Differences of doubles are zero only where these are equal: such products are exact.
    flat = ((p.real == 0) | (q.imag == 0)) & ((p.imag == 0) | (q.real == 0))
    open_ = np.flatnonzero(~certain & ~flat & np.isfinite(uv)[F].all(axis=1))
    signs[open_] = _exact_orientations(a[open_], b[open_], c[open_])
    return signs


def _exact_orientations(a: Complex, b: Complex, c: Complex) -> NDArray[np.int8]:
    """Return the signs in whole numbers: each triangle scaled by a power of two."""
    parts = np.stack([a.real, a.imag, b.real, b.imag, c.real, c.imag])
    mantissa, exponent = np.frexp(parts)
    whole = np.ldexp(mantissa, 53).astype(np.int64).astype(object)
    shift = (exponent - exponent.min(axis=0, initial=0)).astype(object)
    ax, ay, bx, by, cx, cy = whole << shift
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return np.asarray((area > 0).astype(np.int8) - (area < 0).astype(np.int8))


def turns(z: Complex) -> tuple[int, int, int]:
    """Return how a loop of points goes round the origin.

    The first number is how many turns the arcs make if each is taken counter-clockwise: 1 where the
    points go round once and in order. The others tell why it is more: how often the polygon winds
    round the origin, and how many arcs go backward. Neighbours whose angles differ by no more than
    rounding are in order.
    """
    arcs = np.angle(np.roll(z, -1) * np.conj(z))
    backward = arcs < -ANGLE_ROUNDING
    forward = np.where(backward, arcs + 2 * np.pi, np.maximum(arcs, 0))
    around, winding = (round(float(total) / (2 * np.pi)) for total in (forward.sum(), arcs.sum()))
    return around, winding, int(np.count_nonzero(backward))


def backward_arcs(f_b: Complex) -> int:
    """How many arcs between consecutive points of a loop do not run counter-clockwise about 0?"""
    return int(np.count_nonzero(~(np.imag(np.conj(f_b) * np.roll(f_b, -1)) > 0)))


def fitted_circle(z: Complex) -> tuple[complex, float]:
    """Which circle lies closest to these points? Centre and radius, algebraic least squares (Kasa).

    Radius NaN where the points do not determine a circle.
    """
    if not np.isfinite(z).all():
        return complex("nan"), float("nan")
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


def crossing_polygons(curves: Sequence[Complex]) -> tuple[int, int] | None:
    """Return two closed polygons that cross or touch each other; None where there are none.

    Two equal numbers for a polygon that crosses or touches itself; a point that is repeated in a
    row counts once.
    """
    import shapely  # here: every measured process would wait for it

    rings = [shapely.linearrings(np.stack([z.real, z.imag], axis=1)) for z in curves]
    for k in np.flatnonzero(~shapely.is_simple(rings)):
        return int(k), int(k)
    pairs = shapely.STRtree(rings).query(rings, predicate="intersects")
    for one, other in sorted((int(i), int(j)) for i, j in pairs.T if i < j):
        return one, other
    return None
