"""Runs on a cluster: what ``run --cluster`` starts, shows and estimates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cembench.commands.console import err, out
from cembench.commands.ending import resumable

if TYPE_CHECKING:
    from cembench.results.records import Record
    from cembench.results.store import Store
    from cembench.running.cluster.connect import ClusterPlace
    from cembench.running.estimate import Estimate
    from cembench.running.local import Options
    from cembench.running.plan import Task

Cluster = Annotated[
    str | None,
    typer.Option(
        "--cluster",
        help="Measure on local:N workers, on those of tcp://HOST:PORT, or on "
        "slurm:partition=cpu,cores=16,machines=10: see docs/cluster.md.",
    ),
]
SameEnvironment = Annotated[
    bool,
    typer.Option(
        "--same-environment", help="Of a cluster, leave out machines with other software."
    ),
]
#: For so many machines hours are estimated.
ESTIMATED_FOR = (1, 10, 100)


def place_of(given: str | None, *, same_environment: bool) -> ClusterPlace | None:
    """Parse ``--cluster`` before anything else; return None without it.

    Raises
    ------
    ParameterError
        It cannot be read, or ``--same-environment`` stands alone.
    MissingExtra
        dask is not installed.

    """
    from cembench.core.errors import ParameterError
    from cembench.core.extras import Extra, require
    from cembench.running.cluster.connect import parse_cluster

    if given is None:
        if same_environment:
            raise ParameterError("--same-environment is of --cluster: name one, or leave it out.")
        return None
    where = parse_cluster(given)
    needed = ["dask", "distributed", *(["dask_jobqueue"] if where.kind == "slurm" else [])]
    require(Extra.CLUSTER, "--cluster", *needed)
    return where


def measure(
    tasks: Sequence[Task],
    store: Store,
    options: Options,
    where: ClusterPlace,
    *,
    faces: int | None,
    same_environment: bool,
) -> list[Record]:
    """Run the tasks on a cluster, with a live table on a terminal."""
    from cembench.commands.progress import progress_on
    from cembench.running.cluster.client import run_on_cluster
    from cembench.running.cluster.connect import connected

    with resumable(), progress_on(err, len(tasks), on_cluster=True) as progress:
        progress.shows("starting workers" if where.kind != "address" else "connecting")
        with connected(where) as client:
            return run_on_cluster(
                tasks,
                store,
                client,
                options,
                progress,
                faces=faces,
                same_environment=same_environment,
            )


def hours(
    tasks: Sequence[Task], costs: Sequence[Estimate | None], budget: float | None
) -> dict[str, Any]:
    """Return the hours that so many machines would take, and what limits them.

    Returns
    -------
    dict
        ``seconds`` by number of machines; ``units``, how many there are; ``longest``, the surface
        whose unit takes longest, and its seconds.

    """
    from cembench.running.cluster.units import grouped, makespan
    from cembench.running.estimate import planned_seconds

    known = {t.cell.label: cost for t, cost in zip(tasks, costs, strict=True) if cost is not None}
    groups = grouped([task for task in tasks if task.cell.label in known])
    found = {}
    priced = [[known[t.cell.label] for t in group] for group in groups]
    whole = sum(one.seconds for group in priced for one in group)
    for machines in ESTIMATED_FOR:
        share = None if budget is None else budget * machines / (whole or 1.0)
        seconds = [
            planned_seconds(g, None if share is None else share * sum(one.seconds for one in g))
            for g in priced
        ]
        found[machines] = makespan(seconds, machines) if seconds else 0.0
    longest = max(zip(seconds, groups, strict=True), key=lambda one: one[0], default=None)
    return {
        "seconds": found,
        "units": len(groups),
        "longest": None if longest is None else longest[1][0].cell.mesh,
        "longest_seconds": None if longest is None else longest[0],
    }


def show_hours(found: dict[str, Any]) -> None:
    """Print what :func:`hours` found."""
    from cembench.commands.progress import duration

    for machines, seconds in found["seconds"].items():
        longest = found["longest_seconds"] or 0.0
        limit = (
            f": no less than {found['longest']} takes"
            if machines > 1 and seconds <= 1.01 * longest
            else ""
        )
        name = "machine " if machines == 1 else "machines"
        out.print(f"{machines:>6} {name}  about {duration(seconds)}{limit}", soft_wrap=True)
    out.print(
        f"{found['units']} surfaces with a policy travel, each to one machine; the longest takes "
        f"about {duration(found['longest_seconds'] or 0.0)}.",
        soft_wrap=True,
    )
