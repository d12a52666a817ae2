"""Does the harness say the same when it is asked again, and does it keep its error rate?

Runs a profile several times in a row, each run with CEM, another algorithm and a twin of both (the
same algorithm under another name, see ``twins.py``), and tells

- how far the speedup of CEM over the other algorithm (Eq. 33) spreads from run to run;
- how often an algorithm is called faster or slower than its twin: the stated rate is at most 5 %.

Stopped, it goes on where it was when called again. Needs a machine with nothing else to do::

    python benchmarks/repeatability.py
    python benchmarks/repeatability.py --runs 3 --surfaces flat-disk --faces 5000 --against lscm

After each run the tables of all so far are written to OUTPUT/repeatability.md, and what they hold
to OUTPUT/repeatability.json; the last are printed.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterable, Sequence
from math import comb
from pathlib import Path
from statistics import median
from time import monotonic
from typing import Any

from cembench.core.atomic import write_text
from cembench.results.comparison import circumstances, compare, references
from cembench.results.intervals import LEVEL
from cembench.results.records import DEFAULT_ROUNDS, Record
from cembench.results.store import Store

TWINS = Path(__file__).with_name("twins.py")


def main() -> None:
    """Run what is missing, then tell what all runs say."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--against", default="fdm", help="the other algorithm")
    parser.add_argument("--profile", default="quick")
    parser.add_argument("--surfaces", help="instead of a profile, as in `cembench run`")
    parser.add_argument("--faces", type=int)
    parser.add_argument("--repeats", type=int, default=DEFAULT_ROUNDS)
    parser.add_argument("-o", "--output", type=Path, default=Path("results/repeatability"))
    chosen = parser.parse_args()
    started, runs, text = monotonic(), [], ""
    for seed in range(chosen.runs):
        folder = chosen.output / f"run-{seed:02d}"
        run = subprocess.run(
            run_command(chosen, folder, seed), check=False, stdout=subprocess.DEVNULL
        )
        if run.returncode not in (0, 1):  # 1: a cell did not end ok, and is left out
            sys.exit(f"run {seed + 1} ended with code {run.returncode}")
        runs.append(Store(folder).records())
        summary = summarise(runs, chosen.against)
        text = tell(summary)
        write_text(chosen.output / "repeatability.md", text)
        write_text(chosen.output / "repeatability.json", json.dumps(summary, indent=1))
        minutes = (monotonic() - started) / 60
        left = minutes / len(runs) * (chosen.runs - len(runs))
        aa = summary["twins"]
        print(
            f"run {len(runs)} of {chosen.runs} done after {minutes:.1f} min, about {left:.0f} min "
            f"left; {aa['called_different']} of {aa['comparisons']} twins called different so far",
            file=sys.stderr,
        )
    print(text)


def run_command(chosen: argparse.Namespace, folder: Path, seed: int) -> list[str]:
    """The call of ``cembench run`` for one of the runs; it measures only what is missing."""
    both = ("cem", chosen.against)
    command = [
        sys.executable,
        "-m",
        "cembench.commands.cli",
        "run",
        "--plugin",
        str(TWINS),
        "--json",
    ]
    command += ["-a", ",".join([*both, *(f"{name}-twin" for name in both)])]
    command += ["--repeats", str(chosen.repeats), "--seed", str(seed), "-o", str(folder)]
    if chosen.surfaces:
        command += ["--surfaces", chosen.surfaces]
    else:
        command += ["--profile", chosen.profile]
    return command + (["--faces", str(chosen.faces)] if chosen.faces else [])


def summarise(runs: Sequence[Sequence[Record]], against: str) -> dict[str, Any]:
    """What do these runs say? Values that JSON can hold."""
    surfaces: dict[str, dict[str, Any]] = {}
    for records in runs:
        for record, base in pairs(records, against, "cem"):
            found = compare(record, base)
            if found:
                line = surfaces.setdefault(
                    record.cell.mesh,
                    {"faces": record.mesh.faces, "speedups": [], "intervals": []},
                )
                line["speedups"].append(found.speedup)
                i = found.speedup_interval
                line["intervals"].append(None if i is None else [i.low, i.high])
    for line in surfaces.values():
        line["median"] = median(line["speedups"])
        line["spread"] = (max(line["speedups"]) - min(line["speedups"])) / (1 + line["median"])
    return {
        "against": against,
        "runs": len(runs),
        "surfaces": dict(sorted(surfaces.items(), key=lambda item: item[1]["faces"])),
        "twins": twins_told_apart(runs, ("cem", against)),
    }


def twins_told_apart(runs: Sequence[Sequence[Record]], names: Iterable[str]) -> dict[str, Any]:
    """How often was an algorithm called different from its twin, and what if that were the rate?

    `chance_of_so_many` is the probability of as many wrong verdicts or more, were each made with
    the stated rate of 5 % independently of the others.
    """
    found = [
        comparison
        for records in runs
        for name in names
        for comparison in (compare(*pair) for pair in pairs(records, f"{name}-twin", name))
        if comparison is not None and comparison.interval is not None
    ]
    wrong = sum(one.verdict in ("faster", "slower") for one in found)
    n, rate = len(found), 1 - LEVEL
    return {
        "comparisons": n,
        "called_different": wrong,
        "stated_rate": rate,
        "chance_of_so_many": sum(
            comb(n, k) * rate**k * (1 - rate) ** (n - k) for k in range(wrong, n + 1)
        ),
        "ratios": [one.ratio for one in found],
    }


def tell(summary: dict[str, Any]) -> str:
    """The Markdown of a summary."""
    lines = [
        f"Speedup of CEM over {summary['against']} (Eq. 33) in {summary['runs']} runs:",
        "",
        "| surface | faces | median | smallest | largest | spread of t / t_CEM |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    for mesh, line in summary["surfaces"].items():
        found = line["speedups"]
        lines.append(
            f"| {mesh} | {line['faces']:,} | {line['median']:.2f} | {min(found):.2f} "
            f"| {max(found):.2f} | {line['spread']:.1%} |"
        )
    return "\n".join([*lines, "", tell_twins(summary["twins"]), ""])


def tell_twins(aa: dict[str, Any]) -> str:
    """The sentence about algorithms and their twins."""
    n, wrong = aa["comparisons"], aa["called_different"]
    if not n:
        return "No A/A comparison with six rounds or more."
    return (
        f"A/A: {wrong} of {n} comparisons of an algorithm with its twin ({wrong / n:.1%}) were "
        f"called different; the stated rate is at most {aa['stated_rate']:.0%} (at exactly that, "
        f"as many or more come with a probability of {aa['chance_of_so_many']:.2f}). The median "
        f"ratio of twins is {median(aa['ratios']):.4f}."
    )


def pairs(records: Sequence[Record], name: str, base: str) -> list[tuple[Record, Record]]:
    """The records of one algorithm, each with that of the other on the same surface."""
    known = references(records, base)
    chosen = [r for r in records if r.cell.algorithm == name]
    return [(r, known[circumstances(r.cell)]) for r in chosen if circumstances(r.cell) in known]


if __name__ == "__main__":
    main()
