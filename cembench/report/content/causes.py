"""Who fails where: surfaces by what makes them hard to map, with what a user can do about it.

The causes are declared in ``causes.toml``. A surface without any is in a group of its own, which
shows how much of what fails has another reason.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cache
from typing import TYPE_CHECKING

from cembench.report.content.evidence import ANGLE, DISK, Evidence, MeasuredSurface
from cembench.report.declarations import Declaration, own, parsed
from cembench.report.document import Table
from cembench.report.given_tables import given_table
from cembench.results.frame import evaluate

if TYPE_CHECKING:
    import pandas as pd

#: What a surface without a cause is called.
NONE = "none of these"


class Cause(Declaration):
    """What makes surfaces hard to map; `where` is an expression, true on such surfaces."""

    title: str
    where: str
    #: What a user can do about it.
    help: str


@cache
def causes() -> Mapping[str, Cause]:
    """Return the declared causes by name."""
    return parsed(own("causes.toml"), Cause, "causes.toml")


def with_causes(evidence: Evidence, frame: pd.DataFrame) -> pd.DataFrame:
    """Return rows of a run's frame with the causes that make their surfaces hard to map.

    The columns are those of :class:`~cembench.report.difficulty.Shape`, `boundary_crowding`,
    `causes` (lists of names, empty for none), `best_error` (the smallest mean angle error on the
    surface), `failing` (the algorithm's label in a list if it has no valid map) and `poor` (whether
    a map to the disk is valid, but much worse than the best).
    """
    import pandas as pd

    shapes = {key: asdict(one) for key, one in evidence.shapes.items()}
    crowding = {key: one.crowding for key, one in evidence.difficulties.items()}
    facts = pd.DataFrame.from_dict(shapes, orient="index", dtype=float)
    names = ["obtuse_share", "chord_share", "angle_defect", "boundary_excess"]
    described = frame.join(facts.reindex(columns=names), on="mesh_hash").copy()  # in one piece
    valid = described[ANGLE].where(described["ok"])
    described = described.assign(
        boundary_crowding=described["mesh_hash"].map(crowding).astype(float),
        best_error=valid.groupby(described["place"]).transform("min"),
        failing=[
            [] if ok else [label]
            for ok, label in zip(described["ok"], described["label"], strict=True)
        ],
        poor=described["ok"] & (described["target"] == DISK) & ~described["as_good"],
    )
    held = {name: evaluate(one.where, described).astype(bool) for name, one in causes().items()}
    return described.assign(
        causes=[[name for name in held if held[name].loc[row]] for row in described.index]
    )


def by_cause(evidence: Evidence, frame: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """Return the title of each cause and the rows of its surfaces, and at last those of none.

    A group has what helps in its column `help`.
    """
    described = with_causes(evidence, frame)
    groups = [
        (one.title, described[[name in row for row in described["causes"]]].assign(help=one.help))
        for name, one in causes().items()
    ]
    groups.append((NONE, described[[not row for row in described["causes"]]].assign(help="-")))
    return [(title, group) for title, group in groups if len(group)]


def worst_table(evidence: Evidence, surfaces: Sequence[MeasuredSurface]) -> Table:
    """Return the causes of surfaces, e.g. the hardest, and what a user can do about each."""
    frame = with_causes(evidence, evidence.frame)
    first = frame.drop_duplicates("mesh_hash").set_index("mesh_hash")
    rows = []
    for surface in surfaces:
        row = first.loc[surface.mesh_hash]
        chosen = [causes()[name] for name in row["causes"]]
        known = row["best_error"] == row["best_error"]
        rows.append(
            [
                *(surface.title, surface.family, surface.faces),
                row["best_error"] if known else None,
                ", ".join(one.title for one in chosen) or NONE,
                " ".join(one.help for one in chosen) or "-",
            ]
        )
    return given_table("worst-causes", rows, {"number": len(surfaces)})
