"""What of the paper holds on its own public models? From the records of a kept report."""

from __future__ import annotations

import csv
import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from benchmarks.cem_speedups import KEPT, rates
from benchmarks.pages import Section, Table
from cembench.report.content.printed_tables import MEAN_RATE, printed_rates
from cembench.results.families import enough_rounds, rate_interval
from cembench.results.papers import find_paper
from cembench.results.report_records import text_rows

#: Energies are similar if the largest is at most this many times the smallest.
SIMILAR = 1.25
LAYOUT = """
| the paper says | printed | measured on its seven public models | |
|---|---:|---:|---|
| {claim} | {printed} | {here} | {verdict} |"""


def readme_answer(*, report: Path = KEPT) -> Section:
    """Tabulate what of the paper holds on the models of its own that are public."""
    table = Table([*_speeds(report), *_maps(report)], LAYOUT)
    return Section([table, _verdicts(report)], "README.md")


def _verdicts(report: Path) -> str:
    """Return how many claims hold on the report's models, and which do not."""
    with (report / "tables/claims-at-a-glance.csv").open(encoding="utf-8", newline="") as lines:
        claims = list(csv.DictReader(lines))
    column = next(name for name in ("on the models", "verdict") if name in claims[0])
    verdicts = [claim[column].partition(",")[0] for claim in claims]
    counts = Counter(verdicts)
    failing = [
        claim["claim"].rstrip(".")
        for claim, verdict in zip(claims, verdicts, strict=True)
        if "not hold" in verdict
    ]
    named = f" ({'; '.join(failing)})" if failing else ""
    return (
        f"Of all {len(claims)} claims, over these models and the stand-ins, {counts['holds']} "
        f"hold, {counts['holds in part']} hold in part, and {len(failing)} do not{named}."
    )


def _speeds(report: Path) -> Iterator[dict[str, Any]]:
    """Yield whether CEM is faster, and its average rates of speedup with kept factorisations."""
    paper = find_paper("cem")
    known = {
        name: [row for row in rates(report, name, "reuse") if row["origin"] == "model"]
        for name in paper.compared
    }
    verdicts = [row["verdict"] for rows in known.values() for row in rows]
    won = verdicts.count("slower")
    yield _row("CEM is faster than QIEM, FDM and LDM", "always", f"{won} of {len(verdicts)}", won)
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


def _maps(report: Path) -> Iterator[dict[str, Any]]:
    """Yield what is claimed of maps: folds, energies, and angles."""
    rows = [row for row in text_rows(report) if row["solves"] == "reuse"]
    usual = Counter((row["algorithm"], row["parameters"]) for row in rows)
    rows.sort(key=lambda row: -usual[row["algorithm"], row["parameters"]])
    maps: dict[str, dict[str, dict[str, str]]] = {}
    for row in rows:
        if row["origin"] == "model":
            maps.setdefault(row["paper_row"], {}).setdefault(row["algorithm"], row)
    models = list(maps.values())
    n = len(models)
    flat = sum(own["cem"]["flipped_triangles"] == "0" for own in models)
    yield _row("CEM's maps have no folds", "none", f"{flat} of {n}", flat)
    energies = [
        [float(own[name]["conformal_energy"]) for name in ("fdm", "ldm", "cem")] for own in models
    ]
    alike = sum(max(own) <= SIMILAR * min(own) for own in energies)
    yield _row(
        "FDM, LDM and CEM reach similar energies (within 25 %)", "", f"{alike} of {n}", alike
    )
    means = [
        [float(own[name]["angle_error_mean_deg"]) for name in ("fdm", "ldm", "cem")]
        for own in models
    ]
    better = sum(max(own[:2]) <= own[2] <= SIMILAR * min(own[:2]) for own in means)
    claim = "the angles of FDM and LDM are slightly better than CEM's (by up to 25 %)"
    yield _row(claim, "", f"{better} of {n}", better)


def _row(claim: str, printed: str, here: str, held: int) -> dict[str, Any]:
    tested = int(here.rpartition(" ")[2])
    verdict = "holds" if held == tested else "in part" if held else "does not hold"
    return {"claim": claim, "printed": printed, "here": here, "verdict": verdict}
