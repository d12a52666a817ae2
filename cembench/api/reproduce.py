"""Measure the paper's algorithms on its smallest models, and write a report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING

from cembench.api.benchmark import Run
from cembench.api.settings import AnyPath, budget_seconds, bytes_of
from cembench.core.arguments import checked
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from cembench.mesh.triangle_mesh import TriangleMesh
    from cembench.registry import Algorithm, Registry
    from cembench.report.document import Report
    from cembench.results.records import MeshOrigin
    from cembench.running.plan import Provenance


@dataclass(frozen=True)
class Reproduction:
    """What `reproduce` measured, and its report.

    Parameters
    ----------
    run : Run
        The folder, with the records that were asked for.
    report : Report
        Contents of the report, which lies in ``report`` below the run's folder.
    surfaces : mapping
        For each model of the paper, whether it was measured ("model") or has a stand-in.

    Examples
    --------
    >>> import cembench
    >>> found = cembench.reproduce(offline=True, budget=0)  # doctest: +SKIP
    >>> sorted(set(found.surfaces.values()))  # doctest: +SKIP
    ['stand-in']
    """

    run: Run
    report: Report
    surfaces: Mapping[str, MeshOrigin]


@checked
def reproduce(
    output: AnyPath = "results/reproduce",
    *,
    budget: float | str = "180s",
    offline: bool = False,
    fresh: bool = False,
    jobs: int = 1,
    reporter: Reporter = SILENT,
) -> Reproduction:
    """Measure the paper's algorithms on its smallest models, and write a report.

    Models that are public are fetched (20 seconds at most), and the others have stand-ins. It takes
    about five minutes. What the folder already holds is not measured again. The report is written
    to the same folder.

    Parameters
    ----------
    output : path
        Folder for the results.
    budget : float or str
        Time for measuring, e.g. 10m; in Python also seconds. Small surfaces are measured until
        their times are precise, and what does not fit has one round.
    offline : bool
        Fetch nothing; use models fetched before.
    fresh : bool
        Measure again what is already recorded.
    jobs : int
        Number of processes that make stand-ins and draw. A script needs
        ``if __name__ == "__main__"`` for two or more.
    reporter : Reporter
        Receives what is being done.

    Returns
    -------
    Reproduction
        The run and its report.

    Raises
    ------
    RecordError
        The folder is not a run, or cannot be written to.
    ParameterError
        The budget is not a time.

    Examples
    --------
    >>> import cembench
    >>> found = cembench.reproduce("results/paper", budget="10m")  # doctest: +SKIP
    >>> found.run.table()  # doctest: +SKIP
    """
    from cembench.core import folders
    from cembench.registry import load_registry
    from cembench.results import run_folder
    from cembench.results.intervals import USUAL_PRECISION
    from cembench.results.papers import usual_paper
    from cembench.results.profiles import Profile, algorithms_of
    from cembench.results.store import Store
    from cembench.running.environment import usable_cores
    from cembench.running.local import run_tasks
    from cembench.running.options import Options
    from cembench.running.plan import MeasurementSettings, plan_cells

    folder = Path(output)
    run_folder.check(folder)
    folders.check(folder / "report", "report")
    options = Options(
        memory_bytes=bytes_of(None),
        fresh=fresh,
        budget=budget_seconds(budget),
        whole_surfaces=True,
        jobs=usable_cores(),
    )
    registry = load_registry()
    chosen = [registry.algorithm(name) for name in algorithms_of(Profile.quick, registry)]
    surfaces, roles = _surfaces(registry, chosen, offline, jobs, reporter)
    settings = MeasurementSettings.until_precise(USUAL_PRECISION)
    tasks = plan_cells(chosen, surfaces, {}, settings, standing=roles, paper=usual_paper())
    with reporter.watching(len(tasks), options.budget or inf) as progress:
        records = run_tasks(tasks, Store(folder), options, progress)
    run = Run(folder, tuple(records))
    report = run.report(
        command=f"cembench reproduce -o {output}", jobs=min(jobs, 2), reporter=reporter
    )
    return Reproduction(run, report, {role.paper_row: role.origin for role in roles.values()})


def _surfaces(
    registry: Registry, algorithms: list[Algorithm], offline: bool, jobs: int, reporter: Reporter
) -> tuple[list[TriangleMesh], dict[str, Provenance]]:
    """Return a surface for each row: the model if it is there, else its stand-in; and the roles."""
    from cembench.api.paper_surfaces import fetch_models, public_models, stand_ins
    from cembench.api.run_plan import read_surfaces
    from cembench.mesh.datasets import is_fetched, surface_file
    from cembench.results.profiles import Profile, surfaces_of
    from cembench.running.plan import provenances

    standing = {registry.surface(s).paper_row: s for s in surfaces_of(Profile.quick, registry)}
    public = public_models(registry, list(standing))
    if public and not offline:
        with reporter.downloads(public) as progress:
            what = fetch_models(public, progress)
        reporter.info(what)
    models = {one.paper_row: one for one in public if is_fetched(one)}
    missing = {row: name for row, name in standing.items() if row not in models}
    for kind, rows in (("the paper's models", models), ("stand-ins", missing)):
        reporter.info(f"{kind}: {', '.join(rows) or 'none'}")
    made = stand_ins(registry, list(missing.values()), jobs, reporter)
    files = map(surface_file, models.values())
    read, roles = read_surfaces(files, (), registry, algorithms, reporter, faces=None, repair=False)
    return [*read, *made], roles | provenances(registry, list(missing.values()))
