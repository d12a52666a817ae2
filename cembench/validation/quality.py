"""Stage 3: quality and speed against a baseline, paired by surface and by round.

Quality: the ratio of a figure on each surface of which both maps keep the whole promise of their
target. A surface counts as lower or higher if the ratio is more than 1 %
off 1; the median ratio has the order interval of :mod:`cembench.results.intervals` over the
surfaces, none for fewer than six.

Speed: a round's figure is the median over the surfaces of the ratio of both algorithms' seconds in
that round. The interval is over the rounds: it shows how certain the figure is on these surfaces,
not what it would be on others. Verdicts listed together, over several surfaces or baselines, are
corrected for multiple comparisons (Holm).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import starmap

from pydantic import BaseModel, ConfigDict

from cembench.core.notices import NoticeKind, of_kind
from cembench.results.columns import solve_words
from cembench.results.comparison import (
    Comparison,
    compare,
    compare_ratios,
    confirmed,
    measured_ratios,
    middle_ratio,
    paired_ratios,
)
from cembench.results.intervals import Interval, median_interval
from cembench.results.multiple_testing import corrected
from cembench.results.records import FaultKind, Record, relative_energy
from cembench.results.regressions import NO_ANGLE, NO_ENERGY, TIE
from cembench.validation.finding import Stage, ValidationFinding, finding

_GAUGE = "common_gauge_energy"


class PairedComparison(BaseModel):
    """Numbers of surfaces with a figure below, equal to (within 1 %) or above the baseline's."""

    model_config = ConfigDict(frozen=True)

    lower: int
    equal: int
    higher: int
    #: Median over the surfaces of our figure over theirs, and its 95 % interval.
    ratio: float | None
    interval: Interval | None

    @property
    def surfaces(self) -> int:
        """Number of pairs."""
        return self.lower + self.equal + self.higher


class Pair(BaseModel):
    """One surface: our figures and the baseline's; None if there is no valid map."""

    model_config = ConfigDict(frozen=True)

    @property
    def angle_ratio(self) -> float | None:
        """Our mean angle error over the baseline's; those that are rounding count as equal."""
        return _ratio(self.angle, self.baseline_angle, NO_ANGLE)

    surface: str
    faces: int
    energy: float | None
    baseline_energy: float | None
    angle: float | None
    baseline_angle: float | None
    seconds: float | None
    baseline_seconds: float | None
    #: Its verdict holds together with those of the other surfaces.
    speed: Comparison | None
    #: For an external program: its wall-clock seconds on a small mesh, and its solve time, which
    #: the ratio uses.
    start_seconds: float | None = None
    solve_seconds: float | None = None
    #: Keys of our record and of the baseline's.
    records: tuple[str, str]

    @property
    def energy_ratio(self) -> float | None:
        """Our energy over the baseline's; None if one of them has none."""
        return _ratio(self.energy, self.baseline_energy, NO_ENERGY)


def _ratio(ours: float | None, theirs: float | None, least: float) -> float | None:
    if ours is None or theirs is None:
        return None
    return max(ours, least) / max(theirs, least)


class BaselineComparison(BaseModel):
    """The comparison with one baseline."""

    model_config = ConfigDict(frozen=True)

    baseline: str
    title: str
    #: Whether energies are divided by the image's area: unless both images are the unit disk.
    relative: bool
    #: Whether energies are those in the common gauge: both are disks and the records have them.
    common_gauge: bool = False
    pairs: tuple[Pair, ...]
    energy: PairedComparison
    angle: PairedComparison
    #: Our seconds over the baseline's, over the rounds; None if no round timed both.
    speed: Comparison | None
    #: For an external program, the origin of the solve time that the ratios use.
    solve_time: str = ""

    @property
    def energy_name(self) -> str:
        """Name of the compared energies."""
        if self.common_gauge:
            return "E_C in the common gauge"
        return "E_C by area" if self.relative else "E_C"


def comparison_with(records: Sequence[Record], ours: str, baseline: str) -> BaselineComparison:
    """Compare the records of two algorithms in a run.

    Raises
    ------
    ValueError
        One of them has no record.
    """
    mine = {r.cell.mesh: r for r in records if r.cell.algorithm == ours}
    theirs = {r.cell.mesh: r for r in records if r.cell.algorithm == baseline}
    names = [name for name in mine if name in theirs]
    if not names:
        raise ValueError(f"no surface has records of both {ours!r} and {baseline!r}")
    one, other = next(iter(mine.values())), next(iter(theirs.values()))
    # The size of an image that is not the unit disk is free.
    relative = (one.target, other.target) != ("disk", "disk")
    gauge = not relative and all(_has_gauge(r) for n in names for r in (mine[n], theirs[n]))
    both = [(mine[name], theirs[name]) for name in names]
    pairs = tuple(
        _pair(*records, speed, relative=relative, gauge=gauge)
        for records, speed in zip(both, corrected(list(starmap(compare, both))), strict=True)
    )
    return BaselineComparison(
        baseline=baseline,
        title=theirs[names[0]].title,
        relative=relative,
        common_gauge=gauge,
        pairs=pairs,
        energy=sides([ratio for p in pairs if (ratio := p.energy_ratio) is not None]),
        angle=sides([ratio for p in pairs if (ratio := p.angle_ratio) is not None]),
        speed=compare_speed(both),
        solve_time=next((solve_words(r) for r in mine.values() if r.is_program), ""),
    )


