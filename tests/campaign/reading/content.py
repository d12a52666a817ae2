"""What a mesh file holds, and the numbers in it."""

from __future__ import annotations

import re
from dataclasses import dataclass

Point = tuple[float, ...]

_INTEGER = re.compile(r"[+-]?[0-9]+")
_NOT_FINITE = re.compile(r"[+-]?(nan|inf(inity)?)", re.IGNORECASE)
_REAL = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")


def lines_of(data: bytes) -> list[list[str]]:
    """Return the words of each line that has some; only ASCII's white space parts them."""
    words = [[word.decode("latin-1") for word in line.split()] for line in data.splitlines()]
    return [line for line in words if line]


class Damaged(Exception):  # noqa: N818 - it is what the reader finds, not a mistake of its own
    """The file breaks its format's specification; the message says where."""


@dataclass(frozen=True)
class Content:
    """Vertices in the file's order, and polygons as vertex indices from 0."""

    points: list[Point]
    polygons: list[tuple[int, ...]]

    @property
    def triangles(self) -> int:
        """How many triangles the polygons make: k - 2 for one of k corners."""
        return sum(len(polygon) - 2 for polygon in self.polygons)

    def used(self) -> Content:
        """Return this content without the points of no polygon."""
        numbers = sorted({k for polygon in self.polygons for k in polygon})
        place = {number: k for k, number in enumerate(numbers)}
        polygons = [tuple(place[k] for k in polygon) for polygon in self.polygons]
        return Content([self.points[k] for k in numbers], polygons)

    def checked(self, *, lines: bool = False) -> Content:
        """Return this content, or raise where a polygon cannot be one. `lines` may be there."""
        polygons = [polygon for polygon in self.polygons if len(polygon) != 2 or not lines]
        if polygons and len(polygons) < len(self.polygons):
            return Content(self.points, polygons).checked()
        for number, polygon in enumerate(self.polygons):
            if len(polygon) < 3:
                raise Damaged(f"face {number} has {len(polygon)} corners")
            if min(polygon) < 0 or max(polygon) >= len(self.points):
                raise Damaged(f"face {number} names a vertex that is not there")
        return self


def integer(word: str) -> int:
    """Return the whole number that a word is, in plain decimal digits."""
    if not _INTEGER.fullmatch(word):
        raise Damaged(f"{word[:40]!r} is not a whole number")
    if len(word) > 30:
        raise Damaged(f"{word[:40]!r}... is too large")
    return int(word)


def real(word: str) -> float:
    """Return the number that a word is; neither NaN nor infinity is one."""
    value = rounded(word)
    if value in (float("inf"), float("-inf")):
        raise Damaged(f"{word[:40]!r} is too large")
    return value


def rounded(word: str) -> float:
    """Return the number that a word is as a double, infinite where it is too large for one."""
    if not _REAL.fullmatch(word):
        raise Damaged(f"{word[:40]!r} is not a number")
    return float(word)


def unread(word: str) -> float:
    """Return the number that a word is that nobody reads: any, or NaN or infinity by name."""
    return float(word) if _NOT_FINITE.fullmatch(word) else rounded(word)


def finite(value: float) -> float:
    """Return the value unless it is NaN or infinite."""
    if value != value or value in (float("inf"), float("-inf")):
        raise Damaged("a coordinate is NaN or infinite")
    return value
