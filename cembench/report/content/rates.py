"""The rates of speedup over the others in a paper's table, and their averages."""

from __future__ import annotations

from cembench.report.content.averages import READINGS, corrected_rate, printed_rates
from cembench.report.content.evidence import Evidence
from cembench.report.content.linear_algebra_work import work_of
from cembench.report.content.printed_beside_measured import (
    absent_models,
    geometric_mean,
    in_policy,
    policy_suffix,
)
from cembench.report.content.printed_tables import printed_table
from cembench.report.content.speedup_significance import sure_speedups
from cembench.report.document import Column, Table, Value, count, entry, missing, words
from cembench.results.papers import Paper


def rates_tables(evidence: Evidence, number: int) -> list[Table]:
    """Return the rates of speedup and their averages in both readings, for each policy."""
    found: list[Table] = []
    for policy in evidence.policies:
        found += printed_table(evidence, number, policy)
        found += [averages_table(evidence, number, policy)] if evidence.models else []
        found += sure_speedups(evidence, policy)
    return found


def averages_table(evidence: Evidence, number: int, policy: str) -> Table:
    """Return both readings of the averages: stated, printed for all or these models, measured."""
    columns = [Column("reading", numeric=False)]
    for algorithm in evidence.paper.compared:
        columns += [
            Column(heading, algorithm.upper())
            for heading in ("stated", "printed, all", "printed, these", "here")
        ]
    stated = {0: evidence.paper.stated.get("rate", {}), 2: evidence.paper.stated.get("saving", {})}
    rows = []
    sets = {a: _rate_sets(evidence, a, policy) for a in evidence.paper.compared}
    for k, reading in enumerate(READINGS):
        cells = [words(reading.label)]
        for algorithm in evidence.paper.compared:
            claim = stated.get(k, {}).get(algorithm)
            cells.append(
                entry(claim, reading.show, "the paper does not state it", origin="printed")
            )
            for rates in sets[algorithm]:
                mean = reading.of(rates) if rates else None
                cells.append(entry(mean, reading.show, "no rate to average"))
        rows.append(tuple(cells))
    if any(work_ratios(evidence, a, policy) for a in evidence.paper.compared):
        rows.append(_work_row(evidence, policy))
    counts = [words("n, models counted")]
    for algorithm in evidence.paper.compared:
        counts.append(words(""))
        counts += [count(len(r)) for r in sets[algorithm]]
    origins = sorted({s.origin for s in evidence.models})
    return Table(
        name=f"averages{policy_suffix(policy, evidence)}",
        title=f"Averages of Table {number}, in both readings{in_policy(evidence, policy)}",
        columns=tuple(columns),
        rows=(*rows, tuple(counts)),
        caption=(
            "In the mean of rates, single large ratios dominate; the geometric mean and the mean "
            "of the savings weight every model equally. 'Printed, these' are the printed rates of "
            "the models that were measured here too. Each model counts once: if it was measured "
            "itself, its stand-in is left out."
        ),
        notes=(
            *_replaced(evidence.paper, number),
            f"measured on: {', '.join(origins)}; {len(absent_models(evidence))} of the paper's "
            "models are not in this run",
        ),
        footer_rows=1,
    )


def _replaced(paper: Paper, number: int) -> list[str]:
    """Return a sentence for each misprint of the table, with what is taken instead."""
    return [
        f"the misprint ({model}, {algorithm.upper()}) is replaced by the {rate:.2f} that Table "
        f"{paper.table_of('seconds')} gives"
        for table, model, algorithm in paper.misprints
        if table == number and (rate := corrected_rate(paper, model, algorithm)) is not None
    ]


def _work_row(evidence: Evidence, policy: str) -> tuple[Value, ...]:
    """Return the row that no machine's speed is in: factorisations over CEM's."""
    cells = [words("factorisations over CEM's, geometric mean")]
    for algorithm in evidence.paper.compared:
        ratios = work_ratios(evidence, algorithm, policy)
        mean = geometric_mean(ratios) if ratios else None
        cells += [missing("the paper does not count them")] * 3
        cells.append(entry(mean, ".1f", "not counted"))
    return tuple(cells)


def work_ratios(evidence: Evidence, algorithm: str, policy: str) -> list[float]:
    """Return an algorithm's numeric factorisations over CEM's, of the models that count."""
    series, base = evidence.series_of(algorithm), evidence.series_of(evidence.reference)
    if series is None or base is None:
        return []
    work = [
        (work_of(evidence, surface, series, policy), work_of(evidence, surface, base, policy))
        for surface in evidence.one_per_model
    ]
    return [ours.numeric / theirs.numeric for ours, theirs in work if ours and theirs]


def _rate_sets(evidence: Evidence, algorithm: str, policy: str) -> tuple[list[float], ...]:
    """Return the rates printed for all models, printed for those measured, and measured."""
    measured, paper = measured_rates(evidence, algorithm, policy), evidence.paper
    these = printed_rates(paper, algorithm, list(measured))
    return printed_rates(paper, algorithm), these, list(measured.values())


def measured_rates(evidence: Evidence, algorithm: str, policy: str) -> dict[str, float]:
    """Return the rates of speedup over an algorithm by model, those of one surface for each."""
    series = evidence.series_of(algorithm)
    records = {
        surface.paper_row: evidence.find(surface, series, policy) if series else None
        for surface in evidence.one_per_model
    }
    rates = {model: evidence.rate(record) if record else None for model, record in records.items()}
    return {model: rate for model, rate in rates.items() if rate is not None}
