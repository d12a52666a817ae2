"""A paper's tables: printed figures beside measured ones, rates of speedup and their averages.

The paper's algorithms on its models are shown with the printed figures. Other algorithms that map
to the disk, and other surfaces, have separate tables. A rate of speedup is t / t_reference - 1. A
paper may average rates arithmetically, where one large ratio counts as much as many small ones, and
convert that mean to a saving; the geometric mean of the ratios and the mean of the savings weight
every model equally.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from cembench.report.by_surface import (
    MEAN_RATIO,
    POLICIES,
    Footer,
    Quantity,
    in_policy,
    policy_suffix,
    table_beside,
)
from cembench.report.content.evidence import AlgorithmSeries, Evidence
from cembench.report.content.policies import sure_speedups
from cembench.report.document import Table, entry, missing, words
from cembench.report.given_tables import given_table
from cembench.results.columns import COLUMNS, FrameColumn, worded
from cembench.results.expressions import with_words
from cembench.results.papers import Paper
from cembench.results.records import MeshOrigin

if TYPE_CHECKING:
    import pandas as pd

#: The readings of an average of rates, the paper's own first and third.
READINGS = (
    Footer(label="mean rate (as the paper)", value="mean(x)", form=".1f"),
    Footer(label="geometric mean of ratios - 1", value="geometric(1 + x) - 1", form=".1f"),
    Footer(label="saving, 1 - 1/(1 + mean)", value="1 - 1 / (1 + mean(x))", form="percent"),
    Footer(label="mean of the savings", value="mean(1 - 1 / (1 + x))", form="percent"),
)
MEAN_RATE = READINGS[0]
#: The origins of surfaces that are averaged apart, the models first.
ON: Mapping[MeshOrigin, str] = {
    "model": "on the paper's models",
    "stand-in": "on stand-ins for its models",
}


def printed_tables(evidence: Evidence, number: int) -> list[Table]:
    """Return the paper's table `number`, then other algorithms and other surfaces, if any.

    One that compares algorithms has averages and their certainty, for each policy.
    """
    table, made = evidence.paper.printed[number], []
    for policy in evidence.policies if table.by_policy or table.compares else (None,):
        made += _printed_table(evidence, number, policy)
        if table.compares and policy:
            here = {surface.origin for surface in evidence.one_per_model}
            origins = [origin for origin in ON if origin in here]
            made += [averages_table(evidence, number, policy, one) for one in origins]
            made += sure_speedups(evidence, policy)
    return made


def _printed_table(evidence: Evidence, number: int, policy: str | None) -> list[Table]:
    """Return the same under one policy, or None for a table that has none."""
    paper, disks = evidence.paper, evidence.disk_series
    table = paper.printed[number]
    add = in_policy(evidence, policy) if policy else ""
    name = f"table-{number}{policy_suffix(policy, evidence) if policy else ''}"
    title = f"{table.title[0].upper()}{table.title[1:]}"
    shown = paper.compared if table.compares else paper.algorithms
    footers = READINGS if table.compares else ()
    tables = []
    if evidence.models and table.figures:
        own = [q for a in shown for q in _quantities(evidence, number, evidence.series_of(a), a)]
        absent = ", ".join(absent_models(evidence))
        measured_as = f" Here {POLICIES.get(policy, policy)}." if policy else ""
        tables.append(
            table_beside(
                evidence, name, f"Table {number}: {table.title}{add}", evidence.models, own,
                policy=policy, caption=table.caption + measured_as, footers=footers,
                notes=(*table.notes, *(f"printed at {place}" for place in table.sources)),
                absent=f"not in this run: {absent}" if absent else "",
            )
        )  # fmt: skip
    others = [s for s in disks if not (s.algorithm in paper.algorithms and s.main)]
    left_out = set(paper.algorithms) - set(shown)
    rest = [s for s in disks if s.algorithm not in left_out]
    for what, surfaces, series in (
        ("algorithms", evidence.models, others),
        ("surfaces", evidence.others, rest),
    ):
        quantities = [q for s in series for q in _quantities(evidence, number, s)]
        surfaces = tuple(one for one in surfaces if any(evidence.find(one, s) for s in series))
        if table.figures and surfaces and (quantities or what == "surfaces"):
            of = f"{title}: {what} that are not in the paper{add}"
            at = f"{name}-other-{what}"
            tables.append(
                table_beside(evidence, at, of, surfaces, quantities, policy=policy, footers=footers)
            )
    return tables


def _quantities(
    evidence: Evidence, number: int, series: AlgorithmSeries | None, printed: str = ""
) -> list[Quantity]:
    """Return the figures of a series; with `printed`, the algorithm's name, beside the paper's."""
    table = evidence.paper.printed[number]
    if series is not None and table.compares and series.algorithm == evidence.paper.reference:
        return []
    title = series.label if series else printed.upper()
    figures = {**COLUMNS, "rate": FrameColumn("rate", evidence.rate, form=".2f")}
    return [
        Quantity(
            f"{title} {one.heading}".rstrip(),
            series,
            figures[one.column],
            (number, with_words(one.printed, printed), one.digits) if printed else None,
        )
        for one in table.figures
        if one.only in ("", printed)
    ]


def absent_models(evidence: Evidence) -> list[str]:
    """Return the models of the paper without a surface in the run."""
    there = {s.paper_row for s in evidence.models}
    return [model for model in evidence.paper.models if model not in there]


def averages_table(evidence: Evidence, number: int, policy: str, origin: MeshOrigin) -> Table:
    """Return both readings of the averages on surfaces of an origin.

    Stated, printed for all models or for these, measured.
    """
    paper = evidence.paper
    stated = {0: paper.stated.get("rate", {}), 2: paper.stated.get("saving", {})}
    rows, counts, work = [], [words("n, models counted")], []
    sets = {}
    for a in paper.compared:
        measured = measured_rates(evidence, a, policy, origin)
        in_print = [printed_rates(paper, a, models) for models in (None, list(measured))]
        sets[a] = (*in_print, [*measured.values()])
        counts += [words(""), *(entry(len(rates), "d", "") for rates in sets[a])]
        work.append(work_ratios(evidence, a, policy, origin))
    for k, reading in enumerate(READINGS):
        cells = [words(reading.label)]
        for a in paper.compared:
            claim, unstated = stated.get(k, {}).get(a), "the paper does not state it"
            form = partial(worded, form=reading.form)
            cells.append(entry(claim, form, unstated, origin="printed"))
            cells += [reading.entry(rates, "no rate to average") for rates in sets[a]]
        rows.append(tuple(cells))
    if any(work):  # the row that no machine's speed is in
        cells = [words(f"factorisations over {evidence.reference_label}'s, geometric mean")]
        tenths = MEAN_RATIO.model_copy(update={"form": ".1f"})
        for ratios in work:
            cells += [missing("the paper does not count them")] * 3
            cells.append(tenths.entry(ratios, "not counted"))
        rows.append(tuple(cells))
    replaced = (
        f"the misprint ({model}, {algorithm.upper()}) is replaced by the {rate:.2f} that Table "
        f"{paper.table_of('seconds')} gives"
        for table, model, algorithm in paper.misprints
        if table == number and (rate := corrected_rate(paper, model, algorithm)) is not None
    )
    absent = f"{len(absent_models(evidence))} of the paper's models are not in this run"
    known = {"number": number, "on": ON[origin], "in_policy": in_policy(evidence, policy)}
    table = given_table(
        *("averages", (*rows, counts), known),
        called=f"averages-on-{origin}s{policy_suffix(policy, evidence)}",
        each={"algorithms": [a.upper() for a in paper.compared]},
        notes=(*replaced, absent),
    )
    return replace(table, footer_rows=1)


def printed_rates(paper: Paper, algorithm: str, models: Sequence[str] | None = None) -> list[float]:
    """Return the printed rates for these models (default: all), misprints from the seconds."""
    chosen = paper.models if models is None else models
    rates = (corrected_rate(paper, model, algorithm) for model in chosen)
    return [rate for rate in rates if rate is not None]


def corrected_rate(paper: Paper, model: str, algorithm: str) -> float | None:
    """Return a printed rate, or for a misprint the one that follows from the printed seconds."""
    rates, seconds = paper.table_of("rate"), paper.table_of("seconds")
    if rates is not None and (rates, model, algorithm) not in paper.misprints:
        return paper.tables[rates].get(model, {}).get(algorithm)
    times = paper.tables[seconds].get(model, {}) if seconds is not None else {}
    ours, theirs = times.get(paper.reference), times.get(algorithm)
    return None if ours is None or theirs is None else theirs / ours - 1


def measured_rates(
    evidence: Evidence, algorithm: str, policy: str, origin: MeshOrigin
) -> dict[str, float]:
    """Return the rates of speedup over an algorithm on surfaces of an origin, by model."""
    known = measured(evidence, algorithm, policy).dropna(subset="speedup")
    known = known[known["origin"] == origin]
    return dict(zip(known["model"], known["speedup"], strict=True))


def measured(evidence: Evidence, algorithm: str, policy: str) -> pd.DataFrame:
    """Return the records of an algorithm on one surface for each model with a printed rate."""
    frame, paper = evidence.frame, evidence.paper
    rows = frame[frame["counted"] & frame["main"] & (frame["algorithm"] == algorithm)]
    in_print = [m for m in paper.models if corrected_rate(paper, m, algorithm) is not None]
    return rows[(rows["solves"] == policy) & rows["model"].isin(in_print)]


def work_ratios(evidence: Evidence, algorithm: str, policy: str, origin: MeshOrigin) -> list[float]:
    """Return an algorithm's numeric factorisations over CEM's, of the models that count."""
    frame = evidence.frame
    rows = frame[frame["counted"] & frame["main"] & (frame["solves"] == policy)]
    rows = rows[rows["origin"] == origin]
    work = rows.pivot(index="place", columns="algorithm", values="counted_factorisations")
    if not {algorithm, evidence.reference} <= set(work):
        return []
    ratios: list[float] = (work[algorithm] / work[evidence.reference]).dropna().tolist()
    return ratios
