"""How much faster is CEM? Fills README's table from the tables of kept reports.

python -m benchmarks.readme_speedups
python -m benchmarks.readme_speedups --report reports/paper --print

Averages have a 95 % interval over surfaces and rounds (hierarchical bootstrap, as in the report's
table of certainty) where most cells have the rounds for one.
"""

from __future__ import annotations

import argparse
import csv
import json
from collections import Counter
from pathlib import Path

from benchmarks.pages import ROOT, fill
from cembench.results.many import arithmetic, geometric, rate_interval

README = ROOT / "README.md"
#: A policy of solving, the table of its averages, and the kept report that README quotes.
POLICIES = {"reuse": "averages.csv", "backslash": "averages-backslash.csv"}
REPORTS = {"reuse": ROOT / "reports/standard", "backslash": ROOT / "reports/paper"}
#: The readings that are shown, by the beginning of their rows.
MEAN, GEOMETRIC = "mean rate (as the paper)", "geometric mean of ratios - 1"
AVERAGES = {MEAN: arithmetic, GEOMETRIC: geometric}


def averages(file: Path) -> dict[str, dict[str, str]]:
    """Read a table of averages, its rows by their reading."""
    return {row["reading"]: row for row in _rows(file)}


def ratios(records: Path, algorithm: str, policy: str) -> list[list[float]]:
    """Return t / t_CEM of each round, for every model of the paper once.

    A model that was measured itself counts, and not its stand-in; of a method with several sets of
    parameters the one that was measured on most surfaces.
    """
    there = [row for row in _rows(records) if row["solves"] == policy and row["status"] == "ok"]
    counts = Counter((row["algorithm"], row["parameters"]) for row in there)
    found: dict[tuple[str, str], dict[str, dict[str, str]]] = {}
    for row in sorted(there, key=lambda row: counts[row["algorithm"], row["parameters"]]):
        if row["paper_row"] and row["seconds"]:
            found.setdefault((row["paper_row"], row["origin"]), {})[row["algorithm"]] = row
    both = {
        model: _paired(by[algorithm], by["cem"])
        for (model, _), by in sorted(found.items(), key=lambda one: one[0][1] == "model")
        if algorithm in by and "cem" in by
    }
    return list(both.values())


def _paired(row: dict[str, str], base: dict[str, str]) -> list[float]:
    """Return the ratios of the rounds; older records hold the seconds alone."""
    if row.get("ratios"):
        return list(map(float, json.loads(row["ratios"])))
    ours, theirs = (json.loads(one["seconds_raw"]) for one in (row, base))
    return [a / b for a, b in zip(ours, theirs, strict=False)]


def interval(records: Path, algorithm: str, policy: str, reading: str) -> str:
    """Return the interval of an average in words; nothing where cells have too few rounds."""
    if not records.exists():
        return ""
    found = rate_interval(ratios(records, algorithm, policy), AVERAGES[reading])
    return f" ({found.low:.1f} to {found.high:.1f})" if found else ""


def table(report: Path | None = None) -> str:
    """Return README's table in Markdown, from the tables of kept reports and their records.

    Without a report each policy has the one that README quotes.
    """
    folders = {policy: report or kept for policy, kept in REPORTS.items()}
    there = {policy: folders[policy] / "tables" / file for policy, file in POLICIES.items()}
    found = {policy: averages(file) for policy, file in there.items() if file.exists()}
    if not found:
        raise SystemExit(f"{report}/tables holds no {' or '.join(POLICIES.values())}.")
    heads = [f"`{policy}`: mean | geometric" for policy in found]
    lines = [
        f"| CEM against | printed: mean | geometric | {' | '.join(heads)} |",
        "|---|" + "---:|" * (2 + 2 * len(found)),
    ]
    printed = next(iter(found.values()))
    for name in ("QIEM", "FDM", "LDM"):
        cells = [f"{float(printed[r][f'{name} printed, all']):.1f}" for r in (MEAN, GEOMETRIC)]
        for policy, rows in found.items():
            for reading in (MEAN, GEOMETRIC):
                told = f"{float(rows[reading][f'{name} here']):.1f}"
                records = folders[policy] / "records.csv"
                cells.append(told + interval(records, name.lower(), policy, reading))
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _rows(file: Path) -> list[dict[str, str]]:
    csv.field_size_limit(2**31 - 1)
    with file.open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))


def main() -> None:
    """Fill the page, or print its table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--report", type=Path, help="one report instead of those of README")
    parser.add_argument("--print", action="store_true", help="print the table, change nothing")
    chosen = parser.parse_args()
    text = table(chosen.report)
    if chosen.print:
        print(text)
    else:
        fill(README, Path(__file__).stem, text)


if __name__ == "__main__":
    main()
