"""Reproduce the paper's tables, figures and claims on its smallest models."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cembench.api.settings import AnyPath, budget_seconds, bytes_of
from cembench.core.arguments import checked
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from cembench.api.benchmark import Run


@checked
def reproduce(
    *,
    out: AnyPath = "results/reproduce",
    budget: float | str = "180s",
    offline: bool = False,
    fresh: bool = False,
    reporter: Reporter = SILENT,
) -> Run:
    """Measure the paper's algorithms on its smallest models, for its report.

    Models that are public are fetched (20 seconds at most), and the others have stand-ins. It takes
    about five minutes. What the folder already holds is not measured again.

    Parameters
    ----------
    out : path
        Folder for the results.
    budget : float or str
        Time for measuring, e.g. 10m; in Python also seconds. Small surfaces are measured until
        their times are precise, and what does not fit has one round.
    offline : bool
        Fetch nothing; use models fetched before.
    fresh : bool
        Measure again what is already recorded.
    reporter : Reporter
        Receives what is being done.

    Returns
    -------
    Run
        The records; :meth:`Run.report` writes the tables, figures and claims.

    Raises
    ------
    ParameterError
        `budget` is not a time.
    RecordError
        The folder holds something else than such a run.

    Examples
    --------
    >>> import cembench
    >>> cembench.reproduce(budget="10m").report()  # doctest: +SKIP

    """
    from pathlib import Path

    from cembench.api.benchmark import Run
    from cembench.api.paper_surfaces import surfaces_at_hand
    from cembench.registry import load_registry
    from cembench.results import run_folder
    from cembench.results.profiles import Profile, algorithms_of
    from cembench.results.sequential_checks import USUAL_PRECISION
    from cembench.results.store import Store
    from cembench.running.environment import usable_cores
    from cembench.running.local import run_tasks
    from cembench.running.options import Options
    from cembench.running.plan import MeasurementSettings, plan_cells

    folder = Path(out)
    run_folder.check(folder)
    options = Options(
        memory_bytes=bytes_of(None),
        fresh=fresh,
        budget=budget_seconds(budget),
        whole_surfaces=True,
        jobs=usable_cores(),
    )
    registry = load_registry()
    chosen = [registry.algorithm(name) for name in algorithms_of(Profile.quick, registry)]
    surfaces, roles = surfaces_at_hand(registry, chosen, reporter, offline=offline)
    settings = MeasurementSettings.until_precise(USUAL_PRECISION)
    tasks = plan_cells(chosen, surfaces, {}, settings, standing=roles)
    with reporter.watching(len(tasks)) as progress:
        records = run_tasks(tasks, Store(folder), options, progress)
    return Run(folder, tuple(records))
