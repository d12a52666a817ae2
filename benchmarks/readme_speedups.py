"""How much faster is CEM? Fills README's table from the tables of the kept report.

python -m benchmarks.readme_speedups
"""

from __future__ import annotations

import csv
from pathlib import Path

from benchmarks.pages import ROOT, fill

TABLES = ROOT / "reports/paper/tables"
README = ROOT / "README.md"
#: A policy of solving and the table of its averages.
POLICIES = {"reuse": "averages.csv", "backslash": "averages-backslash.csv"}
#: The readings that are shown, by the beginning of their rows.
MEAN, GEOMETRIC = "mean rate (as the paper)", "geometric mean of ratios - 1"


def averages(file: Path) -> dict[str, dict[str, str]]:
    """Read a table of averages, its rows by their reading."""
    with file.open(encoding="utf-8", newline="") as lines:
        return {row["reading"]: row for row in csv.DictReader(lines)}


def table(folder: Path = TABLES) -> str:
    """Return README's table in Markdown."""
    found = {policy: averages(folder / file) for policy, file in POLICIES.items()}
    heads = [f"`{policy}`: mean | geometric" for policy in found]
    lines = [
        f"| CEM against | printed: mean | geometric | {' | '.join(heads)} |",
        "|---|" + "---:|" * (2 + 2 * len(found)),
    ]
    printed = next(iter(found.values()))
    for name in ("QIEM", "FDM", "LDM"):
        columns = [printed[reading][f"{name} printed, all"] for reading in (MEAN, GEOMETRIC)]
        for rows in found.values():
            columns += [rows[reading][f"{name} here"] for reading in (MEAN, GEOMETRIC)]
        lines.append(f"| {name} | " + " | ".join(f"{float(c):.1f}" for c in columns) + " |")
    return "\n".join(lines)


if __name__ == "__main__":
    fill(README, "readme_speedups", table())
