"""How much faster is CEM, on the paper's models and on stand-ins? From a kept report's records."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import numpy as np

from benchmarks.pages import ROOT, Section, Table
from cembench.report.content.printed_tables import printed_rates
from cembench.results.families import enough_rounds, rate_interval
from cembench.results.multiple_testing import geometric
from cembench.results.papers import find_paper
from cembench.results.report_records import text_rows

#: The kept report that pages quote.
KEPT = ROOT / "reports/paper"
POLICIES = ("reuse", "backslash")
ORIGINS = {"model": "models", "stand-in": "stand-ins"}
#: The readings that are shown, and whether their intervals are of logarithms.
AVERAGES = ((np.mean, False), (geometric, True))
LAYOUT = """
| CEM against | on | printed for these: mean | geometric | `reuse`: mean | geometric \
| `backslash`: mean | geometric |
|---|---|---:|---:|---:|---:|---:|---:|
| {name} | {n} {on} | {printed[0]:.1f} | {printed[1]:.1f} | {reuse[0]} | {reuse[1]} \
| {backslash[0]} | {backslash[1]} |"""


def rates(
    report: Path, algorithm: str, policy: str, origin: str | None = None
) -> list[dict[str, str]]:
    """Return the records of an algorithm with its rates of speedup, for every model once.

    A model that was measured itself counts, and not its stand-in; of a method with several sets of
    parameters the one that was measured on most surfaces. Models without a printed rate have none.
    """
    paper = find_paper("cem")
    own = [
        row
        for row in text_rows(report)
        if (row["solves"], row["algorithm"]) == (policy, algorithm)
        and row["speedup"]
        and printed_rates(paper, algorithm, [row["paper_row"]])
    ]
    counts = Counter(row["parameters"] for row in own)
    own.sort(key=lambda row: (row["origin"] == "model", counts[row["parameters"]]))
    once = {row["paper_row"]: row for row in own}.values()
    return [row for row in once if origin in (None, row["origin"])]


def averages(rows: list[dict[str, str]]) -> list[str]:
    """Return both averages of rates, with intervals over models where most have the rounds."""
    ratios = [1 + float(row["speedup"]) for row in rows]
    enough = enough_rounds([len(json.loads(row["ratios"] or "[]")) for row in rows])
    texts = []
    for average, log in AVERAGES:
        rate = rate_interval(ratios, [row["family"] for row in rows], log=log) if enough else None
        between = f" ({rate.low:.1f} to {rate.high:.1f})" if rate else ""
        texts.append(f"{average(ratios) - 1:.1f}{between}" if ratios else "-")
    return texts


def cem_speedups(*, report: Path = KEPT) -> Section:
    """Tabulate how much faster CEM is on models and on stand-ins, from the records of a report.

    Averages have a 95 % interval over the models, those of one family together, where most cells
    have the rounds for one.
    """
    paper, rows = find_paper("cem"), []
    for name in paper.compared:
        for origin, on in ORIGINS.items():
            own = {policy: rates(report, name, policy, origin) for policy in POLICIES}
            models = [row["paper_row"] for row in max(own.values(), key=len)]
            printed = np.array(printed_rates(paper, name, models)) + 1
            if models:
                rows.append(
                    {
                        **{"name": name.upper(), "n": len(models), "on": on},
                        "printed": [average(printed) - 1 for average, _ in AVERAGES],
                        **{policy: averages(records) for policy, records in own.items()},
                    }
                )
    return Section([Table(rows, LAYOUT)], "docs/papers.md")
