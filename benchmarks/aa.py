"""How often is an algorithm called faster or slower than itself? On a quiet and a busy machine."""

from __future__ import annotations

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
from typing import Any, Literal

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.core.atomic import write_text
from cembench.registry import load_registry
from cembench.results.comparison import (
    Comparison,
    both_ratios,
    compare,
    compare_ratios,
    ratio_interval,
    reference_of,
    references,
)
from cembench.results.intervals import ERROR, LOOKS, share, share_of
from cembench.results.multiple_testing import corrected
from cembench.results.records import Outcome, Record
from cembench.results.store import Store
from cembench.running.map_checks import Checked
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.surfaces import generate_surface
from cembench.running.timing import CellTimer

TWINS = Path(__file__).with_name("twins.py")
ALGORITHMS = ("cem", "ldm", "direct-cem", "lscm")
SURFACES = ("flat-disk", "hemi-ellipsoid", "cone", "spherical-cap", "cylinder-sheet")
HALVES = {
    "quiet": "quiet",
    "busy": "beside a busy neighbour",
    "process": "within one process",
    "process-busy": "within one process, beside a busy neighbour",
    "shared": "within one process, without its control",
}
LAYOUT = """
| machine | runs | twins compared | called different | 95 % interval | corrected | rounds | busy |
|---|---:|---:|---:|---:|---:|---:|---:|
| {machine} | {runs} | {comparisons} | {called_different} ({share:.1%}) \
| {interval[0]:.1%} to {interval[1]:.1%} | {called_different_corrected} | {median_rounds:g} \
| {busy_share:.0%} |"""


def aa(
    *,
    runs: int = 10,
    faces: int = 2000,
    surfaces: str = ",".join(SURFACES),
    profile: str = "",
    algorithms: str = ",".join(ALGORITHMS),
    precision: str = "10%",
    budget: str = "4m",
    busy: int = 0,
    pairing: Literal["separate", "process", "shared"] = "separate",
    output: Path = Path("results/aa"),
) -> Section:
    """Count how often an algorithm is called faster or slower than itself.

    Runs the harness several times with four algorithms and a twin of each (the same function under
    another name, ``twins.py``) on five small surfaces: ten runs are 200 comparisons, of which at
    most 5 % may be called different. Also reports how often two runs agree: whether the intervals
    of CEM's speedups in two runs overlap. A stopped study is resumed by the same call::

        python -m benchmarks aa                      # a machine with nothing else to do
        python -m benchmarks aa --busy 1             # beside one process that never rests
        python -m benchmarks aa --pairing process    # rounds with a shared process too
        python -m benchmarks aa --pairing shared --faces 500    # these alone: quicker
        python -m benchmarks aa --profile quick --runs 2 --budget 4m --output results/aa-quick
        python -m benchmarks aa --runs 0 --write-docs    # what was measured so far, in the page

    OUTPUT/quiet.json and the like have what the page shows, after each run; the runs are beside.
    """
    names = algorithms.split(",")
    if pairing == "shared":
        tables = []
        for seed in progress(range(runs), "run"):
            tables.append(shared_run(names, surfaces.split(","), faces, seed))
            write_text(output / "shared.json", json.dumps(_counted(tables), indent=1))
        return section(output)
    half = "process" if pairing == "process" else "quiet"
    half = half if not busy else "process-busy" if half == "process" else "busy"
    options = ["--precision", precision, "--budget", budget, "--pairing", pairing]
    options += (
        ["--profile", profile] if profile else ["--surfaces", surfaces, "--faces", str(faces)]
    )
    measured: list[list[Record]] = []
    with neighbours(busy):
        for records in runs_with_twins(names, options, output / half, runs):
            measured.append(records)
            text = json.dumps(summarise(measured, names), indent=1)
            write_text(output / f"{half}.json", text)
    return section(output)


def runs_with_twins(
    names: Sequence[str], options: Sequence[str], folder: Path, runs: int
) -> Iterator[list[Record]]:
    """Call ``cembench run`` with algorithms and their twins, and yield the records of each run.

    A run measures only what is missing in its folder.
    """
    command = [sys.executable, "-m", "cembench.commands.cli", "run", "--json"]
    command += ["--plugin", str(TWINS)]
    command += ["-a", ",".join([*names, *(f"{name}-twin" for name in names)]), *options]
    for seed in progress(range(runs), "run"):
        place = folder / f"run-{seed:02d}"
        one = [*command, "--seed", str(seed), "-o", str(place)]
        ended = subprocess.run(one, check=False, stdout=subprocess.DEVNULL)
        if ended.returncode not in (0, 1):  # 1: a cell did not end ok, and is left out
            sys.exit(f"run {seed + 1} ended with code {ended.returncode}")
        yield Store(place).records()


