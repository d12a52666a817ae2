"""The command `peers`: compare our algorithms with libraries and programs by others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cembench.commands.console import Json, complain, err, out, print_json, registry_with, split
from cembench.commands.ending import resumable
from cembench.commands.external import Command, Settings, declared_command
from cembench.commands.options import MOST_FACES, Memory, Plugins, Repeats, Timeout, memory_bytes

if TYPE_CHECKING:
    from cembench.registry import Algorithm, Registry
    from cembench.results.records import Record

#: Default surfaces, and their number of triangles.
USUAL = (
    "hemi-ellipsoid",
    "catenoid-sheet",
    "cylinder-sheet",
    "cone",
    "cowboy-hat-stand-in",
    "nefertiti-stand-in",
)
FACES = 5000
#: Our algorithms for disks in the comparison; of other targets, all are included.
DISKS = ("cem", "direct-cem", "harmonic-circle")


def peers(
    *,
    mesh: Annotated[list[Path], typer.Option("--mesh", help="A mesh file. Repeatable.")] = [],  # noqa: B006 - typer copies defaults
    mesh_dir: Annotated[
        list[Path], typer.Option("--mesh-dir", help="All mesh files in a folder.")
    ] = [],  # noqa: B006
    surfaces: Annotated[
        list[str], typer.Option("--surfaces", help="Generated surfaces, comma-separated.")
    ] = [],  # noqa: B006
    faces: Annotated[
        int, typer.Option(min=24, max=MOST_FACES, help="Number of triangles of generated surfaces.")
    ] = FACES,
    algorithms: Annotated[
        list[str],
        typer.Option(
            "-a", "--algorithms", help="Algorithms and peers, comma-separated (default: all)."
        ),
    ] = [],  # noqa: B006
    plugin: Plugins = [],  # noqa: B006
    command: Command = None,
    program: Settings = [],  # noqa: B006
    repeats: Repeats = 1,
    timeout: Timeout = 120.0,
    memory: Memory = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="The run's folder; an existing run is resumed.")
    ] = Path("results/peers"),
    as_json: Json = False,
) -> None:
    """Compare our algorithms with installed libraries and programs by others, and report.

    Peers that are not installed are listed with how to install them. Each cell
    gets one round, which takes minutes; --repeats 6 gives intervals. A peer that
    fails or maps badly is a result: the exit code is 1 only if one of our
    algorithms fails.
    """
    from cembench.commands.progress import progress_on
    from cembench.commands.report import make_report
    from cembench.core import folders
    from cembench.results import run_folder
    from cembench.results.record_rows import rows
    from cembench.results.store import Store
    from cembench.running.external.present import missing
    from cembench.running.local import run_tasks
    from cembench.running.options import Options
    from cembench.running.plan import MeasurementSettings, gather_surfaces, mesh_files, plan_cells

    run_folder.check(output)
    folders.check(output / "report", "report")
    declared, named = declared_command(command, program)
    plugins = [*plugin, *declared]
    registry = registry_with(plugins)
    wanted = [registry.algorithm(name) for name in [*split(algorithms), *named]]
    chosen = wanted if split(algorithms) else [*_usual(registry), *wanted]
    lacking = {a.name: why for a in chosen if (why := missing(a))}
    chosen = [a for a in chosen if a.name not in lacking]
    files = [*mesh, *(file for folder in mesh_dir for file in mesh_files(folder))]
    generated = split(surfaces) or ([] if files else list(USUAL))
    with err.status("reading surfaces", spinner="line"):
        found, standing = gather_surfaces(registry, chosen, files, generated, faces)
    how = MeasurementSettings(repeats=repeats)
    tasks = plan_cells(chosen, found, {}, how, plugins, standing)
    options = Options(timeout=timeout, memory_bytes=memory_bytes(memory))
    with resumable(), progress_on(err, len(tasks)) as progress:
        records = run_tasks(tasks, Store(output), options, progress)
    _, folder = make_report(output, None, f"cembench peers -o {output}")
    if as_json:
        page = str(folder / "index.html")
        print_json({"cells": rows(records), "not_here": lacking, "report": page})
    else:
        _show(output, records, lacking)
        out.print(f"Report: {(folder / 'index.html').resolve()}", soft_wrap=True, markup=False)
    ours = [r for r in records if r.external is None and r.outcome.status != "ok"]
    for record in ours:
        name = f"{record.cell.mesh} / {record.cell.algorithm}"
        complain(f"{name}: {record.outcome.status}: {record.outcome.cause}")
    if ours:
        raise typer.Exit(1)


def _usual(registry: Registry) -> list[Algorithm]:
    """Return our algorithms in the comparison, and the peers."""
    targets = {peer.target for peer in registry.peers.values()} - {"disk"}
    ours = [registry.algorithms[name] for name in DISKS if name in registry.algorithms]
    ours += [a for a in registry.algorithms.values() if a.target in targets]
    return [*ours, *registry.peers.values()]


def _show(output: Path, records: Sequence[Record], lacking: dict[str, str]) -> None:
    from cembench.report.content.evidence import Evidence
    from cembench.report.run_tables import peers_tables
    from cembench.results.store import Store

    out.print(peers_tables(Evidence(Store(output), tuple(records), ())))
    for name, why in lacking.items():
        out.print(f"{name} is not available: {why}.", style="dim", markup=False, soft_wrap=True)


#: Each command with the examples in its help.
VERBS = (
    (
        peers,
        "Examples:  cembench peers  ·  cembench peers --mesh face.obj -o results/peers  ·  "
        "cembench peers --command './mine {input} {output}' --program target=atlas",
    ),
)
