"""Functions of polygons and triangles in the complex plane."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cembench.core.arrays import Complex, Indices, Real
from cembench.core.blocks import in_blocks

#: The sign of an area computed in doubles is certain if it exceeds this share of its terms
#: (Shewchuk 1997, the filter of `orient2d`), and the terms do not underflow.
CERTAIN = (3 + 16 * 2.0**-53) * 2.0**-53
UNDERFLOW = 1e-280
#: Precision of an angle between neighbours on the unit circle, in radians.
ANGLE_ROUNDING = 4 * float(np.finfo(float).eps)
#: Most boundary crossings for which an overlap is computed; size of its buffers.
MAX_CROSSINGS, AT_ONCE = 20_000, 2_000_000


def polygon_area(z: Complex) -> float:
    """Return the area inside a closed polygon (Eq. 8); positive if counter-clockwise."""
    w = z - z[0]  # far from the origin the products would suffer from cancellation
    return 0.5 * float(np.imag(np.conj(w) * np.roll(w, -1)).sum())


def signed_areas(uv: Complex, F: Indices) -> Real:
    """Return the area of each triangle's image, shape (m,); positive if counter-clockwise."""

    def of_triangles(F: Indices) -> Real:
        a, b, c = (uv.take(F[:, k]) for k in range(3))
        return 0.5 * np.imag(np.conj(b - a) * (c - a))

    return in_blocks(of_triangles, F)


def folded_triangles(uv: Complex, F: Indices) -> Indices:
    """Return the triangles whose image has no positive area, by its exact sign."""
    return np.flatnonzero(orientations(uv, F) <= 0)


def orientations(uv: Complex, F: Indices) -> NDArray[np.int8]:
    """Return the exact sign of each triangle's image area: 1, 0 or -1, shape (m,).

    Exact for the given doubles: if rounding could hide the sign, integer arithmetic decides. A
    corner that is NaN or infinite gives 0.
    """
    return in_blocks(lambda some: _orientations(uv, some), F)


def _orientations(uv: Complex, F: Indices) -> NDArray[np.int8]:
    a, b, c = (uv.take(F[:, k]) for k in range(3))
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        p, q = b - a, c - a
        left, right = p.real * q.imag, p.imag * q.real
        area, terms = left - right, np.abs(left) + np.abs(right)
        certain = (np.abs(area) > CERTAIN * terms) & (terms > UNDERFLOW) & np.isfinite(terms)
    signs = np.sign(np.where(certain, area, 0)).astype(np.int8)
    # A difference of doubles is zero only if they are equal: such products are exact.
    flat = ((p.real == 0) | (q.imag == 0)) & ((p.imag == 0) | (q.real == 0))
    open_ = np.flatnonzero(~certain & ~flat)
    open_ = open_[np.isfinite(a[open_]) & np.isfinite(b[open_]) & np.isfinite(c[open_])]
    signs[open_] = _exact_orientations(a[open_], b[open_], c[open_])
    return signs


def _exact_orientations(a: Complex, b: Complex, c: Complex) -> NDArray[np.int8]:
    """Return the signs by integer arithmetic, scaling each triangle by a power of two."""
    parts = np.stack([a.real, a.imag, b.real, b.imag, c.real, c.imag])
    mantissa, exponent = np.frexp(parts)
    whole = np.ldexp(mantissa, 53).astype(np.int64).astype(object)
    shift = (exponent - exponent.min(axis=0, initial=0)).astype(object)
    ax, ay, bx, by, cx, cy = whole << shift
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return np.asarray((area > 0).astype(np.int8) - (area < 0).astype(np.int8))


def turns(z: Complex) -> tuple[int, int, int]:
    """Return how a loop of points goes around the origin.

    The first number counts turns if each arc is taken counter-clockwise: 1 if the points go around
    once and in order. The others explain a larger number: the winding number of the polygon, and
    the number of arcs that run backward. Neighbours whose angles differ only by rounding are in
    order.
    """
    arcs = np.angle(np.roll(z, -1) * np.conj(z))
    backward = arcs < -ANGLE_ROUNDING
    forward = np.where(backward, arcs + 2 * np.pi, np.maximum(arcs, 0))
    around, winding = (round(float(total) / (2 * np.pi)) for total in (forward.sum(), arcs.sum()))
    return around, winding, int(np.count_nonzero(backward))


def winding_words(winding: int) -> str:
    """Return in words how a loop goes around the origin, given its winding number."""
    if not winding:
        return "does not go around the circle"
    times = {1: "once", 2: "twice"}.get(abs(winding), f"{abs(winding)} times")
    return f"goes around the circle {times}, {'counter-' if winding > 0 else ''}clockwise"


