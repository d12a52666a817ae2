"""How much faster is CEM? From the tables of a kept report."""

from __future__ import annotations

import csv
import json
from collections import Counter
from pathlib import Path

import numpy as np

from benchmarks.pages import ROOT, Section, Table
from cembench.results.families import rate_interval
from cembench.results.multiple_testing import geometric
from cembench.results.report_records import PACKED, RECORDS, text_rows

#: The kept report that README quotes.
KEPT = ROOT / "reports/paper"
#: A policy of solving, and the table of its averages.
POLICIES = {"reuse": "averages.csv", "backslash": "averages-backslash.csv"}
#: The readings that are shown, by the beginning of their rows.
MEAN, GEOMETRIC = "mean rate (as the paper)", "geometric mean of ratios - 1"
AVERAGES = {MEAN: np.mean, GEOMETRIC: geometric}


def averages(file: Path) -> dict[str, dict[str, str]]:
    """Read a table of averages, its rows by their reading."""
    return {row["reading"]: row for row in _rows(file)}


def ratios(report: Path, algorithm: str, policy: str) -> list[list[float]]:
    """Return t / t_CEM of each round, for every model of the paper once.

    A model that was measured itself counts, and not its stand-in; of a method with several sets of
    parameters the one that was measured on most surfaces.
    """
    there = [row for row in text_rows(report) if row["solves"] == policy and row["status"] == "ok"]
    counts = Counter((row["algorithm"], row["parameters"]) for row in there)
    rows: dict[tuple[str, str], dict[str, dict[str, str]]] = {}
    for row in sorted(there, key=lambda row: counts[row["algorithm"], row["parameters"]]):
        if row["paper_row"] and row["seconds"]:
            rows.setdefault((row["paper_row"], row["origin"]), {})[row["algorithm"]] = row
    both = {
        model: _paired(by[algorithm], by["cem"])
        for (model, _), by in sorted(rows.items(), key=lambda one: one[0][1] == "model")
        if algorithm in by and "cem" in by
    }
    return list(both.values())


def _paired(row: dict[str, str], base: dict[str, str]) -> list[float]:
    """Return the ratios of the rounds; older records hold the seconds alone."""
    if row.get("ratios"):
        return list(map(float, json.loads(row["ratios"])))
    ours, theirs = (json.loads(one["seconds_raw"]) for one in (row, base))
    return [a / b for a, b in zip(ours, theirs, strict=False)]


def interval(report: Path, algorithm: str, policy: str, reading: str) -> str:
    """Return the interval of an average in words; nothing where cells have too few rounds."""
    if not {PACKED, RECORDS} & {file.name for file in report.iterdir()}:
        return ""
    rate = rate_interval(ratios(report, algorithm, policy), log=reading == GEOMETRIC)
    return f" ({rate.low:.1f} to {rate.high:.1f})" if rate else ""


def readme_speedups(*, report: Path = KEPT) -> Section:
    """Tabulate how much faster CEM is, from the tables of a report and its records.

    Averages have a 95 % interval over the surfaces (Student's, as in the report's table of
    certainty) where most cells have the rounds for one.
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
    return Section([Table(rows, layout)], "README.md")


def _rows(file: Path) -> list[dict[str, str]]:
    csv.field_size_limit(2**31 - 1)
    with file.open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))
