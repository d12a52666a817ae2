"""Stage 4: growth of the seconds with the number of triangles."""

from __future__ import annotations

from collections.abc import Sequence
from math import log

from pydantic import BaseModel, ConfigDict

from cembench.core.errors import ParameterError
from cembench.results.records import Record
from cembench.validation.finding import ValidationFinding

#: Largest allowed exponent. Factoring the Laplacian of a planar mesh costs faces^1.5
#: in theory; 0.25 allows for iteration counts that grow with the mesh, and for clock noise.
MOST_EXPONENT = 1.75
#: Minimum triangles of the largest mesh.
LEAST_UP_TO = 900
#: Phase whose growth is shown too.
_FACTORISATION = "factorisation"


class Growth(BaseModel):
    """Seconds against triangles, and the exponent of growth between the two largest meshes.

    On smaller meshes constant costs hide the growth. Each round has its own exponent;
    `exponent` is that of the medians, `low` and `high` the smallest and largest of the rounds.
    """

    model_config = ConfigDict(frozen=True)

    what: str
    faces: tuple[int, ...]
    seconds: tuple[float, ...]
    exponent: float
    low: float
    high: float


def sizes(up_to: int) -> tuple[int, ...]:
    """Return three numbers of triangles, each three times the one before.

    Raises
    ------
    ParameterError
        `up_to` is so small that the start of a call dominates.

    """
    if up_to < LEAST_UP_TO:
        raise ParameterError(
            f"--up-to {up_to} is too few to fit an exponent; allowed are {LEAST_UP_TO:,} triangles "
            "and more, or 0 to leave that stage out."
        )
    return up_to // 9, up_to // 3, up_to


def growth(what: str, faces: Sequence[int], rounds: Sequence[Sequence[float]]) -> Growth:
    """Return the growth of seconds; `rounds` holds those of each round, smallest mesh first.

    Raises
    ------
    ValueError
        There are fewer than two sizes, or no round.

    """
    if len(faces) < 2 or not rounds:
        raise ValueError("an exponent needs two sizes and a round")
    middle = [sorted(size)[(len(size) - 1) // 2] for size in zip(*rounds, strict=True)]
    exponents = [_exponent(faces, seconds) for seconds in rounds]
    return Growth(
        what=what,
        faces=tuple(faces),
        seconds=tuple(middle),
        exponent=_exponent(faces, middle),
        low=min(exponents),
        high=max(exponents),
    )


def growths(records: Sequence[Record], ours: str, baseline: str | None) -> list[Growth]:
    """Return the growth of our seconds, the baseline's, and its factorisation, where known."""
    found = []
    for name in (ours, baseline):
        timed = [r for r in records if r.cell.algorithm == name and r.outcome.rounds]
        timed = sorted((r for r in timed if r.outcome.status == "ok"), key=lambda r: r.mesh.faces)
        if len(timed) < 2:
            continue
        faces = [r.mesh.faces for r in timed]
        rounds = list(zip(*(r.outcome.seconds for r in timed), strict=True))
        found.append(growth(timed[0].cell.algorithm, faces, rounds))
        factored = [
            tuple(k.phases.get(_FACTORISATION, 0.0) for k in r.outcome.rounds) for r in timed
        ]
        if name != ours and all(seconds > 0 for row in factored for seconds in row):
            what = f"{name}'s {_FACTORISATION}"
            found.append(growth(what, faces, list(zip(*factored, strict=True))))
    return found


def scales(ours: Growth | None, others: Sequence[Growth]) -> ValidationFinding:
    """Check our exponent against that of a sparse solver; `ours` is None for too few sizes.

    The smallest exponent of the rounds is judged, so a disturbance in one round is not a fault.
    """
    beside = ", ".join(f"{other.what} {other.exponent:.2f}" for other in others)
    measured = "it could not be timed on two sizes"
    if ours is not None:
        measured = f"seconds grow like faces^{ours.exponent:.2f}" + (beside and f" ({beside})")
        measured += f" from {ours.faces[-2]:,} to {ours.faces[-1]:,} triangles"
    return ValidationFinding(
        stage="scaling",
        name="growth of the seconds",
        ok=ours is not None and ours.low <= MOST_EXPONENT,
        measured=measured,
        allowed=f"an exponent of {MOST_EXPONENT:g} at most; factoring a planar Laplacian has 1.5",
        remedy="look for a loop over vertices within a loop over vertices, for dense matrices, "
        "and for iterations whose number grows with the mesh.",
    )


def _exponent(faces: Sequence[int], seconds: Sequence[float]) -> float:
    return log(seconds[-1] / seconds[-2]) / log(faces[-1] / faces[-2])
