"""How often is an algorithm called faster or slower than itself? On a quiet and on a busy machine.

Runs the harness several times with four algorithms and a twin of each (the same function under
another name, ``twins.py``) on five small surfaces: ten runs are 200 comparisons, of which at most
5 % may be called different. Also tells how often two runs agree: whether the intervals of CEM's
speedups in two runs overlap. Stopped, it goes on where it was when called again::

    python -m benchmarks.aa                      # a machine with nothing else to do
    python -m benchmarks.aa --busy 1             # beside so many processes that never rest
    python -m benchmarks.aa --pairing process    # rounds with a shared process too
    python -m benchmarks.aa --pairing shared --faces 500    # the shared processes alone: quicker
    python -m benchmarks.aa --profile quick --runs 2 --budget 4m -o results/aa-quick
    python -m benchmarks.aa --write-docs         # both, as far as they are there, in the page

What was found is in OUTPUT/quiet.json and OUTPUT/busy.json; the runs themselves are beside.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from itertools import combinations
from math import exp, log
from pathlib import Path
from statistics import median
from time import monotonic
from typing import Any

from benchmarks import pages
from benchmarks.repeatability import TWINS, pairs
from cembench.core.atomic import write_text
from cembench.registry import load_registry
from cembench.results.comparison import (
    Comparison,
    both_ratios,
    compare,
    compare_ratios,
    ratio_interval,
)
from cembench.results.intervals import ERROR
from cembench.results.looks import LOOKS, share, share_of
from cembench.results.many import corrected
from cembench.results.records import Outcome, Record
from cembench.results.store import Store
from cembench.running.judging import Checked
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.surfaces import generate_surface
from cembench.running.timing import CellTimer

PAGE = pages.ROOT / "docs/measuring.md"
ALGORITHMS = ("cem", "ldm", "direct-cem", "lscm")
SURFACES = ("flat-disk", "hemi-ellipsoid", "cone", "spherical-cap", "cylinder-sheet")
HALVES = {
    "quiet": "quiet",
    "busy": "beside a busy neighbour",
    "process": "within one process",
    "process-busy": "within one process, beside a busy neighbour",
    "shared": "within one process, without its control",
}


def main() -> None:
    """Run what is missing, and tell what all runs say."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=10)
    parser.add_argument("--faces", type=int, default=2000, help="triangles of each surface")
    parser.add_argument("--surfaces", default=",".join(SURFACES))
    parser.add_argument("--profile", help="instead of these surfaces, as in `cembench run`")
    parser.add_argument("--algorithms", default=",".join(ALGORITHMS))
    parser.add_argument("--precision", default="10%")
    parser.add_argument("--budget", default="4m", help="of each run, see `cembench run`")
    parser.add_argument("--busy", type=int, default=0, metavar="N", help="start N busy loops")
    pairings = ("separate", "process", "shared")
    parser.add_argument("--pairing", choices=pairings, default="separate")
    parser.add_argument("-o", "--output", type=Path, default=Path("results/aa"))
    parser.add_argument("--write-docs", action="store_true", help="fill docs/measuring.md; no runs")
    chosen = parser.parse_args()
    if not chosen.write_docs:
        if chosen.pairing == "shared":
            measure_shared(chosen)
        else:
            half = "process" if chosen.pairing == "process" else "quiet"
            half = half if not chosen.busy else "process-busy" if half == "process" else "busy"
            with neighbours(chosen.busy):
                measure(chosen, half)
    text = tell(chosen.output)
    print(text)
    if chosen.write_docs:
        pages.fill(PAGE, Path(__file__).stem, text)


def measure(chosen: argparse.Namespace, half: str) -> None:
    """Run the harness as often as is missing; what all runs so far say is kept after each."""
    started, runs = monotonic(), []
    for seed in range(chosen.runs):
        folder = chosen.output / half / f"run-{seed:02d}"
        ended = subprocess.run(
            run_command(chosen, folder, seed), check=False, stdout=subprocess.DEVNULL
        )
        if ended.returncode not in (0, 1):  # 1: a cell did not end ok, and is left out
            sys.exit(f"run {seed + 1} ended with code {ended.returncode}")
        runs.append(Store(folder).records())
        summary = summarise(runs, chosen.algorithms.split(","))
        write_text(chosen.output / f"{half}.json", json.dumps(summary, indent=1))
        minutes = (monotonic() - started) / 60
        print(f"run {seed + 1} of {chosen.runs} after {minutes:.1f} min", file=sys.stderr)


