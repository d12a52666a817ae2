"""What of the paper holds on its own public models? From a kept report."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.cem_speedups import KEPT, POLICIES, rates
from benchmarks.pages import Section, Table
from cembench.report.content.claims import verdict_of
from cembench.report.document import FAILING
from cembench.results.papers import find_paper

#: Claims on maps that the table has besides speed, and what the report's test of them asks.
CLAIMS = {
    "CEM's maps have no folds.": " (before folds are repaired)",
    "FDM, LDM and CEM reach similar energies.": " (within 25 %)",
    "The angles of FDM and LDM are slightly better than CEM's.": " (by up to 25 %)",
}
#: The columns of the report's claims, that whose verdict counts first.
COLUMNS = ("on the models", "on stand-ins", "on other surfaces", "by the printed tables")
LAYOUT = """
| the paper says | printed | measured on its seven public models | |
|---|---:|---:|---|
| {claim} | {printed} | {here} | {verdict} |"""


def readme_answer(*, report: Path = KEPT) -> Section:
    """Tabulate what of the paper holds on the models of its own that are public."""
    claims = _rows(report, "claims-at-a-glance")
    table = Table([_faster(report), *_speeds(report), *_maps(claims)], LAYOUT)
    return Section([table, _verdicts(claims)], "README.md")


def _rows(report: Path, name: str) -> list[dict[str, str]]:
    with (report / f"tables/{name}.csv").open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))


def _verdicts(claims: list[dict[str, str]]) -> str:
    """Return how many claims hold, on models where they were tested there, and which do not."""
    decided = {
        claim["claim"].rstrip("."): next(v for c in COLUMNS if (v := claim[c]) != "-").split(",")[0]
        for claim in claims
    }
    counts = Counter(decided.values())
    failing = [claim for claim, verdict in decided.items() if verdict == FAILING]
    named = f" ({'; '.join(failing)})" if failing else ""
    return (
        f"Of all {len(claims)} claims, judged on these models where that is possible, "
        f"{counts['holds']} hold, {counts['holds in part']} hold in part, and {len(failing)} do "
        f"not{named}."
    )


def _faster(report: Path) -> dict[str, Any]:
    """Return on how many models CEM is faster, with kept factorisations and without."""
    compared = find_paper("cem").compared
    kept, anew = (
        [
            row["verdict"] == "slower"
            for name in compared
            for row in rates(report, name, one, "model")
        ]
        for one in POLICIES
    )
    here = f"{sum(kept)} of {len(kept)}; factored anew {sum(anew)} of {len(anew)}"
    verdict = verdict_of(sum(kept + anew), len(kept + anew))
    claim = "CEM is faster than QIEM, FDM and LDM"
    return {"claim": claim, "printed": "always", "here": here, "verdict": verdict}


def _speeds(report: Path) -> Iterator[dict[str, Any]]:
    """Yield the average rates of speedup with kept factorisations, from the head of the report."""
    kept = f" ({POLICIES[0]})"
    for row in _rows(report, "head"):
        if row["claim"].endswith(kept):
            models = next(cell for column, cell in row.items() if "models of the paper" in column)
            verdict, _, rate = models.partition(": ")
            here, _, printed = rate.partition(", printed ")
            claim = f"its {row['claim'].removesuffix(kept)}, t / t_CEM - 1"
            yield {"claim": claim, "printed": printed, "here": here, "verdict": verdict}


def _maps(claims: list[dict[str, str]]) -> Iterator[dict[str, Any]]:
    """Yield what is claimed of maps: folds, energies, and angles."""
    known = {claim["claim"]: claim for claim in claims}
    for name, asked in CLAIMS.items():
        verdict, here = _parted(known[name]["on the models"])
        _, printed = _parted(known[name]["by the printed tables"])
        claim = name.rstrip(".") + asked
        yield {"claim": claim, "printed": printed or "-", "here": here, "verdict": verdict}


def _parted(cell: str) -> tuple[str, str]:
    """Return a verdict, and how many tests it rests on."""
    verdict, _, counted = cell.partition(", ")
    return verdict, counted.partition(" (")[0]
