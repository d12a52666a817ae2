"""Plan a benchmark: its surfaces, its cells, and how they are measured."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cembench.api.fetch import local_files
from cembench.api.paper_surfaces import is_kept, stand_ins
from cembench.api.sets import Gathered, exhibit_of, gathered, surfaces_of_set
from cembench.api.settings import AnyPath, registry_with
from cembench.api.surface_collections import Provided
from cembench.core.errors import MeshError, ParameterError
from cembench.core.reporter import SILENT, Reporter
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm, Registry
from cembench.results.exhibits import Exhibit, write_exhibit
from cembench.results.papers import NO_PAPER, find_paper, usual_paper
from cembench.results.profiles import Profile, algorithms_of, surfaces_of
from cembench.results.records import Record
from cembench.results.store import Store
from cembench.running.environment import usable_cores
from cembench.running.estimate import Estimate, estimate, planned_seconds
from cembench.running.external.installed import missing
from cembench.running.given_maps import given_maps
from cembench.running.local import run_tasks
from cembench.running.options import Options
from cembench.running.plan import (
    MeasurementSettings,
    Provenance,
    Task,
    comparable_groups,
    mesh_files,
    plan_cells,
    provenance_of,
    provenances,
)
from cembench.running.surfaces import (
    generate_surface,
    is_generated,
    kinds_of,
    load_file,
    load_surface,
)
from cembench.running.watcher import Watcher

if TYPE_CHECKING:
    from distributed import Client

#: Surfaces, and their roles in the paper by name.
Surfaces = tuple[list[TriangleMesh], dict[str, Provenance]]
#: Maximum number of surfaces named that cannot be measured.
MAX_NAMED = 5


@dataclass(frozen=True)
class Sources:
    """Where the surfaces of a run come from: arguments of :func:`cembench.benchmark`."""

    surfaces: Sequence[Any] = ()
    profile: Profile | None = None
    mesh_dir: Sequence[AnyPath] = ()
    sets: Sequence[str] = ()
    limit: int | None = None
    faces: int | None = None
    repair: bool = False

    def usual_algorithms(self, registry: Registry) -> Sequence[str]:
        """Return the names of the algorithms that are measured on these surfaces by default."""
        return algorithms_of(self.profile, registry) if self.profile else registry.usual_algorithms


@dataclass(frozen=True)
class Plan:
    """The cells of a run, and what each is expected to cost.

    Parameters
    ----------
    tasks : sequence of Task
        The cells with their surfaces.
    store : Store
        The run's folder.
    options : Options
        How they are measured.
    cluster : distributed.Client or str, optional
        Where they are measured; None: on this machine.
    exhibit : Exhibit, optional
        What is kept with the run of surfaces that come from sets.
    """

    tasks: Sequence[Task]
    store: Store
    options: Options
    cluster: Client | str | None = None
    exhibit: Exhibit | None = None

    def held(self) -> dict[str, str]:
        """Return the status of each cell that is recorded and not measured again, by its key."""
        records = (r for r in self._records() if not self.options.measures_again(r))
        return {record.cell.key: record.outcome.status for record in records}

    def lacking(self) -> dict[str, str]:
        """Return what this machine lacks for algorithms of the plan, by name; none on a cluster."""
        chosen = (
            {} if self.cluster is not None else {t.algorithm.name: t.algorithm for t in self.tasks}
        )
        return {name: why for name, one in chosen.items() if (why := missing(one))}

    def costs(self) -> list[Estimate | None]:
        """Return what each cell is expected to cost; None if it is recorded or cannot run."""
        records, held, lacking = self._records(), self.held(), self.lacking()
        return [
            None
            if t.cell.key in held or t.algorithm.name in lacking or t.algorithm.maps is not None
            else estimate(t.cell, t.facts.faces, records)
            for t in self.tasks
        ]

    def seconds(self, costs: Iterable[Estimate | None]) -> float:
        """Return what the run is expected to take on this machine."""
        return planned_seconds([c for c in costs if c is not None], self.options.budget)

    def summary(self) -> dict[str, Any]:
        """Return the cells with their estimates as plain data."""
        held, lacking, costs = self.held(), self.lacking(), self.costs()
        cells = [
            {
                **{k: getattr(task.cell, k) for k in ("key", "mesh", "algorithm", "solves")},
                "faces": task.facts.faces,
                "held": held.get(task.cell.key),
                "lacks": lacking.get(task.algorithm.name),
                "estimate": None if cost is None else asdict(cost),
            }
            for task, cost in zip(self.tasks, costs, strict=True)
        ]
        largest = max((cost.memory_bytes for cost in costs if cost is not None), default=0)
        return {"cells": cells, "seconds": self.seconds(costs), "memory_bytes": largest}

    def measure(self, watcher: Watcher | None, *, same_environment: bool = False) -> list[Record]:
        """Measure the cells that the folder does not hold; return the records of all."""
        if self.exhibit is not None:
            write_exhibit(self.store.folder, self.exhibit)
        if self.cluster is None:
            return run_tasks(self.tasks, self.store, self.options, watcher)
        from cembench.running.cluster.client import run_on_cluster
        from cembench.running.cluster.connect import connected, parse_cluster

        where: Any = nullcontext(self.cluster)
        if isinstance(self.cluster, str):
            place = parse_cluster(self.cluster)
            where = connected(place)
            if watcher is not None:
                watcher.shows("starting workers" if place.kind != "address" else "connecting")
        with where as client:
            return run_on_cluster(
                *(self.tasks, self.store, client, self.options, watcher),
                same_environment=same_environment,
            )

    def _records(self) -> list[Record]:
        return self.store.records() if (self.store.folder / "records").is_dir() else []


def plan(
    sources: Sources,
    algorithms: Sequence[str] | None,
    hows: Sequence[MeasurementSettings],
    options: Options,
    output: AnyPath | None = None,
    *,
    parameters: Mapping[str, Any] | None = None,
    plugins: Sequence[str] = (),
    maps: Mapping[str, AnyPath] | None = None,
    paper: str | None = None,
    part: str | None = None,
    reference: str | None = None,
    cluster: Client | str | None = None,
    reporter: Reporter = SILENT,
) -> Plan:
    """Plan the cells of a run; the arguments are those of :func:`cembench.benchmark`.

    The surfaces are read or made, and no folder is touched.
    """
    asked = find_paper(paper) if paper else usual_paper() if sources.profile else NO_PAPER
    registry = registry_with(plugins, reporter)
    chosen = chosen_algorithms(registry, algorithms, sources.usual_algorithms(registry))
    names = [algorithm.name for algorithm in chosen]
    if reference is not None and reference not in names:
        among = f"is not among the algorithms of this run: {', '.join(names)}"
        raise ParameterError(f"reference={reference!r} {among}.")
    for algorithm in chosen:
        if why := missing(algorithm):
            reporter.note(f"{algorithm.name} is not available: {why}.")
    meshes, roles, exhibit = _gathered(sources, registry, chosen, reporter)
    for called, folder in (maps or {}).items():
        taken = {*registry.algorithms, *registry.peers, *(one.name for one in chosen)}
        one, plugin = given_maps(called, Path(folder), meshes, reporter)
        if one.name in taken:
            raise ParameterError(f"maps={called}: an algorithm has this name; choose another.")
        chosen, plugins = [*chosen, one], [*plugins, plugin]
    tasks = []
    for how in hows:
        tasks += plan_cells(chosen, meshes, parameters or {}, how, plugins, roles, asked)
    tasks = part_of(tasks, part) if part else tasks
    folder = Path(output or tempfile.mkdtemp(prefix="cembench-run-"))
    return Plan(tasks, Store(folder), options, cluster, exhibit)


def _gathered(
    sources: Sources, registry: Registry, chosen: Sequence[Algorithm], reporter: Reporter
) -> tuple[list[TriangleMesh], dict[str, Provenance], Exhibit | None]:
    """Return the surfaces of a run, their roles, and an exhibit of those of sets."""
    of_profile = surfaces_of(sources.profile, registry) if sources.profile else []
    named = [*sources.surfaces, *of_profile]
    if not (named or sources.mesh_dir or sources.sets):
        raise ParameterError(
            "there is no surface to measure on; give at least one, or a `profile`, `mesh_dir` or "
            "`sets`; `cembench list surfaces` and `cembench fetch` have names."
        )
    kept = [name for name in of_profile if registry.surface(name).kept]
    new = [name for name in kept if not is_kept(registry.surface(name))]
    if new and sources.faces is None:
        stand_ins(registry, new, usable_cores(), reporter)  # to be read with the others
    with reporter.busy("reading surfaces"):
        meshes, roles = read_surfaces(
            *(named, map(Path, sources.mesh_dir), registry, chosen, reporter),
            faces=sources.faces,
            repair=sources.repair,
        )
    if sources.sets:
        many = gather_sets(sources.sets, registry, chosen, sources.limit, reporter)
        exhibit = exhibit_of(many, sources.sets, reporter.command)
        return [*meshes, *many.meshes], {**roles, **many.roles}, exhibit
    for mesh in meshes:
        for notice in mesh.notices:
            reporter.note(f"{mesh.name}: {notice}")
    return meshes, roles, None


def check_cluster(cluster: Client | str | None, pairing: str, reporter: Reporter) -> None:
    """Raise if a run cannot be made where it is asked for; warn of an open scheduler."""
    if cluster is None:
        return
    if pairing == "process":
        raise ParameterError(
            "pairing='process' is for runs on this machine; leave it out, or leave `cluster` out."
        )
    from cembench.running.cluster.connect import parse_cluster

    if not isinstance(cluster, str):
        return
    where = parse_cluster(cluster)
    where.check()
    if where.is_open:
        reporter.warn(
            f"{where.address} does not authenticate clients: anyone who can connect can run code "
            "as the users of its workers. Use tls://HOST:PORT (docs/cluster.md), or keep others "
            "off it."
        )


def part_of(tasks: Sequence[Task], part: str) -> list[Task]:
    """Return the cells of a part, such as "3/20"; cells that are compared are in the same one.

    The surfaces are dealt out by their number of triangles, so that parts take alike.
    """
    number, count = map(int, part.split("/")) if re.fullmatch(r"\d+/\d+", part) else (0, 0)
    groups = sorted(comparable_groups(tasks), key=lambda group: -group[0].facts.faces)
    if not 1 <= number <= min(count, len(groups)):
        raise ParameterError(
            f"part={part!r} is not allowed; write 3/20 for the third of twenty parts. This plan "
            f"can have up to {len(groups)}, since a surface under a policy is measured as a whole."
        )
    chosen = {task.cell.label for group in groups[number - 1 :: count] for task in group}
    return [task for task in tasks if task.cell.label in chosen]


def read_surfaces(
    named: Iterable[Any],
    folders: Iterable[Path],
    registry: Registry,
    algorithms: Sequence[Algorithm],
    reporter: Reporter,
    *,
    faces: int | None,
    repair: bool,
) -> Surfaces:
    """Read and generate the surfaces of a run.

    A file of a folder that cannot be used is left out with a note, unless all are so.
    """
    kinds = kinds_of(algorithms)

    def read(path: Path) -> TriangleMesh:
        return load_file(path, kinds, repair=repair).mesh

    meshes: list[TriangleMesh] = []
    roles: dict[str, Provenance] = {}

    def add(mesh: TriangleMesh) -> None:
        meshes.append(mesh)
        roles[mesh.name] = provenance_of(registry, mesh)

    for folder in folders:
        _add_folder(folder, read, add, reporter)
    for number, one in enumerate(named, start=1):
        if is_generated(one, registry):
            meshes.append(generate_surface(registry, one, faces))
            roles |= provenances(registry, [one])
        elif isinstance(one, str) and one in registry.datasets and not Path(one).exists():
            add(read(local_files([Path(one)], registry, reporter)[0]))
        else:
            mesh = load_surface(one, kinds, repair=repair, registry=registry)
            add(mesh.renamed(f"surface-{number}") if isinstance(one, tuple | list) else mesh)
    return meshes, roles


def _add_folder(
    folder: Path,
    read: Callable[[Path], TriangleMesh],
    add: Callable[[TriangleMesh], None],
    reporter: Reporter,
) -> None:
    """Add the surfaces of a folder's files; those that cannot be used are left out with a note."""
    refused: list[MeshError] = []
    files = mesh_files(folder)
    for path in files:
        try:
            add(read(path))
        except MeshError as error:
            refused.append(error)
            reporter.note(f"{path.name} is left out: {_first_problem(str(error))}")
    if len(refused) == len(files):
        raise refused[0]