def measure_shared(chosen: argparse.Namespace) -> None:
    """Compare twins by their shared processes alone; each run has the rounds of the first look.

    The separate processes, which can only take a verdict back, are left out.
    """
    tables: list[list[Comparison]] = []
    for seed in range(chosen.runs):
        tables.append(_shared_run(chosen, seed))
        write_text(chosen.output / "shared.json", json.dumps(_counted(tables), indent=1))
        print(f"run {seed + 1} of {chosen.runs}", file=sys.stderr)


def _shared_run(chosen: argparse.Namespace, seed: int) -> list[Comparison]:
    """Return the comparisons of one run, of each algorithm with its twin on each surface."""
    registry = load_registry([str(TWINS)])
    names = chosen.algorithms.split(",")
    both = [registry.algorithm(one) for name in names for one in (name, f"{name}-twin")]
    how = MeasurementSettings.until_precise(0.1)
    groups = []
    with (
        tempfile.TemporaryDirectory() as folder,
        closing(CellTimer(Path(folder), Options(seed=seed))) as timer,
    ):
        for surface in chosen.surfaces.split(","):
            mesh = generate_surface(registry, surface, chosen.faces)
            tasks = plan_cells(both, [mesh], {}, how, [str(TWINS)])
            checked = [Checked.of(timer.check(task)[0]) for task in tasks]
            groups.append((tasks, checked, list[list[float]]()))
        for _ in range(LOOKS[0]):
            timer.close()
            for tasks, checked, seconds in groups:
                found = timer.together(tasks, checked)
                if not isinstance(found, Outcome):
                    seconds.append([one.seconds for one in found])
    return [
        compare_ratios([row[k + 1] / row[k] for row in seconds], share(len(seconds)))
        for _, _, seconds in groups
        for k in range(0, 2 * len(names), 2)
    ]


@contextmanager
def neighbours(number: int) -> Iterator[None]:
    """Keep so many processes at work meanwhile."""
    loop = [sys.executable, "-c", "while True: pass"]
    started = [subprocess.Popen(loop) for _ in range(number)]
    try:
        yield
    finally:
        for process in started:
            process.kill()
            process.wait()


def run_command(chosen: argparse.Namespace, folder: Path, seed: int) -> list[str]:
    """Return the call of ``cembench run`` for one of the runs; it measures only what is missing."""
    names = chosen.algorithms.split(",")
    twins = [f"{name}-twin" for name in names]
    return [
        *(sys.executable, "-m", "cembench.commands.cli", "run", "--json"),
        *("--plugin", str(TWINS), "-a", ",".join([*names, *twins])),
        *(
            ("--profile", chosen.profile)
            if chosen.profile
            else ("--surfaces", chosen.surfaces, "--faces", str(chosen.faces))
        ),
        *("--precision", chosen.precision, "--budget", chosen.budget),
        *("--pairing", chosen.pairing, "--seed", str(seed), "-o", str(folder)),
    ]


def summarise(runs: Sequence[Sequence[Record]], names: Sequence[str]) -> dict[str, Any]:
    """Say what these runs found. Values that JSON can hold."""
    tables = [
        [c for name in names for p in pairs(r, f"{name}-twin", name) if (c := compare(*p))]
        for r in runs
    ]
    rounds = [len(record.outcome.rounds) for records in runs for record in records]
    busy = [
        bool(r.neighbours and r.neighbours.busy)
        for records in runs
        for record in records
        for r in record.outcome.rounds
    ]
    overlapping, compared, apart = _repeated(runs, names)
    narrower = [n for records in runs for name in names for n in _narrower(records, name)]
    return _counted(tables) | {
        "shared": sum(one.together for table in tables for one in table),
        "median_narrower": median(narrower) if narrower else None,
        "median_rounds": median(rounds) if rounds else None,
        "busy_share": sum(busy) / len(busy) if busy else None,
        "speedups_compared": compared,
        "speedups_overlapping": overlapping,
        "median_difference": median(apart) if apart else None,
        "largest_difference": max(apart, default=None),
    }


