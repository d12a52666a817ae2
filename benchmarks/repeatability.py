"""Does the harness say the same when it is asked again, and does it keep its error rate?"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence
from math import comb
from pathlib import Path
from statistics import median

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.results.comparison import Comparison, circumstances, compare, references
from cembench.results.intervals import LEVEL
from cembench.results.records import DEFAULT_ROUNDS, Record
from cembench.results.store import Store

TWINS = Path(__file__).with_name("twins.py")
LAYOUT = """
| surface | faces | median | smallest | largest | spread of t / t_CEM |
|---|---:|---:|---:|---:|---:|
| {surface} | {faces:,} | {median:.2f} | {smallest:.2f} | {largest:.2f} | {spread:.1%} |"""


def repeatability(
    *,
    runs: int = 10,
    against: str = "fdm",
    profile: str = "quick",
    surfaces: str = "",
    faces: int = 0,
    repeats: int = DEFAULT_ROUNDS,
    output: Path = Path("results/repeatability"),
) -> Section:
    """Measure how far speedups spread over runs, and how often twins are called different.

    Runs a profile, or `surfaces` as in `cembench run`, several times in a row, each run with CEM,
    another algorithm and a twin of both (the same algorithm under another name, see ``twins.py``),
    and reports

    - how far the speedup of CEM over the other algorithm (Eq. 33) spreads from run to run;
    - how often an algorithm is called faster or slower than its twin: the stated rate is at most
      5 %.

    A stopped study is resumed by the same call. It needs a machine with nothing else to do.
    """
    options = ["--surfaces", surfaces] if surfaces else ["--profile", profile]
    options += ["--repeats", str(repeats), *(["--faces", str(faces)] if faces else [])]
    records = list(runs_with_twins(("cem", against), options, output, runs))
    return summary(records, against)


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


def summary(runs: Sequence[Sequence[Record]], against: str) -> Section:
    """Return the speedups on each surface, and a sentence about twins."""
    surfaces: dict[tuple[int, str], list[float]] = {}
    for records in runs:
        for record, base in pairs(records, against, "cem"):
            if comparison := compare(record, base):
                key = record.mesh.faces, record.cell.mesh
                surfaces.setdefault(key, []).append(comparison.speedup)
    rows = [
        {
            "surface": mesh,
            "faces": faces,
            "median": median(speedups),
            "smallest": min(speedups),
            "largest": max(speedups),
            "spread": (max(speedups) - min(speedups)) / (1 + median(speedups)),
        }
        for (faces, mesh), speedups in sorted(surfaces.items())
    ]
    about = f"Speedup of CEM over {against} (Eq. 33) in {len(runs)} runs:"
    twins = [one for records in runs for one in twin_comparisons(records, ("cem", against))]
    return Section([about, Table(rows, LAYOUT), sentence(twins)])


def twin_comparisons(records: Sequence[Record], names: Sequence[str]) -> list[Comparison]:
    """Return the comparisons of algorithms with their twins on every surface of a run."""
    both = [pair for name in names for pair in pairs(records, f"{name}-twin", name)]
    return [one for pair in both if (one := compare(*pair)) is not None]


def is_called_different(comparison: Comparison) -> bool:
    """Whether one of the two was called faster or slower."""
    return comparison.verdict in ("faster", "slower")


def sentence(comparisons: Sequence[Comparison]) -> str:
    """Return how often twins were called different, and how likely that is at the stated rate.

    That is the probability of as many wrong verdicts or more, were each made with the stated rate
    of 5 % independently of the others.
    """
    known = [one for one in comparisons if one.interval is not None]
    wrong, n, rate = sum(map(is_called_different, known)), len(known), 1 - LEVEL
    if not n:
        return "No A/A comparison with six rounds or more."
    chance = sum(comb(n, k) * rate**k * (1 - rate) ** (n - k) for k in range(wrong, n + 1))
    return (
        f"A/A: {wrong} of {n} comparisons of an algorithm with its twin ({wrong / n:.1%}) were "
        f"called different; the stated rate is at most {rate:.0%} (at exactly that, "
        f"as many or more come with a probability of {chance:.2f}). The median "
        f"ratio of twins is {median(one.ratio for one in known):.4f}."
    )


def pairs(records: Sequence[Record], name: str, base: str) -> list[tuple[Record, Record]]:
    """Return the records of one algorithm, each with that of the other on the same surface."""
    known = references(records, base)
    chosen = [r for r in records if r.cell.algorithm == name]
    return [(r, known[circumstances(r.cell)]) for r in chosen if circumstances(r.cell) in known]