def together(against: Sequence[BaselineComparison]) -> tuple[BaselineComparison, ...]:
    """Return the comparisons with verdicts on speed corrected for their number (Holm)."""
    speeds = corrected([a.speed for a in against])
    return tuple(
        a.model_copy(update={"speed": one}) for a, one in zip(against, speeds, strict=True)
    )


def sides(ratios: Sequence[float]) -> PairedComparison:
    """Return the summary of ratios, ours over theirs, over the surfaces."""
    return PairedComparison(
        lower=sum(ratio < 1 - TIE for ratio in ratios),
        equal=sum(1 - TIE <= ratio <= 1 + TIE for ratio in ratios),
        higher=sum(ratio > 1 + TIE for ratio in ratios),
        ratio=middle_ratio(ratios) if ratios else None,
        interval=median_interval(ratios),
    )


def compare_speed(pairs: Sequence[tuple[Record, Record]]) -> Comparison | None:
    """Return the speed comparison over all surfaces on which both were timed."""
    by_round = _by_round([paired_ratios(ours, theirs) for ours, theirs in pairs])
    if not by_round:
        return None
    measured = _by_round([measured_ratios(ours, theirs) for ours, theirs in pairs])
    return confirmed(compare_ratios(by_round), measured)


def _by_round(by_surface: Sequence[Sequence[float]]) -> list[float]:
    """Return the median ratio over the surfaces that have ratios, for each round."""
    known = [ratios for ratios in by_surface if ratios]
    return [middle_ratio(ratios) for ratios in zip(*known, strict=False)]


def folds_on(records: Sequence[Record]) -> list[str]:
    """Return the surfaces with a map whose only fault is folded triangles."""
    return [r.cell.mesh for r in records if _only_folds(r)]


def without_map(records: Sequence[Record]) -> dict[str, str]:
    """Return the surfaces on which the algorithm failed or reached a limit, with the cause."""
    return {r.cell.mesh: r.outcome.cause or "" for r in records if _has_none(r)}


def maps_every_surface(stage: Stage, records: Sequence[Record]) -> ValidationFinding:
    """Check that each record has a map, a map with folds, or a failure with a cause."""
    bad = [
        f"{r.cell.mesh}: {r.outcome.status}: {r.outcome.cause}"
        for r in records
        if r.outcome.status != "ok" and not _only_folds(r) and not _has_none(r)
    ]
    none = len(without_map(records)) == len(records)
    right = f"no map on any of {len(records)} surfaces" if none else "a map or a cause on each"
    return finding(stage, "every surface", "; ".join(bad) or right, ok=not bad and not none)


def quality_findings(records: Sequence[Record]) -> list[ValidationFinding]:
    """Check that each record has a map or a cause, and the same one in every round."""
    changing = [
        r.cell.mesh for r in records if of_kind(NoticeKind.NOT_DETERMINISTIC, r.outcome.notes)
    ]
    bits = f"different bits in a later call on {', '.join(changing)}"
    measured = bits if changing else "the same bits in every round"
    repeated = finding("quality", "repeatable in every round", measured, ok=not changing)
    return [maps_every_surface("quality", records), repeated]


def _pair(
    ours: Record, theirs: Record, speed: Comparison | None, *, relative: bool, gauge: bool
) -> Pair:
    return Pair(
        surface=ours.cell.mesh,
        faces=ours.mesh.faces,
        energy=_energy(ours, relative=relative, gauge=gauge),
        baseline_energy=_energy(theirs, relative=relative, gauge=gauge),
        angle=_valid(ours).get("angle_error_mean_deg"),
        baseline_angle=_valid(theirs).get("angle_error_mean_deg"),
        seconds=ours.outcome.median_seconds if ours.outcome.status == "ok" else None,
        baseline_seconds=theirs.outcome.median_seconds if theirs.outcome.status == "ok" else None,
        speed=speed,
        start_seconds=ours.outcome.start_seconds,
        solve_seconds=ours.outcome.solve_seconds if ours.is_program else None,
        records=(ours.cell.key, theirs.cell.key),
    )


def _valid(record: Record) -> Mapping[str, float | int | None]:
    return record.outcome.metrics if record.outcome.status == "ok" else {}


def _has_gauge(record: Record) -> bool:
    """Whether a map has an energy in the common gauge; an invalid map has none."""
    valid = _valid(record)
    return record.target == "disk" and (not valid or valid.get(_GAUGE) is not None)


def _energy(record: Record, *, relative: bool, gauge: bool) -> float | None:
    known = _valid(record)
    energy = known.get(_GAUGE if gauge else "conformal_energy")
    energy = relative_energy(known) if relative else energy
    # Quality and seconds are those of one map.
    return None if energy is None else energy * record.outcome.worse_when_timed


def _only_folds(record: Record) -> bool:
    """Whether folds, and a boundary out of order that causes them, are the only faults."""
    kinds = {fault.kind for fault in record.outcome.faults}
    return FaultKind.FOLDED in kinds <= {FaultKind.FOLDED, FaultKind.BOUNDARY_ORDER}


def _has_none(record: Record) -> bool:
    return record.outcome.status in ("timeout", "out_of_memory") or record.outcome.gave_up
