"""Several runs as a static site: an index, their machines, their ratios over time, their reports.

::

    index.html                 what the runs are, and what became of ratios from one to the next
    leaderboard/index.html     all runs together: angles, seconds at equal angles, success
    figures/history.*          the ratios as a plot, and its data
    runs/<name>/index.html     the report of each run, one file
    contents.json              which of the folder's files are the site's, with their hashes

Every link is relative and nothing is asked of the network: it works from a disk as from a server.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from cembench.core import folders
from cembench.core.atomic import draft_folder, unwritable, write_text
from cembench.core.errors import ParameterError
from cembench.core.names import distinct_slugs
from cembench.core.version import installed_version
from cembench.report.content.evidence import Evidence
from cembench.report.content.report import build_report
from cembench.report.palette import series_styles
from cembench.report.plots import Axis, Plot, PlotPanel, Point, through, write_plot
from cembench.report.render.html import environment, render, write_html
from cembench.results.machines import machine_of, machine_of_record, software_differences
from cembench.results.multiple_testing import geometric
from cembench.results.records import REFERENCE

from .leaderboard import Entrant, commit_of, leaderboard

#: Called with the run's name, the number done and the total.
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class PublishedRun:
    """A run as the index shows it.

    `ratios` are seconds over the reference's, by algorithm and then by surface and policy: each is
    formed within one machine and one sitting.
    """

    name: str
    date: str
    commits: tuple[str, ...]
    cells: int
    ok: int
    surfaces: int
    machines: Mapping[str, int]
    processors: Mapping[str, str]
    ratios: Mapping[str, Mapping[str, float]]
    differing: tuple[str, ...] = ()


@dataclass(frozen=True)
class HeadlineRatio:
    """The geometric mean of an algorithm's ratios in a run, and over how many surfaces."""

    ratio: float
    surfaces: int
    #: Whether these are the surfaces of every run that has the algorithm.
    common: bool

    def __str__(self) -> str:
        return f"{self.ratio:.2f} ({self.surfaces}{'' if self.common else '*'})"


def write_site(
    runs: Sequence[Path],
    folder: Path,
    progress: Progress = lambda *_: None,
    signers: Mapping[Path, str] = MappingProxyType({}),
) -> list[PublishedRun]:
    """Write the site of several runs.

    Parameters
    ----------
    runs : sequence of Path
        The runs' folders.
    folder : Path
        A new or empty folder, or an earlier site.
    progress : function
        Called with the progress.
    signers : mapping
        Who signed a run, for those that are known to be signed.

    Returns
    -------
    list of PublishedRun
        The runs, in order of their dates.

    Raises
    ------
    ParameterError
        No run, or the same one twice.
    RecordError
        A folder holds no run, or the site's folder holds other files.
    """
    places = [run.resolve() for run in runs]
    if not places or len(set(places)) < len(places):
        raise ParameterError("publish takes at least one run; name each run once.")
    folders.check(folder, "report")
    names = distinct_slugs({str(place): place.name for place in places})
    published, entrants = [], []
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with draft_folder(folder) as draft:
            for k, run in enumerate(runs):
                name = names[str(places[k])]
                progress(name, k, len(runs))
                evidence = Evidence.of(run)
                published.append(_publish_one(evidence, name, draft))
                entrants.append(Entrant(name, evidence, signers.get(run, "")))
            progress("index", len(runs), len(runs))
            published.sort(key=lambda one: (one.date, one.name))
            _write_index(published, draft)
            entrants.sort(key=lambda one: one.name)
            place = draft / "leaderboard"
            write_html(leaderboard(entrants, "cembench publish", place), place)
            folders.publish(draft, folder, "report")
    except OSError as error:
        raise unwritable(folder, error) from error
    return published


def _publish_one(evidence: Evidence, name: str, draft: Path) -> PublishedRun:
    with draft_folder(draft / "making") as making:
        report = build_report(evidence, making, f"cembench report {name}")
        write_text(draft / "runs" / name / "index.html", render(report, making))
    return about(evidence, name)


def about(evidence: Evidence, name: str) -> PublishedRun:
    """Gather what the index says of a run."""
    environments = evidence.store.environments()
    records = evidence.records
    machines = Counter(machine_of_record(record, environments) for record in records)
    used = {record.environment for record in records}
    described = [environments.get(key, {}) for key in sorted(used)]
    commits = {commit_of(one) for one in described} - {""}
    versions = {str(one.get("cembench") or "") for one in described} - {""}
    ratios: dict[str, dict[str, float]] = {}
    for record in records:
        rate = evidence.rate(record) if record.outcome.status == "ok" else None
        base = evidence.base(record)  # of another target it is another algorithm
        if base is None or rate is None or base.environment != record.environment:
            continue
        if base.cell.algorithm == evidence.reference:
            place = f"{record.cell.mesh_hash} {record.cell.solves}"
            ratios.setdefault(record.cell.algorithm, {})[place] = 1 + rate
    return PublishedRun(
        name=name,
        date=max(record.started_at for record in records)[:10],
        commits=tuple(sorted(commits or versions)),
        cells=len(records),
        ok=sum(record.outcome.status == "ok" for record in records),
        surfaces=len(evidence.surfaces),
        machines=dict(machines),
        processors={machine_of(one): str(one.get("cpu") or "-") for one in described},
        ratios=ratios,
        differing=tuple(software_differences(records, environments)),
    )


def history(runs: Sequence[PublishedRun]) -> dict[str, list[HeadlineRatio | None]]:
    """Return each algorithm's headline ratio in each run, None where the run has none.

    Averaged are the surfaces that all runs with the algorithm have, so that another choice of
    surfaces is not taken for a change; where they have none in common, a run's own.

    Examples
    --------
    >>> history([])
    {}
    """
    by_series: dict[str, list[HeadlineRatio | None]] = {}
    for name in sorted({name for run in runs for name in run.ratios}):
        held = [run.ratios.get(name) for run in runs]
        common = set.intersection(*(set(own) for own in held if own))
        by_series[name] = [_headline(own, common) if own else None for own in held]
    return by_series


def _headline(own: Mapping[str, float], common: Set[str]) -> HeadlineRatio:
    chosen = sorted(common or own)
    average = float(geometric(np.array([own[place] for place in chosen])))
    return HeadlineRatio(average, len(chosen), bool(common))


def _write_index(runs: Sequence[PublishedRun], draft: Path) -> None:
    here = Path(__file__).parent
    ratios = history(runs)
    if len(runs) > 1 and ratios:
        write_plot(_plot(runs, ratios), draft)
    about = {"runs": runs, "history": ratios, "reference": REFERENCE}
    page = environment().from_string((here / "site.html").read_text(encoding="utf-8"))
    text = page.render(
        about,
        style=(here / "site.css").read_text(encoding="utf-8"),
        drawn=len(runs) > 1 and bool(ratios),
        starred=any(one and not one.common for row in ratios.values() for one in row),
        version=installed_version(),
    )
    write_text(draft / "index.html", text)


def _plot(runs: Sequence[PublishedRun], ratios: Mapping[str, list[HeadlineRatio | None]]) -> Plot:
    styles = series_styles(list(ratios))
    series = []
    for name, row in ratios.items():
        points = [
            Point(k, one.ratio, f"{run.name}, {run.date}")
            for k, (run, one) in enumerate(zip(runs, row, strict=True), start=1)
            if one
        ]
        series.append(through(name, points, "both", styles[name]))
    y = Axis(f"seconds over {REFERENCE}'s", log=True)
    panel = PlotPanel(Axis("run, by date"), y, tuple(series))
    return Plot("history", "Ratios from run to run", (panel,))