def backward_arcs(f_b: Complex) -> int:
    """Return the number of arcs of a loop that do not run counter-clockwise about 0."""
    return int(np.count_nonzero(~(np.imag(np.conj(f_b) * np.roll(f_b, -1)) > 0)))


def fitted_circle(z: Complex) -> tuple[complex, float]:
    """Return centre and radius of the circle closest to points (least squares, Kasa).

    The radius is NaN if the points do not determine a circle.
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
    """Return two closed polygons that cross or touch each other; None if there are none.

    Two equal indices mean a polygon that crosses or touches itself. Consecutive equal points count
    once.
    """
    import shapely  # imported here: every measured process would wait for it

    rings = [shapely.linearrings(np.stack([z.real, z.imag], axis=1)) for z in curves]
    for k in np.flatnonzero(~shapely.is_simple(rings)):
        return int(k), int(k)
    pairs = shapely.STRtree(rings).query(rings, predicate="intersects")
    for one, other in sorted((int(i), int(j)) for i, j in pairs.T if i < j):
        return one, other
    return None


def bounds_once(curves: Sequence[Complex]) -> bool:
    """Whether closed polygons bound a region that covers no point twice, if nothing is folded.

    They must not cross, and all but the outer one must be holes: about a branch point, boundaries
    that do not cross can have the region inside two of them.
    """
    areas = np.array([polygon_area(z) for z in curves])
    holes = np.count_nonzero(areas * areas.sum() <= 0)
    return bool(holes == len(curves) - 1) and crossing_polygons(curves) is None


def overlap_share(curves: Sequence[Complex]) -> float:
    """Return the share of a region that lies over other parts of it, from its boundary alone.

    The curves are the closed polygons that bound the region, holes clockwise. Without folds, a
    point with winding number w is covered w times, of which w - 1 are too many. The share is the
    area of these over the area of all layers; infinite if the curves cross more than
    :data:`MAX_CROSSINGS` times or enclose nothing.

    Examples
    --------
    >>> import numpy as np
    >>> square = np.array([0, 1, 1 + 1j, 1j])
    >>> overlap_share([square])
    0.0
    >>> overlap_share([np.tile(square, 2) + np.repeat([0, 1e-3], 4)]) > 0.49
    True
    """
    if bounds_once(curves):
        return 0.0
    starts = np.concatenate(curves)
    ends = np.concatenate([np.roll(z, -1) for z in curves])
    if sum(polygon_area(z) for z in curves) < 0:
        starts, ends = np.conj(starts), np.conj(ends)
    covered, over = layered_areas(starts, ends)
    return over / covered if covered > 0 else float("inf")


def layered_areas(starts: Complex, ends: Complex) -> tuple[float, float]:
    """Return the area of all layers that closed curves bound, and of the layers above the lowest.

    The curves are given by their sides, from `starts` to `ends` (b,), the region to their left.
    Both are NaN if sides cross more than :data:`MAX_CROSSINGS` times.
    """
    import shapely

    if not len(starts):
        return 0.0, 0.0
    sides = shapely.linestrings(
        np.stack([starts.real, ends.real], axis=1), np.stack([starts.imag, ends.imag], axis=1)
    )
    meeting = shapely.STRtree(sides).query(sides, predicate="intersects").shape[1]
    if (meeting - 3 * len(sides)) / 2 > MAX_CROSSINGS:  # each side meets itself and its neighbours
        return float("nan"), float("nan")
    faces = shapely.get_parts(shapely.polygonize([shapely.unary_union(sides)]))
    inside = shapely.point_on_surface(faces)
    layers = windings(shapely.get_x(inside) + 1j * shapely.get_y(inside), starts, ends)
    areas = shapely.area(faces)
    covered = float((np.maximum(layers, 0) * areas).sum())
    return covered, float((np.maximum(layers - 1, 0) * areas).sum())


def windings(points: Complex, starts: Complex, ends: Complex) -> Indices:
    """Return the winding numbers of closed curves around points (k,).

    The curves are given by their sides, from `starts` to `ends` (b,); no point lies on a side.
    """
    turns = np.empty(len(points), dtype=np.int64)
    step = max(1, AT_ONCE // len(starts))
    for k in range(0, len(points), step):
        a, b = (z - points[k : k + step, None] for z in (starts, ends))
        left = np.imag(np.conj(a) * b)
        up, down = (a.imag <= 0) & (b.imag > 0), (a.imag > 0) & (b.imag <= 0)
        turns[k : k + step] = (up & (left > 0)).sum(axis=1) - (down & (left < 0)).sum(axis=1)
    return turns
