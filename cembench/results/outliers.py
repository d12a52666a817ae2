"""Disk maps that are far worse than those of the other algorithms on their surface."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby
from statistics import median

from cembench.results.records import Record

#: A map is an outlier if its mean angle error is over this many times the others' median ...
TIMES = 3.0
#: ... and at least this many degrees: below, ratios are of rounding.
DEGREES = 0.1
#: The fewest other algorithms whose median says what a surface allows.
FEWEST = 2
#: Maximum numbers of algorithms, and of further surfaces of each, that are listed.
LISTED, NAMED = 5, 6


@dataclass(frozen=True)
class Outlier:
    """A map whose mean angle error is over three times the median of the other algorithms'."""

    record: Record
    angle: float
    median: float

    @property
    def times(self) -> float:
        """The mean angle error over the others' median; infinite for a median of 0."""
        return self.angle / self.median if self.median else float("inf")

    @property
    def words(self) -> str:
        """The map and both figures."""
        return (
            f"{self.record.title} on {self.record.cell.mesh}: {self.angle:.3g} degrees, "
            f"the other algorithms' median is {self.median:.3g}"
        )


def outliers(records: Iterable[Record]) -> list[Outlier]:
    """Return the disk maps over three times worse than the others' median, the worst first.

    What counts is the mean angle error, whatever the status of the cell. An algorithm measured
    several times on a surface (policies, parameters) is one of the others by its median, and is
    named by its worst map.
    """
    by_surface: dict[str, dict[str, list[tuple[float, Record]]]] = {}
    for record in records:
        angle = record.outcome.metrics.get("angle_error_mean_deg")
        if record.target == "disk" and angle is not None:
            here = by_surface.setdefault(record.cell.mesh_hash, {})
            here.setdefault(record.cell.algorithm, []).append((float(angle), record))
    found = []
    for here in by_surface.values():
        usual = {name: median(angle for angle, _ in maps) for name, maps in here.items()}
        for name, maps in here.items():
            others = [angle for other, angle in usual.items() if other != name]
            worst, record = max(maps, key=lambda one: one[0])
            if len(others) >= FEWEST and worst >= DEGREES and worst > TIMES * median(others):
                found.append(Outlier(record, worst, median(others)))
    return sorted(found, key=lambda one: -one.times)


def outlier_lines(records: Iterable[Record]) -> list[str]:
    """Return a line for each algorithm with :func:`outliers`, with its worst map and the others.

    Algorithms that do not promise conformal maps come last, and say so. Those beyond
    :data:`LISTED` are counted.
    """
    found = sorted(outliers(records), key=lambda one: one.record.cell.algorithm)
    grouped = [list(g) for _, g in groupby(found, key=lambda one: one.record.cell.algorithm)]
    ordered = sorted(grouped, key=lambda maps: (not _is_conformal(maps[0]), -maps[0].times))
    left = sum(map(len, ordered[LISTED:]))
    return [
        *map(_line, ordered[:LISTED]),
        *([f"and {left} more maps by other algorithms"] if left else []),
    ]


def _line(maps: Sequence[Outlier]) -> str:
    """Return the line of an algorithm: its worst map, and the surfaces of the others."""
    first, *rest = maps
    named = ", ".join(
        f"{one.record.cell.mesh} ({one.angle:.3g}, median {one.median:.3g})" for one in rest[:NAMED]
    )
    more = f" and {len(rest) - NAMED} more" if len(rest) > NAMED else ""
    return (
        first.words
        + (f"; also on {named}{more}" if rest else "")
        + ("" if _is_conformal(first) else " (its maps are not conformal by design)")
    )


def _is_conformal(found: Outlier) -> bool:
    """Whether the algorithm promises conformal maps; those of plug-ins are taken to."""
    from cembench.registry import load_registry

    known = load_registry().algorithms.get(found.record.cell.algorithm)
    return known is None or known.conformal