def gather_sets(
    sets: Sequence[str],
    registry: Registry,
    algorithms: Sequence[Algorithm],
    limit: int | None,
    reporter: Reporter,
) -> Gathered:
    """Fetch and read the surfaces of sets, and note which cannot be measured."""
    offered: list[Provided] = []
    with reporter.downloads([]) as progress:
        for name in dict.fromkeys(sets):
            with reporter.busy(f"reading the surfaces of {name}"):
                offered += surfaces_of_set(name, registry, limit=limit, progress=progress)
    surfaces = gathered(offered, registry, algorithms)
    for one in surfaces.refused[:MAX_NAMED]:
        reporter.note(f"{one.name} is left out: {_first_problem(one.error)}")
    more = len(surfaces.refused) - MAX_NAMED
    if more > 0:
        reporter.note(f"{more} more are left out; the report lists them")
    if not surfaces.surfaces:
        raise ParameterError(
            f"no surface in {', '.join(sets)} is accepted by the chosen algorithms; `cembench "
            "fetch --group disks` shows whether files can be fetched."
        )
    return surfaces


def _first_problem(error: str) -> str:
    """Return the first of what may be several problems, one a line."""
    first, *more = error.splitlines() or [""]
    return f"{first} {more[0].strip()}{' ...' if len(more) > 1 else ''}" if more else first


def chosen_algorithms(
    registry: Registry, algorithms: Sequence[str] | None, usual: Sequence[str]
) -> list[Algorithm]:
    """Return the algorithms of these names; "all" and "usual" (the default) stand for several."""
    several = {"all": registry.algorithms, "usual": usual}
    names = [name for one in algorithms or ("usual",) for name in several.get(one, (one,))]
    return [registry.algorithm(name) for name in dict.fromkeys(names)]
