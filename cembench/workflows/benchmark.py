"""Benchmark algorithms on surfaces: separate processes, rounds and records."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from cembench.core.errors import ParameterError
from cembench.core.extras import Extra, require
from cembench.linear_algebra.backends import default_backend
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Registry, load_registry
from cembench.results.looks import USUAL_PRECISION
from cembench.results.record_rows import REFERENCE
from cembench.results.records import Record
from cembench.results.store import Store
from cembench.running.local import run_tasks
from cembench.running.options import DEFAULT_TIMEOUT, USUAL_BUDGET, Options
from cembench.running.pairing import Pairing
from cembench.running.plan import (
    MeasurementSettings,
    PaperRole,
    Task,
    paper_role_of,
    paper_roles,
    plan_cells,
)
from cembench.running.surfaces import SurfaceInput, is_generated, kinds_of, load_surface
from cembench.running.watcher import Watcher
from cembench.workflows.notebook import html_table

if TYPE_CHECKING:
    import pandas as pd
    from distributed import Client

    from cembench.report.document import Report


@dataclass(frozen=True)
class Run:
    """A folder of records: what `cembench run` writes and `cembench report` reads.

    Parameters
    ----------
    folder : Path
        Folder with the records and maps.

    Examples
    --------
    >>> from pathlib import Path
    >>> import cembench
    >>> cembench.Run(Path("results/run")).folder.name
    'run'

    """

    folder: Path

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
        return Store(self.folder).records()

    def table(self, reference: str = "cem") -> pd.DataFrame:
        """Return a table with one row per cell.

        Parameters
        ----------
        reference : str
            The algorithm whose speedup over the others is included.

        Returns
        -------
        pandas.DataFrame
            Figures, seconds with a 95 % interval, and status of each cell.

        Raises
        ------
        MissingExtra
            pandas is not installed; :meth:`rows` works without it.

        """
        require(Extra.TABLES, "a DataFrame")
        import pandas as pd

        return pd.DataFrame(self.rows(reference))

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
        from cembench.results.record_rows import rows

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
            One row per surface, algorithm and policy, with the interval from paired rounds; empty
            if the reference was not measured.

        """
        columns = ["mesh", "algorithm", "solves", "speedup", "speedup_low", "speedup_high"]
        table = self.table(reference)
        compared = table[table["reference"].notna()]
        return compared[[*columns, "verdict"]].reset_index(drop=True)

    def report(self, folder: str | os.PathLike[str] | None = None) -> Report:
        """Write the report, like `cembench report`.

        Parameters
        ----------
        folder : path, optional
            The report's folder; default: ``report`` in the run's folder.

        Returns
        -------
        Report
            The contents of the report.

        Raises
        ------
        MissingExtra
            A package for reports is not installed.
        RecordError
            The run has no records, or the folder cannot be written.

        """
        from cembench.report.write_report import write_report

        target = Path(folder) if folder is not None else self.folder / "report"
        command = f"cembench report {self.folder} -o {target}"
        return write_report(self.folder, target, command)

    def _repr_html_(self) -> str:
        from cembench.conformal.metrics import METRICS

        names = (
            "conformal_energy",
            "angle_error_mean_deg",
            "flipped_triangles",
            "beltrami_area_mean",
        )
        shown = [metric for metric in METRICS if metric.name in names]
        heads = ["surface", "algorithm", "status", "seconds", *(m.title for m in shown)]
        lines = []
        for row in self.rows():
            seconds = row["seconds"]
            line = [row["mesh"], row["algorithm"], row["status"]]
            line.append("" if seconds is None else f"{seconds:.3g}")
            lines.append([*line, *(m.text(row[m.name]) if m.name in row else "" for m in shown)])
        return html_table(lines, heads)


