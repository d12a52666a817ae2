"""The verdict of a validation, as data and as a sentence.

The figures are data (:class:`Validation`); :func:`sentence` is the one place that words them. Their
intervals stand in tables.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import Any, get_args

from pydantic import BaseModel, ConfigDict, Field

from cembench.core.wording import counted
from cembench.results.comparison import Comparison
from cembench.results.records import Printable
from cembench.validation.finding import Stage, ValidationFinding
from cembench.validation.quality import BaselineComparison
from cembench.validation.scaling import GrowthAnswer, GrowthComparison
from cembench.validation.sizes import is_higher_at_last, looked_at_sentence
from cembench.validation.solver import CheckedMap

STAGES: tuple[Stage, ...] = get_args(Stage)


class Requirement(StrEnum):
    """Requirements that ``--require`` can add to validity, for every baseline."""

    faster = "faster"
    not_slower = "not-slower"
    better = "better"
    not_worse = "not-worse"
    no_folds = "no-folds"


class Validation(BaseModel):
    """The result of validating one algorithm."""

    model_config = ConfigDict(frozen=True, arbitrary_types_allowed=True)

    algorithm: str
    title: str
    target: str
    source: Printable
    parameters: dict[str, Any]
    #: Whether the algorithm promises maps that tend to conformal ones.
    conformal: bool = True
    command: Printable
    environment: str
    findings: tuple[ValidationFinding, ...]
    #: Stages that were not run, with the reason.
    skipped: dict[Stage, str] = {}
    #: The stages among them that were not asked for.
    not_asked_for: tuple[Stage, ...] = ()
    surfaces: tuple[str, ...] = ()
    folds_on: tuple[str, ...] = ()
    #: Surfaces without a map, and the cause.
    no_map_on: dict[str, str] = {}
    against: tuple[BaselineComparison, ...] = ()
    #: The comparisons of quality at each size of the scaling stage.
    at_sizes: tuple[BaselineComparison, ...] = ()
    #: None if the stage was not reached, or the algorithm was not timed on two sizes.
    growth: GrowthComparison | None = None
    #: Fewest and most triangles of the surfaces that each stage has maps of.
    looked_at: dict[Stage, tuple[int, int]] = {}
    #: Requirements that were asked for and are not met.
    unmet: tuple[Requirement, ...] = ()
    seconds: float = 0.0
    #: The map of the last stage of checks with the largest angle errors, for the page.
    worst: CheckedMap | None = Field(default=None, exclude=True, repr=False)

    @property
    def faults(self) -> tuple[ValidationFinding, ...]:
        """The findings that are not ok, in the order they were found."""
        return tuple(finding for finding in self.findings if not finding.ok)

    @property
    def valid(self) -> bool:
        """Whether there is no fault."""
        return not self.faults

    @property
    def passed(self) -> bool:
        """Whether the algorithm is valid and meets all requirements."""
        return self.valid and not self.unmet


def unmet(asked: Sequence[Requirement], validation: Validation) -> tuple[Requirement, ...]:
    """Return the requirements that are not met; without a baseline, comparisons are not."""
    return tuple(r for r in dict.fromkeys(asked) if not _meets(r, validation))


def sentences(validation: Validation) -> tuple[str, ...]:
    """Return the verdict as sentences: what was found, and on which sizes."""
    seen = (looked_at_sentence(validation.looked_at),) if validation.looked_at else ()
    return (f"{sentence(validation)}.", *seen)


def sentence(validation: Validation) -> str:
    """Return what was found, without a full stop."""
    if not validation.valid:
        return _invalid(validation.faults)
    parts = ["valid" if validation.conformal else "valid; not conformal, which it does not promise"]
    several = len(validation.against) > 1
    for against in validation.against:
        parts.append(_energy_words(against))
        if against.speed is not None:
            text = _speed_words(against.speed, against.title, named=several)
            if against.solve_time:
                text += f", in the solve time of the external program ({against.solve_time})"
            parts.append(text)
    if validation.growth is not None and validation.growth.answer is GrowthAnswer.inconclusive:
        parts.append("the growth of its seconds is inconclusive")
    if validation.folds_on:
        parts.append(f"folds on {_surfaces(validation.folds_on)}")
    if validation.no_map_on:
        parts.append(f"no map of {_surfaces(tuple(validation.no_map_on))}")
    if validation.unmet:
        parts.append(f"required and not met: {', '.join(validation.unmet)}")
    return "; ".join(parts)


def _invalid(faults: Sequence[ValidationFinding]) -> str:
    first, *others = faults
    if first.orders is not None:
        order, least = first.orders
        what = first.name.removesuffix(" under refinement")
        return (
            f"invalid: not conformal. Its {what} does not vanish under refinement (order "
            f"{order:.2f} on {first.surface}; a conformal map has {least:g} or more). If that is "
            "intended, declare conformal=False"
        )
    names = ", ".join(dict.fromkeys(fault.name for fault in others))
    return f"invalid: {first.name}: {first.measured}" + (f"; also: {names}" if names else "")


def _energy_words(against: BaselineComparison) -> str:
    compared, title = against.energy, against.title
    energy = against.energy_name
    if not compared.surfaces:
        return f"{energy} not compared with {title}: no surface that both map"
    of = counted(compared.surfaces, "surface")
    if compared.equal == compared.surfaces:
        text = f"{energy} equal to {title}'s within 1 % on {_all(compared.surfaces)}"
    elif compared.lower >= compared.higher:
        text = f"{energy} lower than {title} on {compared.lower} of {of}"
    else:
        text = f"{energy} higher than {title} on {compared.higher} of {of}"
    if 0 < compared.equal < compared.surfaces:
        other = min(compared.lower, compared.higher)
        side = "higher" if compared.lower >= compared.higher else "lower"
        text += f", equal within 1 % on {compared.equal}"
        text += f", {side} on {other}" if other else ""
    return f"{text} (median ratio {compared.ratio:.2f})"


def _times(ratio: float, unit: str) -> str:
    """Return a factor with one decimal digit, or two if one would print 1.0."""
    return f"{ratio:.{1 if ratio >= 1.15 else 2}f} times {unit}"


def _speed_words(speed: Comparison, title: str, *, named: bool) -> str:
    than = f" than {title}" if named else ""
    if speed.interval is None:
        return f"{speed.ratio:.2f} times {title}'s seconds, too few rounds for a verdict"
    if speed.verdict == "faster":
        return _times(1 / speed.ratio, f"faster{than}")
    if speed.verdict == "slower":
        return _times(speed.ratio, f"slower{than}")
    return f"neither faster nor slower than {title} for sure"


def _meets(requirement: Requirement, validation: Validation) -> bool:
    if requirement is Requirement.no_folds:
        return not validation.folds_on
    if requirement in (Requirement.better, Requirement.not_worse) and any(
        map(is_higher_at_last, _of_baselines(validation))
    ):
        return False
    return bool(validation.against) and all(
        _meets_against(requirement, against) for against in validation.against
    )


def _of_baselines(validation: Validation) -> list[BaselineComparison]:
    """Return the comparisons at several sizes with what was asked for, not with a reference."""
    asked = {against.baseline for against in validation.against}
    return [compared for compared in validation.at_sizes if compared.baseline in asked]


def _meets_against(requirement: Requirement, against: BaselineComparison) -> bool:
    """Whether it is met; never where the baseline alone has a map of a surface."""
    energy, speed = against.energy, against.speed
    if any(pair.energy is None and pair.baseline_energy is not None for pair in against.pairs):
        return False
    if requirement is Requirement.faster:
        return speed is not None and speed.verdict == "faster"
    if requirement is Requirement.not_slower:
        return speed is not None and speed.verdict in ("faster", "undecided")
    if energy.ratio is None:
        return False
    if requirement is Requirement.better:
        return energy.interval is not None and energy.interval.high < 1
    return (energy.interval.low if energy.interval else energy.ratio) <= 1


def _surfaces(names: Sequence[str]) -> str:
    return f"{counted(len(names), 'surface')}: {', '.join(names)}"


def _all(number: int) -> str:
    return "the 1 surface" if number == 1 else f"all {number} surfaces"