def _counted(tables: Sequence[Sequence[Comparison]]) -> dict[str, Any]:
    """Return how many comparisons of equal algorithms, by run, were called different."""
    found = [one for table in tables for one in table if one.interval is not None]
    different = [one.verdict in ("faster", "slower") for one in found]
    together = [one.verdict in ("faster", "slower") for table in tables for one in corrected(table)]
    return {
        "runs": len(tables),
        "comparisons": len(found),
        "called_different": sum(different),
        "interval": clopper_pearson(sum(different), len(found)),
        "called_different_corrected": sum(together),
        "median_ratio": exp(median(log(one.ratio) for one in found)) if found else None,
        "median_rounds": LOOKS[0],
        "busy_share": None,
    }


def _narrower(records: Sequence[Record], name: str) -> Iterator[float]:
    """Yield how many times narrower the intervals within a shared process are, if there was one."""
    for ours, theirs in pairs(records, f"{name}-twin", name):
        rounds = ours.outcome.rounds, theirs.outcome.rounds
        share = share_of(len(rounds[0]), ours.cell, theirs.cell)
        intervals = [ratio_interval(r, share) for r in both_ratios(*rounds) if r]
        if len(intervals) == 2 and all(intervals):
            separate, together = (log(i.high / i.low) for i in intervals if i)
            yield separate / together


def _repeated(
    runs: Sequence[Sequence[Record]], names: Sequence[str]
) -> tuple[int, int, list[float]]:
    """Of how many speedups, in each two runs, overlap the intervals? And how far are they apart?"""
    known = []
    for records in runs:
        both = [pair for name in names[1:] for pair in pairs(records, name, names[0])]
        known.append({(a.cell.mesh_hash, a.cell.algorithm): compare(a, b) for a, b in both})
    overlapping, compared, apart = 0, 0, []
    for one, other in combinations(known, 2):
        for key in one.keys() & other.keys():
            a, b = one[key], other[key]
            if a is None or b is None or a.interval is None or b.interval is None:
                continue
            compared += 1
            overlapping += a.interval.low <= b.interval.high and b.interval.low <= a.interval.high
            apart.append(exp(abs(log(a.ratio / b.ratio))) - 1)
    return overlapping, compared, apart


def clopper_pearson(hits: int, of: int) -> tuple[float, float]:
    """Return the exact 95 % interval of a share."""
    from scipy.stats import binomtest

    if not of:
        return 0.0, 1.0
    found = binomtest(hits, of).proportion_ci(method="exact")
    return float(found.low), float(found.high)


def tell(output: Path) -> str:
    """Return the Markdown of both halves, as far as they were measured."""
    rows = {
        half: json.loads(path.read_text())
        for half in HALVES
        if (path := output / f"{half}.json").is_file()
    }
    lines = [
        "| machine | runs | twins compared | called different | 95 % interval | corrected | "
        "rounds | busy |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for half, f in rows.items():
        n, low, high = f["comparisons"], *f["interval"]
        lines.append(
            f"| {HALVES[half]} | {f['runs']} | {n} | {f['called_different']} "
            f"({f['called_different'] / max(n, 1):.1%}) | {low:.1%} to {high:.1%} "
            f"| {f['called_different_corrected']} | {f['median_rounds']:g} "
            f"| {'-' if f['busy_share'] is None else format(f['busy_share'], '.0%')} |"
        )
    shared = [(half, f) for half, f in rows.items() if f.get("median_narrower")]
    lines += ["", f"Stated is at most {ERROR:.0%}. *rounds*: the median of a cell; *busy*: the "]
    lines[-1] += "share of processes beside which others took more than a quarter of a core."
    for half, f in shared:
        lines += [
            "",
            f"Shared processes, {HALVES[half]}: they decide {f['shared']} of {f['comparisons']} "
            f"comparisons, the others are left to separate processes; their intervals are "
            f"{f['median_narrower']:.1f} times narrower in the median.",
        ]
    for half, f in rows.items():
        if f.get("speedups_compared"):
            share = f["speedups_overlapping"] / f["speedups_compared"]
            lines += [
                "",
                f"Repeated runs, {HALVES[half]}: of {f['speedups_compared']} speedups over CEM, "
                f"each in two runs, the intervals overlap in {share:.1%}; the ratios differ by "
                f"{f['median_difference']:.1%} in the median, {f['largest_difference']:.1%} at "
                "most.",
            ]
    return "\n".join(lines)


if __name__ == "__main__":
    main()
