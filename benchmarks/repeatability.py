"""Does the harness say the same when it is asked again, and does it keep its error rate?

Runs a profile several times in a row, each run with CEM, another algorithm and a twin of both (the
same algorithm under another name, see ``twins.py``), and tells

- how far the speedup of CEM over the other algorithm (Eq. 33) spreads from run to run;
- how often an algorithm is called faster or slower than its twin: the stated rate is at most 5 %.

Stopped, it goes on where it was when called again. Needs a machine with nothing else to do::

    python benchmarks/repeatability.py
    python benchmarks/repeatability.py --runs 3 --surfaces flat-disk --faces 5000 --against lscm

The table is printed, and written to OUTPUT/repeatability.md.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from statistics import median

from cembench.atomic import write
from cembench.comparison import circumstances, compare, references
from cembench.intervals import LEVEL
from cembench.records import DEFAULT_ROUNDS, Record
from cembench.store import Store

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
    folders = [chosen.output / f"run-{k:02d}" for k in range(chosen.runs)]
    for seed, folder in enumerate(folders):
        subprocess.run(run_command(chosen, folder, seed), check=False, stdout=subprocess.DEVNULL)
    text = tell([Store(folder).records() for folder in folders], chosen.against)
    write(chosen.output / "repeatability.md", lambda file: file.write(text.encode()))
    print(text)


def run_command(chosen: argparse.Namespace, folder: Path, seed: int) -> list[str]:
    """The call of ``cembench run`` for one of the runs; it measures only what is missing."""
    both = ("cem", chosen.against)
    command = [sys.executable, "-m", "cembench.cli", "run", "--plugin", str(TWINS), "--json"]
    command += ["-a", ",".join([*both, *(f"{name}-twin" for name in both)])]
    command += ["--repeats", str(chosen.repeats), "--seed", str(seed), "-o", str(folder)]
    if chosen.surfaces:
        command += ["--surfaces", chosen.surfaces]
    else:
        command += ["--profile", chosen.profile]
    return command + (["--faces", str(chosen.faces)] if chosen.faces else [])


def tell(runs: Sequence[Sequence[Record]], against: str) -> str:
    """The Markdown of what these runs say."""
    speedups = defaultdict(list)
    faces = {}
    for records in runs:
        for record, base in pairs(records, against, "cem"):
            found = compare(record, base)
            if found:
                speedups[record.cell.mesh].append(found.speedup)
                faces[record.cell.mesh] = record.mesh.faces
    lines = [
        f"Speedup of CEM over {against} (Eq. 33) in {len(runs)} runs:",
        "",
        "| surface | faces | median | smallest | largest | spread of t / t_CEM |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    for mesh in sorted(speedups, key=lambda mesh: faces[mesh]):
        low, high = min(speedups[mesh]), max(speedups[mesh])
        lines.append(
            f"| {mesh} | {faces[mesh]:,} | {median(speedups[mesh]):.2f} | {low:.2f} | {high:.2f} "
            f"| {(high - low) / (1 + median(speedups[mesh])):.1%} |"
        )
    lines += ["", *tell_twins(runs, ("cem", against)), ""]
    return "\n".join(lines)


def tell_twins(runs: Sequence[Sequence[Record]], names: Iterable[str]) -> list[str]:
    """How often was an algorithm told apart from its twin?"""
    verdicts = [
        found.verdict
        for records in runs
        for name in names
        for found in (compare(*pair) for pair in pairs(records, f"{name}-twin", name))
        if found is not None and found.interval is not None
    ]
    wrong = sum(verdict in ("faster", "slower") for verdict in verdicts)
    if not verdicts:
        return ["No A/A comparison with six rounds or more."]
    return [
        f"A/A: {wrong} of {len(verdicts)} comparisons of an algorithm with its twin "
        f"({wrong / len(verdicts):.1%}) were called different; at most {1 - LEVEL:.0%} are to be "
        "expected."
    ]


def pairs(records: Sequence[Record], name: str, base: str) -> list[tuple[Record, Record]]:
    """The records of one algorithm, each with that of the other on the same surface."""
    known = references(records, base)
    chosen = [r for r in records if r.cell.algorithm == name]
    return [(r, known[circumstances(r.cell)]) for r in chosen if circumstances(r.cell) in known]


if __name__ == "__main__":
    main()
