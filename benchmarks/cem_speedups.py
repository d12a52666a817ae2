"""How much faster is CEM? From the tables of a kept report."""

from __future__ import annotations

import csv
import json
from collections import Counter
from pathlib import Path

import numpy as np

from benchmarks.pages import ROOT, Section, Table
from cembench.results.families import enough_rounds, rate_interval
from cembench.results.multiple_testing import geometric
from cembench.results.report_records import PACKED, RECORDS, text_rows

#: The kept report that pages quote.
KEPT = ROOT / "reports/paper"
#: A policy of solving, and the table of its averages.
POLICIES = {"reuse": "averages.csv", "backslash": "averages-backslash.csv"}
#: The readings that are shown, by the beginning of their rows.
MEAN, GEOMETRIC = "mean rate (as the paper)", "geometric mean of ratios - 1"
AVERAGES = {MEAN: np.mean, GEOMETRIC: geometric}


def averages(file: Path) -> dict[str, dict[str, str]]:
    """Read a table of averages, its rows by their reading."""
    return {row["reading"]: row for row in _rows(file)}


def rates(report: Path, algorithm: str, policy: str) -> list[dict[str, str]]:
    """Return the records of an algorithm with its rates of speedup, for every model once.

    A model that was measured itself counts, and not its stand-in; of a method with several sets of
    parameters the one that was measured on most surfaces.
    """
    own = [
        row
        for row in text_rows(report)
        if (row["solves"], row["algorithm"]) == (policy, algorithm)
        and row["paper_row"]
        and row["speedup"]
    ]
    counts = Counter(row["parameters"] for row in own)
    own.sort(key=lambda row: (row["origin"] == "model", counts[row["parameters"]]))
    return list({row["paper_row"]: row for row in own}.values())


def interval(report: Path, algorithm: str, policy: str, reading: str) -> str:
    """Return the interval of an average in words; nothing where cells have too few rounds."""
    if not {PACKED, RECORDS} & {file.name for file in report.iterdir()}:
        return ""
    rows = rates(report, algorithm, policy)
    if not enough_rounds([len(json.loads(row["ratios"] or "[]")) for row in rows]):
        return ""
    ratios = [1 + float(row["speedup"]) for row in rows]
    rate = rate_interval(ratios, [row["family"] for row in rows], log=reading == GEOMETRIC)
    return f" ({rate.low:.1f} to {rate.high:.1f})" if rate else ""


def cem_speedups(*, report: Path = KEPT) -> Section:
    """Tabulate how much faster CEM is, from the tables of a report and its records.

    Averages have a 95 % interval over the models, those of one family together, where most cells
    have the rounds for one.
    """
    files = {policy: report / "tables" / file for policy, file in POLICIES.items()}
    by_policy = {policy: averages(file) for policy, file in files.items() if file.exists()}
    if not by_policy:
        raise SystemExit(f"{report}/tables holds no {' or '.join(POLICIES.values())}.")
    heads = [f"`{policy}`: mean | geometric" for policy in by_policy]
    columns = " | ".join(f"{{{policy}[0]}} | {{{policy}[1]}}" for policy in by_policy)
    layout = f"""
| CEM against | printed: mean | geometric | {" | ".join(heads)} |
|---|{"---:|" * (2 + 2 * len(heads))}
| {{name}} | {{printed[0]:.1f}} | {{printed[1]:.1f}} | {columns} |"""
    first = next(iter(by_policy.values()))
    rows = [
        {
            "name": name,
            "printed": [float(first[reading][f"{name} printed, all"]) for reading in AVERAGES],
            **{
                policy: [
                    f"{float(averages[reading][f'{name} here']):.1f}"
                    + interval(report, name.lower(), policy, reading)
                    for reading in AVERAGES
                ]
                for policy, averages in by_policy.items()
            },
        }
        for name in ("QIEM", "FDM", "LDM")
    ]
    return Section([Table(rows, layout)], "docs/papers.md")


def _rows(file: Path) -> list[dict[str, str]]:
    csv.field_size_limit(2**31 - 1)
    with file.open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))
