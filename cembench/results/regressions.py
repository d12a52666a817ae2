"""What became worse from one run or version to another: seconds, maps, validity."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

from cembench.core.errors import ParameterError, RecordError
from cembench.core.names import unknown
from cembench.results.columns import is_free
from cembench.results.multiple_testing import corrected
from cembench.results.runs_compared import Change, Row

#: Statuses of a valid map; with the lower one its seconds cannot be compared.
VALID = {"ok": 2, "not_comparable": 1}
#: Ratios this close to 1 are ties.
TIE = 0.01
#: Energies below this share of the image's area are rounding, and count as equal.
NO_ENERGY = 1e-9
#: Smaller mean angle errors, in degrees, count as this: their ratios are of rounding.
NO_ANGLE = 0.01

#: "slower": the verdict, corrected for all comparisons. "worse": a larger energy or mean angle
#: error, by more than :data:`TIE`, or more folds. "invalid": no valid map where there was one.
#: Where seconds cannot be compared any more, "invalid" stands for that too; without it, "slower".
FailOn = Literal["slower", "worse", "invalid"]


@dataclass(frozen=True)
class Regression:
    """Something that became worse."""

    kind: FailOn
    algorithm: str
    surface: str
    detail: str

    def __str__(self) -> str:
        return f"{self.kind}: {self.algorithm} on {self.surface}: {self.detail}"


def check_kinds(kinds: Iterable[str]) -> None:
    """Raise :class:`ParameterError` unless all are kinds of regressions."""
    known = get_args(FailOn)
    for kind in kinds:
        if kind not in known:
            raise ParameterError(f"fail_on: {unknown('kind of regression', kind, known)}")


def figures_of(row: Row, other: Row) -> dict[str, float]:
    """Return the figures of a map that :func:`regressions` compares; none without a valid map.

    The energy is that in the common gauge if both rows have it, else over the image's area where
    the image has no size of its own.
    """
    if row["status"] not in VALID:
        return {}
    energy, angle, folds = (
        row.get(name) for name in ("conformal_energy", "angle_error_mean_deg", "flipped_triangles")
    )
    if all(one.get("common_gauge_energy") is not None for one in (row, other)):
        energy = row["common_gauge_energy"]
    elif energy is not None and is_free(row["target"]):
        energy = energy / row["image_area"] if row.get("image_area") else None
    found = {"E_C": energy, "mean angle error": angle, "folds": folds}
    return {name: value for name, value in found.items() if value is not None}


def regressions(
    pairs: Iterable[tuple[Row, Row]], changes: Sequence[Change], kinds: Iterable[str]
) -> list[Regression]:
    """Return what became worse, of these kinds.

    Raises
    ------
    ParameterError
        A kind is unknown.
    RecordError
        There was no valid map before; or "slower" cannot be decided by the rounds there are.
    """
    check_kinds(kinds := list(kinds))
    pairs = list(pairs)
    if kinds and not any(before["status"] in VALID for before, _ in pairs):
        raise RecordError(
            "the earlier one has no valid map to compare with; `cembench status RUN` shows why."
        )
    found = [
        Regression("slower", change.after["algorithm"], change.after["mesh"], f"{one.ratio:.2f}x")
        for change, one in zip(changes, corrected([c.comparison for c in changes]), strict=True)
        if one.verdict == "slower"
    ]
    for before, after in pairs:
        place = after["algorithm"], after["mesh"]
        if VALID.get(after["status"], 0) < VALID.get(before["status"], 0):
            why = ": ".join(filter(None, (after["status"], after.get("cause"))))
            seconds = after["status"] in VALID and "invalid" not in kinds
            found.append(Regression("slower" if seconds else "invalid", *place, why))
        found += [Regression("worse", *place, why) for why in _worse(before, after)]
    found = [one for one in found if one.kind in kinds]
    if "slower" in kinds and not found and not any(c.comparison.interval for c in changes):
        raise RecordError(
            "whether it is slower is unknown: too few rounds timed both. Ask for --rounds 12."
        )
    return found


def _worse(before: Row, after: Row) -> Iterable[str]:
    old, new = figures_of(before, after), figures_of(after, before)
    least: Mapping[str, Any] = {"E_C": NO_ENERGY, "mean angle error": NO_ANGLE, "folds": 0}
    for name in old.keys() & new.keys():
        tie = 0 if name == "folds" else TIE
        if max(new[name], least[name]) > (1 + tie) * max(old[name], least[name]):
            yield f"{name} {old[name]:.6g} -> {new[name]:.6g}"
