"""Is a map what the harness says? Decided with rational numbers, without any rounding.

The floating-point numbers of a map are rationals, so the side of a line on which a point lies, the
order of two directions and a winding number are decided exactly. Only the distance from the unit
circle has a tolerance, the harness's own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import combinations

Point = tuple[Fraction, Fraction]
Face = tuple[int, ...]

#: How far from the unit circle a boundary vertex may lie; 1 % above the harness's figure.
CIRCLE = Fraction(101, 10**11)
#: Neighbours on the circle whose angles differ by less are in order either way: 4 units in the last
#: place. Where that hides a fault, a triangle is turned or a winding number is wrong.
ANGLE = Fraction(1, 10**15)
#: Holes this close to a circle, relative to the radius, are taken to be circles.
CIRCULAR = 1e-3
#: How many triangles' centres are looked at for overlaps.
SAMPLES = 12


def faults_of_map(uv: Sequence[complex], faces: Sequence[Face], target: str) -> list[str]:
    """Return what keeps a map from being an embedding on its target; empty where nothing does.

    Parameters
    ----------
    uv : sequence of complex
        The image of each vertex.
    faces : sequence of triples
        Triangles, counter-clockwise on the surface.
    target : str
        "disk", "circular holes", "disk with holes" or "free boundary".

    A free boundary may overlap itself (see :func:`overlaps`); everything else must not.
    """
    points = [(Fraction(z.real), Fraction(z.imag)) for z in uv]
    turned = sum(side(*(points[k] for k in face)) <= 0 for face in faces)
    found = [f"{turned} of {len(faces)} triangles are not counter-clockwise"] if turned else []
    loops = boundary_loops(faces)
    if target == "free boundary" or not loops:
        return found
    polygons = [[points[k] for k in loop] for loop in loops]
    outer = max(polygons, key=twice_area)
    found += _faults_of_circle(outer)
    holes = [polygon for polygon in polygons if polygon is not outer]
    for hole in holes:
        if twice_area(hole) >= 0:
            found.append("a hole runs the wrong way round")
        if any(winding_number(outer, point) != 1 for point in hole):
            found.append("a hole lies outside")
    if holes:
        found += _faults_of_holes(outer, holes)
    found += [] if turned else _wrong_windings(points, faces, polygons)
    return found


def overlaps(uv: Sequence[complex], faces: Sequence[Face]) -> bool:
    """Whether some of the triangles' centres, a sample, are covered more than once."""
    points = [(Fraction(z.real), Fraction(z.imag)) for z in uv]
    polygons = [[points[k] for k in loop] for loop in boundary_loops(faces)]
    return bool(_wrong_windings(points, faces, polygons))


def side(a: Point, b: Point, c: Point) -> Fraction:
    """Return twice the signed area of a triangle; positive where it is counter-clockwise."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def twice_area(polygon: Sequence[Point]) -> Fraction:
    """Return twice what a closed polygon encloses, positive where it is counter-clockwise."""
    return sum((a[0] * b[1] - a[1] * b[0] for a, b in _edges(polygon)), Fraction(0))


def winding_number(polygon: Sequence[Point], point: Point) -> int:
    """Count how often a polygon winds round a point that is not on it."""
    number = 0
    for a, b in _edges(polygon):
        if a[1] <= point[1] < b[1] and side(a, b, point) > 0:
            number += 1
        elif b[1] <= point[1] < a[1] and side(a, b, point) < 0:
            number -= 1
    return number


def boundary_loops(faces: Sequence[Face]) -> list[list[int]]:
    """Return the boundary's vertices loop by loop, the surface on the left."""
    directed = {(f[k], f[(k + 1) % 3]) for f in faces for k in range(3)}
    following = {a: b for a, b in directed if (b, a) not in directed}
    loops = []
    while following:
        start, at = next(iter(following.items()))
        loop = [start]
        del following[start]
        while at != start:
            loop.append(at)
            at = following.pop(at)
        loops.append(loop)
    return loops


def _edges(polygon: Sequence[Point]) -> Iterator[tuple[Point, Point]]:
    return ((polygon[k - 1], polygon[k]) for k in range(len(polygon)))


def _faults_of_circle(polygon: Sequence[Point]) -> list[str]:
    """Whether the points lie on the unit circle, each further round than the last, once round."""
    collected = []
    squared = [x * x + y * y for x, y in polygon]
    if not all((1 - CIRCLE) ** 2 <= r <= (1 + CIRCLE) ** 2 for r in squared):
        collected.append("the outer boundary is not on the unit circle")
    equal = sum(_compare(a, b) == 0 for a, b in _edges(polygon))
    if equal:
        collected.append(f"{equal} pairs of neighbours on the boundary are at the same angle")
    # Along a boundary that runs once round, the angle from 0 to 2 pi falls once.
    falls = sum(_compare(a, b) > 0 and not _by_rounding(a, b) for a, b in _edges(polygon))
    if falls != 1:
        collected.append(f"along the boundary the angle falls {falls} times, not once")
    return collected