def shared_run(
    names: Sequence[str], surfaces: Sequence[str], faces: int, seed: int
) -> list[Comparison]:
    """Compare twins by their shared processes alone, in the rounds of the first look.

    The separate processes, which can only take a verdict back, are left out.
    """
    registry = load_registry([str(TWINS)])
    both = [registry.algorithm(one) for name in names for one in (name, f"{name}-twin")]
    how = MeasurementSettings.until_precise(0.1)
    groups = []
    with (
        tempfile.TemporaryDirectory() as folder,
        closing(CellTimer(Path(folder), Options(seed=seed))) as timer,
    ):
        for surface in surfaces:
            mesh = generate_surface(registry, surface, faces)
            tasks = plan_cells(both, [mesh], {}, how, [str(TWINS)])
            checked = [Checked.of(timer.check(task)[0]) for task in tasks]
            groups.append((tasks, checked, list[list[float]]()))
        for _ in range(LOOKS[0]):
            timer.close()
            for tasks, checked, seconds in groups:
                rounds = timer.together(tasks, checked)
                if not isinstance(rounds, Outcome):
                    seconds.append([one.seconds for one in rounds])
    return [
        compare_ratios([row[k + 1] / row[k] for row in seconds], share(len(seconds)))
        for _, _, seconds in groups
        for k in range(0, 2 * len(names), 2)
    ]


@contextmanager
def neighbours(number: int) -> Iterator[None]:
    """Keep `number` processes busy during the block."""
    loop = [sys.executable, "-c", "while True: pass"]
    started = [subprocess.Popen(loop) for _ in range(number)]
    try:
        yield
    finally:
        for process in started:
            process.kill()
            process.wait()


def summarise(runs: Sequence[Sequence[Record]], names: Sequence[str]) -> dict[str, Any]:
    """Return what these runs show, in values that JSON can hold."""
    tables = [twin_comparisons(records, names) for records in runs]
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


def twin_comparisons(records: Sequence[Record], names: Sequence[str]) -> list[Comparison]:
    """Return the comparisons of algorithms with their twins on every surface of a run."""
    both = [pair for name in names for pair in pairs(records, f"{name}-twin", name)]
    return [one for pair in both if (one := compare(*pair)) is not None]


def is_called_different(comparison: Comparison) -> bool:
    """Whether one of the two was called faster or slower."""
    return comparison.verdict in ("faster", "slower")


def pairs(records: Sequence[Record], name: str, base: str) -> list[tuple[Record, Record]]:
    """Return the records of one algorithm, each with that of the other on the same surface."""
    known = references(records, base)
    chosen = [(r, reference_of(r, known)) for r in records if r.cell.algorithm == name]
    return [(record, base) for record, base in chosen if base is not None]


def _counted(tables: Sequence[Sequence[Comparison]]) -> dict[str, Any]:
    """Return how many comparisons of equal algorithms, by run, were called different."""
    known = [one for table in tables for one in table if one.interval is not None]
    wrong = sum(map(is_called_different, known))
    return {
        "runs": len(tables),
        "comparisons": len(known),
        "called_different": wrong,
        "interval": clopper_pearson(wrong, len(known)),
        "called_different_corrected": sum(
            is_called_different(one) for table in tables for one in corrected(table)
        ),
        "median_ratio": exp(median(log(one.ratio) for one in known)) if known else None,
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
    """Return of how many speedups, in each two runs, the intervals overlap; and how far apart."""
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
    interval = binomtest(hits, of).proportion_ci(method="exact")
    return float(interval.low), float(interval.high)


def section(output: Path) -> Section:
    """Return all parts, as far as they were measured."""
    rows = [
        {"machine": HALVES[half], **json.loads(path.read_text(encoding="utf-8"))}
        for half in HALVES
        if (path := output / f"{half}.json").is_file()
    ]
    for row in rows:
        row["share"] = row["called_different"] / max(row["comparisons"], 1)
    note = f"Stated is at most {ERROR:.0%}. *rounds*: the median of a cell; *busy*: the share of "
    note += "processes beside which others took more than a quarter of a core."
    shared = [
        f"Shared processes, {f['machine']}: they decide {f['shared']} of {f['comparisons']} "
        f"comparisons, the others are left to separate processes; their intervals are "
        f"{f['median_narrower']:.1f} times narrower in the median."
        for f in rows
        if f.get("median_narrower")
    ]
    repeated = [
        f"Repeated runs, {f['machine']}: of {f['speedups_compared']} speedups over CEM, each in "
        f"two runs, the intervals overlap in "
        f"{f['speedups_overlapping'] / f['speedups_compared']:.1%}; the ratios differ by "
        f"{f['median_difference']:.1%} in the median, {f['largest_difference']:.1%} at most."
        for f in rows
        if f.get("speedups_compared")
    ]
    return Section([Table(rows, LAYOUT), note, *shared, *repeated], "docs/measuring_details.md")
