"""Tables 1 to 4: the paper's figures beside measured ones, and tables of what is not in the paper.

The paper's four algorithms on its models are shown with the printed figures. Other algorithms that
map to the disk, and other surfaces, have separate tables.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cembench.report.content.averages import COMPARED, READINGS
from cembench.report.content.evidence import (
    ANGLE,
    DISK,
    REFERENCE,
    AlgorithmSeries,
    Evidence,
    MeasuredSurface,
)
from cembench.report.content.printed_beside_measured import (
    POLICIES,
    Footer,
    Quantity,
    absent_models,
    in_policy,
    policy_suffix,
    table_beside,
)
from cembench.report.document import Table
from cembench.results import paper
from cembench.results.columns import COLUMNS, FrameColumn


@dataclass(frozen=True)
class PrintedFigure:
    """A figure of each algorithm in a table of the paper.

    `column` names it in the frame, and `printed` in the paper's table, with the algorithm in
    braces. `heading` follows the algorithm's title. With `only`, one algorithm has it.
    """

    column: str
    printed: str = "{}"
    heading: str = ""
    digits: int = 2
    only: str = ""


@dataclass(frozen=True)
class PrintedTable:
    """A table of the paper: what it is about, and its figures."""

    number: int
    title: str
    caption: str
    figures: tuple[PrintedFigure, ...]
    #: Whether it depends on the linear-algebra policy; then each policy has one.
    by_policy: bool = False
    algorithms: tuple[str, ...] = paper.ALGORITHMS
    footers: tuple[Footer, ...] = ()
    notes: tuple[str, ...] = ()


PRINTED = (
    PrintedTable(
        1,
        "computational cost in seconds, and iterations of CEM",
        "Seconds from the arrays V and F in memory to the map: the median of the rounds here, and "
        "what the paper printed for MATLAB programs on a laptop of 2.60 GHz. Machines, languages "
        "and libraries differ, so compare only the ratios between algorithms, not printed with "
        "measured seconds.",
        (
            PrintedFigure("seconds"),
            PrintedFigure("iterations", "cem_iterations", "iterations", digits=0, only=REFERENCE),
        ),
        by_policy=True,
    ),
    PrintedTable(
        2,
        "rate of speedup of CEM",
        "t / t_CEM - 1 (Eq. 33): 0 for equal times, 1 if CEM takes half the time, negative if CEM "
        "is slower. Here it is the median of the ratios within rounds.",
        (PrintedFigure("rate"),),
        by_policy=True,
        algorithms=COMPARED,
        footers=READINGS,
        notes=(
            "averages of the printed column use its numbers as printed, including the misprint",
        ),
    ),
    PrintedTable(
        3,
        "conformal energy",
        "E_C = E_D - A (Eq. 7) is zero for a conformal map; A is the area enclosed by the image of "
        "the boundary (Eq. 8). It does not depend on the machine, but on the mesh: a stand-in has "
        "a different value than the paper's model.",
        (PrintedFigure("conformal_energy", digits=4),),
    ),
    PrintedTable(
        4,
        "angular distortion in degrees, mean and SD",
        "Angular distortion: the absolute difference between the angle on the surface and on the "
        "disk, in degrees, over all corners of all triangles. It depends on the mesh: a stand-in "
        "has a different value than the paper's model.",
        (
            PrintedFigure("angle_error_mean_deg", "{}_mean", "mean"),
            PrintedFigure("angle_error_sd_deg", "{}_sd", "SD"),
        ),
    ),
)


def printed_tables(evidence: Evidence, number: int) -> list[Table]:
    """Return the paper's table `number`, then other algorithms and other surfaces, if any."""
    table = next(table for table in PRINTED if table.number == number)
    policies = evidence.policies if table.by_policy else (None,)
    return [made for policy in policies for made in _tables(evidence, table, policy)]