def _compare(a: Point, b: Point) -> int:
    """Compare the angles of two points about 0, from 0 to 2 pi."""
    half_a, half_b = _lower_half(a), _lower_half(b)
    if half_a != half_b:
        return 1 if half_a else -1
    cross = a[0] * b[1] - a[1] * b[0]
    return (cross < 0) - (cross > 0)


def _by_rounding(a: Point, b: Point) -> bool:
    """Whether two points on one half of the circle have hardly different angles."""
    return _lower_half(a) == _lower_half(b) and abs(a[0] * b[1] - a[1] * b[0]) < ANGLE


def _lower_half(a: Point) -> bool:
    return a[1] < 0 or (a[1] == 0 and a[0] < 0)


def _faults_of_holes(outer: Sequence[Point], holes: Sequence[Sequence[Point]]) -> list[str]:
    collected = []
    edges = [(n, edge) for n, loop in enumerate([outer, *holes]) for edge in _edges(loop)]
    boxes = [_box(edge) for _, edge in edges]
    for (i, (m, one)), (j, (n, other)) in combinations(enumerate(edges), 2):
        shared = m == n and not {*one}.isdisjoint(other)
        if not shared and _boxes_meet(boxes[i], boxes[j]) and _meet(*one, *other):
            collected.append("two boundaries cross, or one crosses itself")
            break
    return collected


def circles_out_of_place(uv: Sequence[complex], faces: Sequence[Face]) -> list[str]:
    """Return how the circles of a map with holes, where they are some, lie in the wrong place.

    Three points always lie on a circle, so that nothing but such a circle tells of a bad map.
    """
    points = [(Fraction(z.real), Fraction(z.imag)) for z in uv]
    loops = [[points[k] for k in loop] for loop in boundary_loops(faces)]
    holes = sorted(loops, key=twice_area)[:-1]
    circles = [circle for circle in map(_circle, holes) if circle[2] <= CIRCULAR]
    collected = []
    for (c, r, _), (d, s, _) in combinations(circles, 2):
        if abs(c - d) < (r + s) * (1 - CIRCULAR):
            collected.append("the circles of two holes overlap")
    if any(abs(c) + r > 1 + CIRCULAR for c, r, _ in circles):
        collected.append("the circle of a hole reaches out of the disk")
    return collected


def _box(edge: tuple[Point, Point]) -> tuple[Fraction, Fraction, Fraction, Fraction]:
    (a, b), (c, d) = edge
    return min(a, c), max(a, c), min(b, d), max(b, d)


def _boxes_meet(p: Sequence[Fraction], q: Sequence[Fraction]) -> bool:
    return p[0] <= q[1] and q[0] <= p[1] and p[2] <= q[3] and q[2] <= p[3]


def _meet(a: Point, b: Point, c: Point, d: Point) -> bool:
    return side(a, b, c) * side(a, b, d) <= 0 and side(c, d, a) * side(c, d, b) <= 0


def _circle(polygon: Sequence[Point]) -> tuple[complex, float, float]:
    """Return centre and mean radius of a polygon's corners, and how far they are from a circle."""
    z = [complex(float(x), float(y)) for x, y in polygon]
    centre = _circumcentre(z[0], z[len(z) // 3], z[2 * len(z) // 3])
    radii = [abs(w - centre) for w in z]
    radius = math.fsum(radii) / len(radii)
    off = max(abs(r - radius) for r in radii) / radius if radius else math.inf
    return centre, radius, off if math.isfinite(off) else math.inf


def _circumcentre(a: complex, b: complex, c: complex) -> complex:
    b, c = b - a, c - a
    area = (b.conjugate() * c).imag
    if area == 0:
        return complex(math.inf, 0)
    return a + (c * abs(b) ** 2 - b * abs(c) ** 2) / (2j * area)


def _wrong_windings(
    points: Sequence[Point], faces: Sequence[Face], polygons: Sequence[Sequence[Point]]
) -> list[str]:
    """Count how often the boundaries wind round the centres of some triangles: once each."""
    step = max(1, len(faces) // SAMPLES)
    for face in faces[::step]:
        corners = [points[k] for k in face]
        centre = (
            sum(p[0] for p in corners) / Fraction(3),
            sum(p[1] for p in corners) / Fraction(3),
        )
        number = sum(winding_number(polygon, centre) for polygon in polygons)
        if number != 1:
            return [f"a triangle's image is covered {number} times"]
    return []
