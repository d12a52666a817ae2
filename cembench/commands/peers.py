"""The command `peers`: compare our algorithms with libraries and programs by others."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from cembench.api.benchmark import benchmark
from cembench.api.settings import registry_with
from cembench.commands.app import app
from cembench.commands.console import SHOWN, Json, fail, failures, out, print_json, split
from cembench.commands.external import Command, Settings, declared_command
from cembench.commands.from_api import Call, from_api
from cembench.commands.options import Meshes, OutputRun, Surfaces

if TYPE_CHECKING:
    from cembench.registry import Algorithm, Registry
    from cembench.results.records import Record

#: Our algorithms for disks in the comparison; of other targets, all are included.
DISKS = ("cem", "direct-cem", "harmonic-circle")


@app.command(
    epilog="Examples:  cembench peers  ·  cembench peers --mesh face.obj -o results/peers  ·  "
    "cembench peers --command './mine {input} {output}' --program target=atlas"
)
@from_api(
    benchmark,
    only=("algorithms", "mesh_dir", "faces", "plugins", "rounds", "timeout", "memory_bytes"),
    defaults={"faces": 5000, "rounds": 1, "timeout": 120.0},
)
def peers(
    call: Call,
    *,
    surfaces: Surfaces = [],  # noqa: B006 - typer copies defaults
    mesh: Meshes = [],  # noqa: B006
    command: Command = None,
    program: Settings = [],  # noqa: B006
    output: OutputRun = Path("results/peers"),
    as_json: Json = False,
) -> None:
    """Compare our algorithms with installed libraries and programs by others, and report.

    Peers that are not installed are listed with how to install them. Each cell
    gets one round, which takes minutes; --repeats 6 gives intervals. A peer that
    fails or maps badly is a result: the exit code is 1 only if one of our
    algorithms fails.
    """
    from cembench.commands.report import drawing_jobs
    from cembench.core import folders
    from cembench.results import run_folder
    from cembench.results.columns import rows
    from cembench.running.external.installed import missing
    from cembench.validation.surfaces import USUAL_DISKS

    run_folder.check(output)
    folders.check(output / "report", "report")
    keywords = call.keywords
    declared, named = declared_command(command, program)
    plugins = [*keywords["plugins"], *declared]
    registry = registry_with(plugins, SHOWN)
    asked = list(keywords["algorithms"] or ())
    wanted = [registry.algorithm(name) for name in [*asked, *named]]
    chosen = wanted if asked else [*_usual(registry), *wanted]
    lacking = {a.name: why for a in chosen if (why := missing(a))}
    measured = call(
        [*mesh, *(split(surfaces) or ([] if mesh or keywords["mesh_dir"] else USUAL_DISKS))],
        algorithms=[a.name for a in chosen if a.name not in lacking],
        plugins=plugins,
        pairing="separate",
        budget=None,
        output=output,
        reporter=SHOWN,
    )
    records = measured.asked
    folder = output / "report"
    measured.report(command=f"cembench peers -o {output}", jobs=drawing_jobs(), reporter=SHOWN)
    if as_json:
        page = str(folder / "index.html")
        print_json({"cells": rows(records), "not_here": lacking, "report": page})
    else:
        _show(output, records, lacking)
        out.print(f"Report: {(folder / 'index.html').resolve()}", soft_wrap=True, markup=False)
    fail(failures(r for r in records if r.external is None))


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