def _tables(evidence: Evidence, table: PrintedTable, policy: str | None) -> list[Table]:
    tail = policy_suffix(policy, evidence) if policy else ""
    add = in_policy(evidence, policy) if policy else ""
    name = f"table-{table.number}{tail}"
    title = f"{table.title[0].upper()}{table.title[1:]}"
    disks = evidence.disk_series
    tables = []
    if evidence.models:
        own = [
            quantity
            for algorithm in table.algorithms
            for quantity in _quantities(
                evidence, table, evidence.series_of(algorithm), printed=algorithm
            )
        ]
        left_out = absent_models(evidence)
        here = f" Here {POLICIES.get(policy, policy)}." if policy else ""
        tables.append(
            table_beside(
                evidence, name, f"Table {table.number}: {table.title}{add}", evidence.models, own,
                policy=policy, caption=table.caption + here, footers=table.footers,
                notes=table.notes,
                absent=f"not in this run: {', '.join(left_out)}" if left_out else "",
            )
        )  # fmt: skip
        others = [s for s in disks if not (s.algorithm in paper.ALGORITHMS and s.main)]
        if more := [q for s in others for q in _quantities(evidence, table, s)]:
            tables.append(
                table_beside(
                    evidence, f"{name}-other-algorithms",
                    f"{title}: algorithms that are not in the paper{add}",
                    evidence.models, more, policy=policy, footers=table.footers,
                )
            )  # fmt: skip
    if evidence.others:
        shown = [
            s
            for s in disks
            if s.algorithm in table.algorithms or s.algorithm not in paper.ALGORITHMS
        ]
        tables.append(
            table_beside(
                evidence, f"{name}-other-surfaces",
                f"{title}: surfaces that are not in the paper{add}",
                evidence.others, [q for s in shown for q in _quantities(evidence, table, s)],
                policy=policy, footers=table.footers,
            )
        )  # fmt: skip
    return tables


def _quantities(
    evidence: Evidence, table: PrintedTable, series: AlgorithmSeries | None, printed: str = ""
) -> list[Quantity]:
    """Return the figures of a series; with `printed`, the algorithm's name, beside the paper's."""
    if series is not None and series.algorithm == REFERENCE and REFERENCE not in table.algorithms:
        return []
    title = series.label if series else printed.upper()
    return [
        Quantity(
            f"{title} {one.heading}".rstrip(),
            series,
            _figure(evidence, one.column),
            (table.number, one.printed.format(printed)) if printed else None,
            one.digits,
        )
        for one in table.figures
        if one.only in ("", printed)
    ]


def _figure(evidence: Evidence, name: str) -> FrameColumn:
    """Return a column of the frame, or the rate of speedup of CEM over the algorithm."""
    return FrameColumn("rate", evidence.rate, form=".2f") if name == "rate" else COLUMNS[name]


def own_table(evidence: Evidence) -> Table:
    """Return angle errors, E_C, seconds and folds of all algorithms, one row per surface."""
    policy = evidence.policies[0]
    return table_beside(
        evidence,
        "own-surfaces",
        f"All surfaces and algorithms{in_policy(evidence, policy)}",
        evidence.surfaces,
        [
            q
            for name, heading in _OWN.items()
            for q in _by_algorithm(evidence.series, name, heading, " *")
        ],
        policy=policy,
        notes=[
            f"* {s.label} does not map to the disk ({s.target}): its E_C is not comparable"
            for s in evidence.series
            if s.target != DISK
        ],
    )


def _by_algorithm(
    series: Sequence[AlgorithmSeries], name: str, heading: str, star: str = ""
) -> list[Quantity]:
    """Return a figure of each algorithm under one heading; `star` marks those not to the disk."""
    return [
        Quantity(heading, s, COLUMNS[name], title=s.label + star * (s.target != DISK))
        for s in series
    ]


#: The figures of a run over the user's own surfaces, with the headings of their groups.
_OWN = {
    ANGLE: "mean angle error, degrees",
    "conformal_energy": "E_C",
    "seconds": "seconds",
    "flipped_triangles": "folds",
}


def hardest_table(evidence: Evidence, policy: str, surfaces: Sequence[MeasuredSurface]) -> Table:
    """Return the mean angle error, or the status, by surface (rows) and algorithm (columns)."""
    frame = evidence.frame
    tried = set(frame[frame["solves"] == policy]["label"])
    series = [s for s in evidence.series if s.main and s.label in tried]
    return table_beside(
        evidence,
        "hardest",
        f"The {len(surfaces)} hardest surfaces",
        surfaces,
        _by_algorithm(series, ANGLE, "mean angle error, degrees"),
        policy=policy,
        caption="The surfaces whose best map has the largest angle errors (of maps to the disk "
        "where there are any); surfaces without a map come first.",
    )
