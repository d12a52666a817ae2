"""What of the paper holds on its own public models? From the records of a kept report."""

from __future__ import annotations

import csv
import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.cem_speedups import KEPT, POLICIES, rates
from benchmarks.pages import Section, Table
from cembench.report.content.printed_tables import MEAN_RATE, printed_rates
from cembench.results.families import enough_rounds, rate_interval
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
    with (report / "tables/claims-at-a-glance.csv").open(encoding="utf-8", newline="") as lines:
        claims = list(csv.DictReader(lines))
    table = Table([*_speeds(report), *_maps(claims)], LAYOUT)
    return Section([table, _verdicts(claims)], "README.md")


def _verdicts(claims: list[dict[str, str]]) -> str:
    """Return how many claims hold, on models where they were tested there, and which do not."""
    decided = {
        claim["claim"].rstrip("."): next(v for c in COLUMNS if (v := claim[c]) != "-").split(",")[0]
        for claim in claims
    }
    counts = Counter(decided.values())
    failing = [claim for claim, verdict in decided.items() if "not hold" in verdict]
    named = f" ({'; '.join(failing)})" if failing else ""
    return (
        f"Of all {len(claims)} claims, on these models where they could be tested there, "
        f"{counts['holds']} hold, {counts['holds in part']} hold in part, and {len(failing)} do "
        f"not{named}."
    )


def _speeds(report: Path) -> Iterator[dict[str, Any]]:
    """Yield whether CEM is faster, and its average rates of speedup with kept factorisations."""
    paper = find_paper("cem")
    known = {
        name: [row for row in rates(report, name, "reuse") if row["origin"] == "model"]
        for name in paper.compared
    }
    kept, anew = (
        [row["verdict"] for name in known for row in rates(report, name, policy, "model")]
        for policy in POLICIES
    )
    won = [verdicts.count("slower") for verdicts in (kept, anew)]
    here = f"{won[0]} of {len(kept)}; factored anew {won[1]} of {len(anew)}"
    verdict = "holds" if sum(won) == len(kept + anew) else "holds in part"
    claim = "CEM is faster than QIEM, FDM and LDM"
    yield {"claim": claim, "printed": "always", "here": here, "verdict": verdict}
    for name, rows in known.items():
        printed = MEAN_RATE.of(printed_rates(paper, name, [row["paper_row"] for row in rows]))
        speedups = [float(row["speedup"]) for row in rows]
        enough = enough_rounds([len(json.loads(row["ratios"] or "[]")) for row in rows])
        ratios, families = [1 + one for one in speedups], [row["family"] for row in rows]
        interval = rate_interval(ratios, families, log=False) if enough else None
        text, verdict = f"{MEAN_RATE.of(speedups):.1f}", "too few rounds"
        if interval:
            text += f" ({interval.low:.1f} to {interval.high:.1f})"
            more, less = interval.low > printed, interval.high < printed
            verdict = "more" if more else "less" if less else "as printed"
        claim = f"its average speedup over {name.upper()}, t / t_CEM - 1"
        yield {"claim": claim, "printed": f"{printed:.1f}", "here": text, "verdict": verdict}


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
