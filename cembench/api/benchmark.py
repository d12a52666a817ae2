"""Benchmark algorithms on surfaces: separate processes, rounds and records."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cembench.api.notebook import is_notebook
from cembench.api.settings import (
    AnyPath,
    Backend,
    Faces,
    Rounds,
    Seed,
    Solves,
    Threads,
    Timeout,
    budget_seconds,
    bytes_of,
    installed_backend,
    precision_share,
)
from cembench.core.arguments import Range, checked
from cembench.core.errors import ParameterError
from cembench.core.reporter import SILENT, Reporter
from cembench.results.intervals import LOOKS, USUAL_MAX_ROUNDS, USUAL_PRECISION

if TYPE_CHECKING:
    import pandas as pd
    from distributed import Client

    from cembench.api.run_plan import Plan
    from cembench.api.run_status import RunStatus
    from cembench.report.document import Report
    from cembench.results.profiles import Profile
    from cembench.results.records import Record
    from cembench.running.surfaces import SurfaceInput
    from cembench.running.watcher import Watcher

#: Columns of :meth:`Run.table`, under the headings that they have on a terminal; 80 columns wide.
TABLE_COLUMNS = {name: name for name in ("surface", "algorithm", "solves", "status", "seconds")}
TABLE_COLUMNS |= {
    "comparable_energy": "E_C",
    "angle_error_mean_deg": "angle°",
    "flipped_triangles": "folds",
}


@dataclass(frozen=True)
class Run:
    """A folder of records: what `cembench run` writes and `cembench report` reads.

    Parameters
    ----------
    folder : Path
        Folder with the records and maps.
    asked : tuple of Record
        The records of the cells that were asked for, in their order.
    plan : Plan, optional
        What was planned: the cells, and what each is expected to cost.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cembench
    >>> cembench.Run(Path("results/run")).folder.name
    'run'
    """

    folder: Path
    asked: tuple[Record, ...] = field(default=(), compare=False, repr=False)
    plan: Plan | None = field(default=None, compare=False, repr=False)

    def records(self) -> list[Record]:
        """Return every record.

        Returns
        -------
        list of Record
            The records, sorted by file name.

        Raises
        ------
        RecordError
            The folder is not a run, or one of its records is damaged.
        """
        from cembench.results.store import Store

        return Store(self.folder).records()

    def table(self, reference: str = "cem", *, full: bool = False) -> pd.DataFrame:
        """Return a table with one row per cell.

        Parameters
        ----------
        reference : str
            The algorithm whose speedup over the others is included with `full`.
        full : bool
            Whether to return all columns, about eighty, under the names that records have,
            instead of those most looked at.

        Returns
        -------
        pandas.DataFrame
            Surface, algorithm, status, median seconds, E_C (over the image's area where the
            boundary is free), mean angle error in degrees, and folds. The
            linear-algebra policy is a column if there are several. Numbers are rounded as on a
            terminal.
        """
        import pandas as pd

        from cembench.results.columns import comparable_energy

        table = pd.DataFrame(self.rows(reference)).rename(columns={"mesh": "surface"})
        if full:
            return table
        table["comparable_energy"] = [comparable_energy(record) for record in self.records()]
        table = table.round({"comparable_energy": 4, "angle_error_mean_deg": 2, "seconds": 5})
        left_out = {"solves"} if len(table) and table["solves"].nunique() == 1 else set()
        few = [name for name in TABLE_COLUMNS if name in table and name not in left_out]
        return table[few].rename(columns=TABLE_COLUMNS)

    def rows(self, reference: str = "cem") -> list[dict[str, Any]]:
        """Return the data of :meth:`table` as one dictionary per cell.

        Parameters
        ----------
        reference : str
            The algorithm whose speedup over the others is included.

        Returns
        -------
        list of dict
            The rows.
        """
        from cembench.results.columns import rows

        return rows(self.records(), reference)

    def speedups(self, reference: str = "cem") -> pd.DataFrame:
        """Return the speedup of the reference over each other algorithm, t / t_ref - 1.

        Parameters
        ----------
        reference : str
            Name of the reference algorithm.

        Returns
        -------
        pandas.DataFrame
            One row per surface, algorithm and policy, with the interval from paired rounds and
            who is faster than whom; empty if the reference was not measured.
        """
        columns = ["surface", "algorithm", "solves", "speedup", "speedup_low", "speedup_high"]
        table = self.table(reference, full=True)
        compared = table[table["reference"].notna()]
        words = {"faster": "{0} is faster than {1}", "slower": "{1} is faster than {0}"}
        verdicts = [
            words.get(verdict, verdict).format(algorithm, reference)
            for verdict, algorithm in zip(compared["verdict"], compared["algorithm"], strict=True)
        ]
        return compared[columns].assign(verdict=verdicts).reset_index(drop=True)

    def report(
        self,
        folder: AnyPath | None = None,
        *,
        tables: Sequence[AnyPath] = (),
        paper: str | None = None,
        trust: bool = False,
        verify: bool = False,
        command: str = "",
        jobs: int = 1,
        reporter: Reporter = SILENT,
    ) -> Report:
        """Write a report of a run: the paper's tables, figures and claims, as measured.

        The folder holds index.html (one file that works offline), report.md, report.tex, and each
        table, figure and its data as separate files. docs/tables.md says how `tables` of your own
        are declared.

        Parameters
        ----------
        folder : path, optional
            The report's folder (default: report in the run's folder).
        tables : sequence of paths
            A TOML file that declares more tables and plots.
        paper : str, optional
            The paper whose tables and claims it has: an installed one, or its folder, whose
            checks.py runs as you.
        trust : bool
            Run the checks.py of a paper's folder that is not installed.
        verify : bool
            Recompute the figures of all maps, not just of a sample.
        command : str
            The command that makes it again, if that is not `cembench report`.
        jobs : int
            Number of processes that draw. A script needs ``if __name__ == "__main__"`` for two or
            more.
        reporter : Reporter
            Receives what is being done.

        Returns
        -------
        Report
            The contents of the report.

        Raises
        ------
        RecordError
            The run has no records, a record or a map is damaged, or the folder cannot be written.
        ParameterError
            A declaration of a table is wrong, or does not fit the run; or a paper's folder has a
            checks.py and is not trusted.
        RegistryError
            There is no such paper.
        """
        from cembench.report.write_report import write_report
        from cembench.results.papers import find_paper
        from cembench.results.store import Store
        from cembench.results.verify import Depth, sound_records

        asked = find_paper(paper, trust=trust) if paper else None
        records = sound_records(Store(self.folder), Depth.everything if verify else Depth.sample)
        files = [Path(file) for file in tables]
        words = ["cembench", "report", self.folder, *(["-o", folder] if folder else [])]
        words += [word for file in files for word in ("--tables", file)]
        words += ["--paper", paper, *(["--trust"] if trust else [])] if paper else []
        target = Path(folder) if folder else self.folder / "report"
        with reporter.counting() as count:
            return write_report(
                *(self.folder, target, command or " ".join(map(str, words)), count),
                jobs=jobs,
                tables=files,
                paper=asked,
                records=records,
            )

    def status(self, *, verify: bool = False) -> RunStatus:
        """Show a run's progress, the cells that did not end ok, and files that were changed.

        Parameters
        ----------
        verify : bool
            Recompute the figures of all maps, not just of a sample.

        Returns
        -------
        RunStatus
            The state of each cell of the last request, and what is wrong with the files.

        Raises
        ------
        RecordError
            There is no such folder.
        """
        from cembench.api.run_status import status_of

        return status_of(self.folder, everything=verify)

    def show(self, cell: str) -> list[Record]:
        """Show everything that is recorded about a cell.

        Parameters
        ----------
        cell : str
            The start of a cell's key, or MESH/ALGORITHM.

        Returns
        -------
        list of Record
            The records of the cell, one for each choice of parameters and policy.

        Raises
        ------
        RecordError
            There is no run, no such cell, or its contents disagree.
        """
        from cembench.core.errors import RecordError
        from cembench.results.store import Store
        from cembench.results.verify import Depth, sound_records

        records = sound_records(Store(self.folder), Depth.records)
        names = [f"{record.cell.mesh}/{record.cell.algorithm}" for record in records]
        by_name = [r for r, name in zip(records, names, strict=True) if name == cell]
        found = by_name or [r for r in records if cell and r.cell.key.startswith(cell)]
        if not found:
            known = ", ".join(dict.fromkeys(names)) or "nothing"
            raise RecordError(f"no cell {cell!r} in this run; it holds: {known}.")
        return found

    @checked
    def export(
        self,
        output: AnyPath | None = None,
        *,
        form: Literal["csv", "parquet", "json"] = "csv",
        verify: bool = False,
    ) -> Path:
        """Write all records of a run as one table, one row per cell.

        Parameters
        ----------
        output : path, optional
            Output file (default: RUN/rows.FORMAT).
        form : str
            File format.
        verify : bool
            Recompute the figures of all maps, not just of a sample.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ParameterError
            The file is one of the run's own.
        RecordError
            There is no run, or its contents disagree.
        """
        from cembench.report.export import export_rows
        from cembench.results.columns import rows
        from cembench.results.run_folder import is_own
        from cembench.results.store import Store
        from cembench.results.verify import Depth, sound_records

        path = Path(output) if output else self.folder / f"rows.{form}"
        if is_own(self.folder, path):
            raise ParameterError(f"-o {path} is one of the run's own files; name another file.")
        depth = Depth.everything if verify else Depth.records
        export_rows(rows(sound_records(Store(self.folder), depth)), path, form)
        return path

    def _repr_html_(self) -> str:
        return str(self.table().to_html(index=False, border=0, na_rep=""))


@checked
def benchmark(
    surfaces: Iterable[SurfaceInput] = (),
    algorithms: Sequence[str] | None = None,
    *,
    profile: Literal["quick", "standard", "paper"] | None = None,
    paper: str | None = None,
    mesh_dir: Sequence[AnyPath] = (),
    sets: Sequence[str] = (),
    limit: Annotated[int, Range(1, 1_000_000)] | None = None,
    faces: Faces | None = None,
    repair: bool = False,
    parameters: Mapping[str, Any] | None = None,
    plugins: Sequence[str] = (),
    maps: Mapping[str, AnyPath] | None = None,
    precision: float | str | None = None,
    rounds: Rounds | None = None,
    max_rounds: Annotated[int, Range(LOOKS[1], LOOKS[-1])] = USUAL_MAX_ROUNDS,
    budget: float | str | None = "auto",
    pairing: Literal["auto", "separate", "process"] = "auto",
    repeat_busy: Annotated[int, Range(0, 10)] = 0,
    jobs: Annotated[int, Range(1, 256)] | None = None,
    seed: Seed = 0,
    timeout: Timeout = 600.0,
    memory_bytes: int | str | None = None,
    solves: Sequence[Solves] = ("reuse",),
    backend: Backend | None = None,
    threads: Threads = 1,
    reference: str | None = None,
    cluster: Client | str | None = None,
    same_environment: bool = False,
    part: str | None = None,
    output: AnyPath | None = None,
    fresh: bool = False,
    rerun_failed: bool = False,
    dry_run: bool = False,
    watcher: Watcher | None = None,
    reporter: Reporter = SILENT,
) -> Run:
    """Measure algorithms on surfaces, with fresh processes for every round.

    Rounds continue until the figures are precise (`precision`); wide intervals get more rounds.
    Each result is saved at once, and what the folder already holds is not measured again.
    docs/measuring.md explains what is timed and what an interval means.

    Parameters
    ----------
    surfaces : iterable of meshes, paths, names or pairs of arrays (V, F)
        V is (n, 3), F is (m, 3) and counts from 0. Surfaces given as arrays are named
        ``surface-1``, ``surface-2``, ... Names are those of generated surfaces, or of public ones,
        which are fetched.
    algorithms : sequence of str, optional
        Names of algorithms (see :func:`cembench.list_algorithms`), or all (default: ten usual ones;
        for the profile quick, the paper's own).
    profile : {"quick", "standard", "paper"}, optional
        The paper's models: the eight smallest, those up to 210,000 faces, or all twenty.
    paper : str, optional
        Run the algorithms on this paper's own models as it ran them: an installed paper, or its
        folder (default: with `profile` the paper of the profiles, else none).
    mesh_dir : sequence of paths
        All mesh files in a folder but NPZ; those that cannot be used are left out.
    sets : sequence of str
        Many surfaces: real-disks, real-holes, closed, stress, corpus, ict-faces, ict-faces-holes,
        thingi10k, a folder, or an archive. One round each, unless `rounds` or `precision` is given.
    limit : int, optional
        Maximum number of surfaces per set of `sets`.
    faces : int, optional
        Number of triangles of generated surfaces.
    repair : bool
        Repair the mesh files first, like :func:`cembench.repair`.
    parameters : mapping, optional
        Parameters of the algorithms: NAME sets it for every algorithm that has it, ALGORITHM.NAME
        for one.
    plugins : sequence of str
        Python files or ``module:name`` with more algorithms.
    maps : mapping, optional
        Maps that somebody made, as another column: the folder of each name, with one file a
        surface, which is recognised by its mesh (docs/measure.md). They have no seconds.
        NAME:disk, or another target, says what they are; else their boundaries do.
    precision : float or str, optional
        Measure until the half-width of the 95 % intervals, of the seconds and of their ratios to
        the reference, is at most this share, e.g. 5% or 0.05 (default: 5%).
    rounds : int, optional
        Fixed number of rounds for every cell; fewer than 6 give no interval.
    max_rounds : int
        Maximum number of rounds with `precision`.
    budget : float or str, optional
        Time of the run, e.g. 30m; in Python also seconds. While it lasts cells get rounds, the
        cheapest their first 7 before others; each has one. auto: 105s for the profile quick, 1h for
        standard, 4h for paper, else 30m. None in Python: no limit.
    pairing : {"auto", "separate", "process"}
        Besides a process for each cell, a round may have one that the algorithms of a surface
        share, where processes differ more than calls (process). auto: where this machine's scatter
        promises narrower ratios in the same time. Not on a cluster.
    repeat_busy : int
        Repeat a process up to so many times if the machine was busy with other work.
    jobs : int, optional
        Number of checks run in parallel; timed rounds always run alone (default: 1; with `sets`,
        the number of cores).
    seed : int
        Seed of the random order within a round.
    timeout : float
        Time limit of a call, in seconds.
    memory_bytes : int or str, optional
        Memory limit per process, e.g. 4GiB; at least 256MiB (default: 90 % of free memory).
    solves : sequence of "reuse" and "backslash"
        Reuse factorisations, factor at every solve, or both.
    backend : str, optional
        The library that factors matrices (default: cvxopt if it is installed, else superlu).
        cvxopt-metis makes smaller factors of large meshes, in more time.
    threads : int
        Threads of the numerical libraries; OpenBLAS keeps one, as its sums depend on the number.
    reference : str, optional
        Show this algorithm's speedup over the others (default: cem).
    cluster : str, optional
        Measure on local:N workers, on those of tls://HOST:PORT, or on
        slurm:KEY=VALUE,...: see docs/cluster.md. In Python also a
        ``distributed.Client``.
    same_environment : bool
        Of a cluster, leave out machines with other software.
    part : str, optional
        Measure one of several parts, e.g. 3/20, with all algorithms of a surface in the same one.
        `cembench merge` joins their folders: see docs/cluster.md.
    output : path, optional
        The run's folder; an existing run is resumed. Default in Python: a new temporary folder.
    fresh : bool
        Measure again what is already recorded.
    rerun_failed : bool
        Measure again the cells that did not end ok.
    dry_run : bool
        Plan the cells and estimate their cost; measure nothing.
    watcher : Watcher, optional
        Receives the progress of the cells.
    reporter : Reporter
        Receives what is being done.

    Returns
    -------
    Run
        The records, as rows, tables or a report.

    Raises
    ------
    MeshError
        A surface is unknown or damaged, or no algorithm takes it.
    RegistryError
        An algorithm or a surface is unknown, or a plug-in cannot be loaded.
    ParameterError
        An argument is out of range, or excludes another.
    RecordError
        The folder is not a run, or cannot be written to.
    ClusterError
        The scheduler cannot be reached, or is gone; what is finished is in the folder.

    Notes
    -----
    All errors but the last are raised before anything is measured.

    Examples
    --------
    >>> import cembench
    >>> run = cembench.benchmark(["flat-disk"], ["harmonic-circle"], rounds=1)
    >>> [record.outcome.status for record in run.records()]
    ['ok']
    """
    asked = locals()
    from cembench.api.run_plan import Sources, check_cluster, plan
    from cembench.results import run_folder
    from cembench.results.profiles import Profile
    from cembench.results.records import REFERENCE
    from cembench.running.environment import usable_cores
    from cembench.running.options import Options
    from cembench.running.plan import MeasurementSettings

    if output is not None:
        run_folder.check(Path(output))
    check_cluster(cluster, pairing, reporter)
    _check_together(asked)
    models = Profile(profile) if profile else None
    rounds = rounds or (1 if sets and precision is None else 0)
    share = None if rounds else precision_share(USUAL_PRECISION if precision is None else precision)
    of_machines = cluster is not None and memory_bytes is None
    options = Options(
        *(timeout, None if of_machines else bytes_of(memory_bytes), fresh, rerun_failed, seed),
        reference=reference or REFERENCE,
        most_rounds=max_rounds,
        budget=usual_budget(models) if budget == "auto" else budget_seconds(budget),
        pairing=pairing,
        repeat_busy=repeat_busy,
        jobs=jobs or (usable_cores() if sets else 1),
    )
    library = installed_backend(backend)
    planned = plan(
        Sources(list(surfaces), models, mesh_dir, sets, limit, faces, repair),
        algorithms,
        [MeasurementSettings(p, library, threads, rounds, share) for p in dict.fromkeys(solves)],
        options,
        output,
        parameters=parameters,
        plugins=plugins,
        maps=maps,
        paper=paper,
        part=part,
        reference=reference,
        cluster=cluster,
        reporter=reporter,
    )
    folder, cells = planned.store.folder, len(planned.tasks)
    if dry_run:
        return Run(folder, plan=planned)
    seconds = inf if rounds else options.budget or inf
    with reporter.watching(cells, seconds, on_cluster=cluster is not None) as shown:
        if reporter is SILENT and watcher is None and is_notebook():
            from cembench.api.notebook_progress import NotebookProgress

            watcher = NotebookProgress(cells)
        records = planned.measure(watcher or shown, same_environment=same_environment)
    return Run(folder, tuple(records), planned)


#: Arguments of :func:`benchmark` of which only one may be given, and why.
_EXCLUDING = (
    ("rounds", "precision", "sets the number that `precision` chooses: give only one of them"),
    ("rounds", "budget", "sets a number that `budget` does not shorten: give only one of them"),
    ("rounds", "max_rounds", "sets the number that `max_rounds` limits: give only one of them"),
    ("maps", "cluster", "are read on this machine: leave `cluster` out, and `merge` both runs"),
    ("repair", "sets", "is for single files and folders, not for `sets`: leave it out"),
)
#: Arguments that need another one.
_NEEDING = (("limit", "sets"), ("same_environment", "cluster"))


def _check_together(asked: Mapping[str, Any]) -> None:
    """Raise :class:`ParameterError` if arguments are given that do not go together."""
    usual = inspect.signature(benchmark).parameters

    def given(name: str) -> bool:
        return asked[name] not in (None, (), [], {}, usual[name].default)

    for one, other, why in _EXCLUDING:
        if given(one) and given(other):
            raise ParameterError(f"`{one}` {why}.")
    for one, other in _NEEDING:
        if given(one) and not given(other):
            raise ParameterError(f"`{one}` needs `{other}`: add one, or leave `{one}` out.")


def usual_budget(profile: Profile | None) -> float:
    """Return the seconds after which cells get no more rounds: those of the profile, if any."""
    from cembench.results.papers import usual_paper
    from cembench.running.options import USUAL_BUDGET

    return usual_paper().profiles.budgets.get(profile, USUAL_BUDGET) if profile else USUAL_BUDGET
