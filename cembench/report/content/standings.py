"""Algorithms compared on the surfaces that all of them mapped: angle errors, seconds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, inf, log
from statistics import mean, median

import numpy as np

from cembench.report.content.evidence import (
    ANGLE,
    AS_GOOD,
    DEGREES,
    AlgorithmSeries,
    Evidence,
    figure_of,
)
from cembench.results.comparison import Comparison, compare_ratios, paired_ratios
from cembench.results.families import FEWEST_FAMILIES, average_interval, family_means
from cembench.results.intervals import Interval
from cembench.results.records import Record

#: An algorithm takes part with maps of at least this share of the surfaces that most mapped.
SHARE = 0.9
#: Smaller mean angle errors, in degrees, count as this: their ratios are of rounding.
FLOOR = 0.01
#: An angle error within this share of the smallest one of a surface counts as equal to it.
NEAR = 0.01


def as_good(angles: Sequence[float], best: Sequence[float]) -> bool:
    """Whether maps are about as good as the best ones on every surface.

    Both are mean angle errors in degrees, one per surface.
    """
    return all(a <= max(AS_GOOD * b, b + DEGREES) for a, b in zip(angles, best, strict=True))


@dataclass(frozen=True)
class Standing:
    """An algorithm's records on the common surfaces."""

    series: AlgorithmSeries
    records: tuple[Record, ...]
    #: The family of each record's surface.
    families: tuple[str, ...]

    @property
    def label(self) -> str:
        """The algorithm's name in this run."""
        return self.series.label

    @property
    def seconds(self) -> float:
        """The geometric mean of the seconds over families."""
        logs = [log(r.outcome.median_seconds or 1.0) for r in self.records]
        return exp(mean(family_means(logs, self.families)))

    @property
    def angles(self) -> list[float]:
        """The mean angle errors in degrees by surface, none below :data:`FLOOR`."""
        return [max(FLOOR, figure_of(r, ANGLE)) for r in self.records]

    @property
    def angle(self) -> float:
        """The geometric mean of the mean angle errors over families."""
        return exp(mean(family_means([log(a) for a in self.angles], self.families)))


@dataclass(frozen=True)
class AngleRatio:
    """The angle errors of an algorithm over those of another on the same surfaces.

    All three are over families; the interval is None for fewer than six.
    """

    mean: float
    median: float
    interval: Interval | None

    @property
    def is_sure(self) -> bool:
        """Whether the interval shows that the other's are smaller."""
        return self.interval is not None and self.interval.low > 1


@dataclass(frozen=True)
class Field:
    """The algorithms that are compared, those with the smallest angle errors first."""

    standings: tuple[Standing, ...]
    #: Number of surfaces that an algorithm for disks mapped.
    surfaces: int
    #: Labels of the algorithms that mapped too few of them.
    left_out: tuple[str, ...]

    @property
    def n(self) -> int:
        """Number of surfaces that all of them mapped."""
        return len(self.standings[0].records)

    @property
    def families(self) -> int:
        """Number of objects that these surfaces show."""
        return len(set(self.standings[0].families))

    @property
    def smallest(self) -> list[float]:
        """The smallest mean angle error on each surface."""
        return [min(column) for column in zip(*(s.angles for s in self.standings), strict=True)]

    @property
    def good(self) -> list[Standing]:
        """The algorithms that are as good as the best one on every surface, the fastest first."""
        kept = [s for s in self.standings if as_good(s.angles, self.smallest)]
        return sorted(kept, key=lambda s: s.seconds)

    def near(self, standing: Standing, share: float) -> list[bool]:
        """Return on which surfaces the angle error is within a share of the smallest."""
        pairs = zip(standing.angles, self.smallest, strict=True)
        return [own <= (1 + share) * least for own, least in pairs]


def field_of(evidence: Evidence, policy: str) -> Field | None:
    """Return the main algorithms that map to the disk, on the surfaces that all of them mapped.

    Those that mapped fewer than :data:`SHARE` of what others did are left out. None if there is no
    surface.
    """
    held = {s: _maps(evidence, s, policy) for s in evidence.disk_series if s.main}
    most = max(map(len, held.values()), default=0)
    chosen = {s: maps for s, maps in held.items() if maps and len(maps) >= SHARE * most}
    common = set.intersection(*map(set, chosen.values())) if chosen else set()
    if not common:
        return None
    shared = [s for s in evidence.surfaces if s.mesh_hash in common]
    families = tuple(s.family for s in shared)
    standings = [
        Standing(s, tuple(maps[one.mesh_hash] for one in shared), families)
        for s, maps in chosen.items()
    ]
    return Field(
        tuple(sorted(standings, key=lambda s: s.angle)),
        len({key for maps in held.values() for key in maps}),
        tuple(s.label for s in held if s not in chosen),
    )


def _maps(evidence: Evidence, series: AlgorithmSeries, policy: str) -> dict[str, Record]:
    """Return the records of an algorithm that have seconds and angles, by surface."""
    found = {s.mesh_hash: evidence.find(s, series, policy) for s in evidence.surfaces}
    return {
        key: record
        for key, record in found.items()
        if record is not None and record.outcome.median_seconds and figure_of(record, ANGLE) < inf
    }


def compare_angles(other: Standing, best: Standing) -> AngleRatio:
    """Return the geometric mean over families of other / best, with its interval and the median."""
    ratios = [a / b for a, b in zip(other.angles, best.angles, strict=True)]
    logs = family_means([log(ratio) for ratio in ratios], best.families)
    interval = average_interval(ratios, best.families)
    return AngleRatio(exp(mean(logs)), exp(median(logs)), interval)


def compare_seconds(slower: Standing, faster: Standing) -> Comparison | None:
    """Compare two algorithms by the ratios of their seconds within rounds.

    With enough families the ratios of these decide, which is a statement on other families;
    otherwise the means over the surfaces in each round do, a statement on these surfaces.
    """
    ratios = [paired_ratios(a, b) for a, b in zip(slower.records, faster.records, strict=True)]
    rounds = min(map(len, ratios))
    if not rounds:
        return None
    if len(set(faster.families)) >= FEWEST_FAMILIES:
        logs = [median(map(log, found)) for found in ratios]
        return compare_ratios([exp(own) for own in family_means(logs, faster.families)])
    together = np.log([found[:rounds] for found in ratios]).mean(axis=0)
    return compare_ratios(np.exp(together).tolist())


def listed(names: Sequence[str]) -> str:
    """Return names as "a, b and c"."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