def benchmark(
    surfaces: Iterable[SurfaceInput],
    algorithms: Sequence[str] | None = None,
    *,
    precision: float = USUAL_PRECISION,
    rounds: int | None = None,
    budget: float | None = USUAL_BUDGET,
    reference: str = REFERENCE,
    out: str | os.PathLike[str] | None = None,
    parameters: Mapping[str, Any] | None = None,
    solves: Sequence[str] = ("reuse",),
    backend: str | None = None,
    threads: int = 1,
    timeout: float = DEFAULT_TIMEOUT,
    memory_bytes: int | None = None,
    seed: int = 0,
    pairing: Pairing = "auto",
    plugins: Sequence[str] = (),
    watcher: Watcher | None = None,
    cluster: Client | str | None = None,
) -> Run:
    """Benchmark algorithms on surfaces, with fresh processes for every round.

    Parameters
    ----------
    surfaces : iterable of meshes, paths, names or pairs of arrays (V, F)
        V is (n, 3), F is (m, 3) and counts from 0. Surfaces given as arrays are named
        ``surface-1``, ``surface-2``, ...
    algorithms : sequence of str, optional
        Names from :func:`cembench.list_algorithms`; default: every usual algorithm that takes at
        least one of the surfaces.
    precision : float
        Target half-width of the 95 % intervals, relative to the figure, for the seconds of each
        cell and for their ratio to the reference. Rounds continue until it is reached.
    rounds : int, optional
        Fixed number of rounds, instead of a precision; fewer than six give no interval.
    budget : float, optional
        Seconds that the run may take: the cheapest cells get their first seven rounds first, and
        one round of each is always made. None: no limit.
    reference : str
        The algorithm with which the others are compared.
    out : path, optional
        The run's folder; what it already holds is not measured again. Default: a new temporary
        folder, see :attr:`Run.folder`.
    parameters : mapping, optional
        Parameters of the algorithms: ``name`` sets it for every algorithm that has it,
        ``algorithm.name`` for one.
    solves : sequence of "reuse" and "backslash"
        The linear-algebra policies: reuse a factorisation while its matrix is unchanged, or
        factor at every solve.
    backend : str
        The library that factors matrices: cvxopt, cvxopt-metis, superlu or pardiso; default:
        cvxopt if it is installed, else superlu.
    threads : int
        Threads of the numerical libraries.
    timeout : float
        Time limit of a call, in seconds.
    memory_bytes : int, optional
        Memory limit of a process and its children, in bytes.
    seed : int
        Seed of the random order within a round.
    pairing : "auto", "separate" or "process"
        Whether the algorithms of a surface share a process in each round, besides having one each:
        ratios within a process scatter less on some machines. "auto" does where this machine's
        scatter promises narrower ratios in the same time. Not on a cluster.
    plugins : sequence of str
        Python files or ``module:name`` with more algorithms.
    watcher : Watcher, optional
        Receives progress events.
    cluster : distributed.Client or str, optional
        Measure on the workers of this client, or where ``cembench run --cluster`` would:
        ``"local:2"``, ``"tcp://HOST:8786"``. See ``docs/cluster.md``.

    Returns
    -------
    Run
        The records, as rows, tables or a report.

    Raises
    ------
    MeshError
        A surface is unknown or damaged, or no algorithm takes it.
    RegistryError
        An algorithm is unknown, or a plug-in cannot be loaded.
    ParameterError
        A parameter is unknown or out of range.
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
    registry = load_registry(plugins)
    given = list(surfaces)
    if not given:
        raise ParameterError("there is no surface to measure on; give at least one.")
    if rounds is not None and rounds < 1:
        raise ParameterError(f"rounds={rounds!r} is not allowed; write an integer of at least 1.")
    if pairing not in get_args(Pairing):
        raise ParameterError(
            f"pairing={pairing!r} is not allowed; write one of {', '.join(get_args(Pairing))}."
        )
    if pairing == "process" and cluster is not None:
        raise ParameterError('pairing="process" is for runs on this machine; leave `cluster` out.')
    if not 0 < precision < 1:
        raise ParameterError(
            f"precision={precision!r} is not allowed; write a share between 0 and 1, e.g. 0.05."
        )
    chosen = [registry.algorithm(name) for name in algorithms or registry.usual_algorithms]
    kinds = kinds_of(chosen)
    meshes: list[TriangleMesh] = []
    roles: dict[str, PaperRole] = {}
    for number, one in enumerate(given, start=1):
        mesh = load_surface(one, kinds, registry=registry)
        if isinstance(one, tuple | list):
            mesh = mesh.renamed(f"surface-{number}")
        meshes.append(mesh)
        roles[mesh.name] = _role(registry, one, mesh)
    if algorithms is None:
        chosen = [a for a in chosen if any(isinstance(mesh, a.mesh_type) for mesh in meshes)]
    tasks = []
    for policy in solves:
        goal = None if rounds is not None else precision
        settings = MeasurementSettings(
            policy, backend or default_backend(), threads, rounds or 0, goal
        )
        tasks += plan_cells(chosen, meshes, parameters or {}, settings, plugins, roles)
    folder = Path(out) if out is not None else Path(tempfile.mkdtemp(prefix="cembench-run-"))
    options = Options(
        timeout, memory_bytes, seed=seed, reference=reference, budget=budget, pairing=pairing
    )
    if cluster is None:
        run_tasks(tasks, Store(folder), options, watcher)
    else:
        _on_cluster(tasks, Store(folder), options, watcher, cluster)
    return Run(folder)


def _on_cluster(
    tasks: Sequence[Task],
    store: Store,
    options: Options,
    watcher: Watcher | None,
    cluster: Client | str,
) -> None:
    require(Extra.CLUSTER, "a run on a cluster", "dask", "distributed")
    from cembench.running.cluster.client import run_on_cluster
    from cembench.running.cluster.connect import connected, parse_cluster

    where = connected(parse_cluster(cluster)) if isinstance(cluster, str) else nullcontext(cluster)
    with where as client:
        run_on_cluster(tasks, store, client, options, watcher)


def _role(registry: Registry, given: SurfaceInput, mesh: TriangleMesh) -> PaperRole:
    """Return the row of the paper's tables that a surface is, or stands in for, if any."""
    if is_generated(given, registry):
        return paper_roles(registry, [given]).get(given, PaperRole())
    return paper_role_of(registry, mesh)
