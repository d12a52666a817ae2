"""The command line. Exit code 0 if every cell ended ok, 1 if one did not, 2 on wrong usage.

Other codes (a closed pipe, a signal, a fault of cembench itself) are in
:mod:`cembench.commands.ending`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text

from cembench.commands import cluster as cluster_runs
from cembench.commands import cut as cut_verbs
from cembench.commands import fetch as fetch_verbs
from cembench.commands import holes as holes_verbs
from cembench.commands import map as map_verbs
from cembench.commands import morph as morph_verbs
from cembench.commands import peers as peers_verbs
from cembench.commands import publish as publish_verbs
from cembench.commands import repair as repair_verbs
from cembench.commands import report as report_verbs
from cembench.commands import reproduce as reproduce_verbs
from cembench.commands import run as run_verbs
from cembench.commands import sets as set_verbs
from cembench.commands import sign as sign_verbs
from cembench.commands import theory as theory_verbs
from cembench.commands import validate as validate_verbs
from cembench.commands.console import (
    Json,
    assignments,
    err,
    out,
    print_json,
    print_notices,
    registry_with,
    split,
)
from cembench.commands.ending import Verbs, ending
from cembench.commands.external import Command, Settings, declared_command
from cembench.commands.options import (
    Backend,
    BackendOption,
    Budget,
    Faces,
    FixedRounds,
    Fresh,
    Jobs,
    Memory,
    MostRounds,
    Pairing,
    PairingOption,
    Parameters,
    Plugins,
    Precision,
    Repair,
    RepeatBusy,
    Seed,
    Solves,
    Threads,
    Timeout,
    budget_seconds,
    installed_backend,
    memory_bytes,
    settings_of_rounds,
)
from cembench.core.errors import ParameterError
from cembench.linear_algebra.backends import default_backend
from cembench.results.looks import USUAL_MOST_ROUNDS
from cembench.results.profiles import Profile

if TYPE_CHECKING:
    from cembench.registry import Algorithm, Registry, Surface
    from cembench.report.surface_facts import SurfaceFacts
    from cembench.results.records import Record
    from cembench.results.store import Store
    from cembench.running.options import Options
    from cembench.running.plan import Task

app = typer.Typer(
    cls=Verbs,
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Benchmark conformal parameterizations of surfaces: fair, checked, repeatable.",
)


def _print_version(asked: bool) -> None:
    if asked:
        from cembench.core.version import installed_version

        out.print(f"cembench {installed_version()}")
        raise typer.Exit


@app.callback()
def _global_options(
    *,
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    """Handle the options that belong to no command."""


class Kind(StrEnum):
    """The kinds of things that `list` lists."""

    algorithms = "algorithms"
    surfaces = "surfaces"


@app.command(
    "list",
    epilog="Examples:  cembench list  ·  cembench list algorithms --verbose  ·  "
    "cembench list surfaces --measure  ·  cembench list --plugin mine.py",
)
def list_(
    kind: Annotated[Kind | None, typer.Argument(help="List only these.")] = None,
    *,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Show all details.")] = False,
    measure: Annotated[
        bool,
        typer.Option("--measure", help="Measure the stand-ins not yet measured (takes minutes)."),
    ] = False,
    plugin: Plugins = [],  # noqa: B006 - typer copies defaults
    as_json: Json = False,
) -> None:
    """List the algorithms and surfaces.

    `list surfaces` also describes the stand-ins for the paper's models: their
    counts, whether these match the printed ones, how unevenly CEM scales
    them, and where their thumbnails are. Only stand-ins that were measured are
    shown; --measure measures the others.
    """
    from cembench.report.listings import algorithms_table, surfaces_table

    registry = registry_with(plugin)
    if measure and kind is not Kind.surfaces:
        raise ParameterError("--measure is only for surfaces: cembench list surfaces --measure.")
    facts = _facts(registry, measure=measure) if kind is Kind.surfaces else {}
    if as_json:
        print_json(_registry_as_json(registry, kind, facts))
        return
    if kind in (None, Kind.algorithms):
        out.print(algorithms_table(list(registry.algorithms.values()), verbose=verbose))
        if registry.peers:
            words = f"\nSolvers by others (see `cembench peers`): {', '.join(registry.peers)}"
            out.print(words, style="dim")
    if kind is None:
        out.print()
    if kind in (None, Kind.surfaces):
        out.print(surfaces_table(list(registry.surfaces.values()), verbose=verbose))
    if facts:
        from cembench.report.surface_facts import facts_table

        known = {name: found for name, found in facts.items() if found}
        if known:
            out.print()
            out.print(facts_table(known))
        missing = len(facts) - len(known)
        if missing:
            out.print(
                f"\n{missing} of {len(facts)} stand-ins are not measured yet: "
                "run `cembench list surfaces --measure` (takes minutes).",
                style="dim",
            )


app.command("map", epilog=map_verbs.EXAMPLES)(map_verbs.map_)


@app.command(
    epilog="Examples:  cembench run --profile quick --dry-run  ·  "
    "cembench run --mesh a.obj -a cem,lscm --solves reuse,backslash  ·  "
    "cembench run --surfaces spherical-cap -o results/cap --json  ·  "
    "cembench run --set real-disks -a all --limit 20",
)
def run(
    *,
    profile: Annotated[
        Profile | None,
        typer.Option(
            help="The paper's models: the smallest, those up to a number of faces, or all."
        ),
    ] = None,
    mesh: Annotated[list[Path], typer.Option("--mesh", help="A mesh file. Repeatable.")] = [],  # noqa: B006
    mesh_dir: Annotated[
        list[Path],
        typer.Option("--mesh-dir", help="All mesh files in a folder but NPZ. Repeatable."),
    ] = [],  # noqa: B006
    dataset: Annotated[
        list[str], typer.Option("--dataset", help="Public surfaces (see `fetch`), comma-separated.")
    ] = [],  # noqa: B006
    surfaces: Annotated[
        list[str], typer.Option("--surfaces", help="Generated surfaces, comma-separated.")
    ] = [],  # noqa: B006
    faces: Faces = None,
    sets: Annotated[
        list[str],
        typer.Option(
            "--set",
            help="Many surfaces: real-disks, real-holes, closed, stress, ict-faces, "
            "ict-faces-holes, thingi10k, a folder, or an archive. One round each, unless --rounds "
            "or --precision is given. Repeatable.",
        ),
    ] = [],  # noqa: B006
    limit: Annotated[
        int | None, typer.Option(min=1, max=1_000_000, help="Surfaces of each --set, at most.")
    ] = None,
    algorithms: Annotated[
        list[str],
        typer.Option(
            "-a",
            "--algorithms",
            help="Comma-separated, or all. Default: the usual ones (see `cembench list`), or the "
            "paper's own for `--profile quick`.",
        ),
    ] = [],  # noqa: B006
    parameter: Parameters = [],  # noqa: B006
    plugin: Plugins = [],  # noqa: B006
    command: Command = None,
    program: Settings = [],  # noqa: B006
    precision: Precision = None,
    rounds: FixedRounds = None,
    max_rounds: MostRounds = USUAL_MOST_ROUNDS,
    budget: Budget = None,
    pairing: PairingOption = Pairing.auto,
    repeat_busy: RepeatBusy = 0,
    jobs: Jobs = None,
    seed: Seed = 0,
    timeout: Timeout = 600.0,
    memory: Memory = None,
    solves: Annotated[
        list[str], typer.Option("--solves", help="reuse, backslash, or both, comma-separated.")
    ] = ["reuse"],  # noqa: B006
    backend: BackendOption = Backend(default_backend()),  # noqa: B008
    threads: Threads = 1,
    reference: Annotated[
        str | None,
        typer.Option(help="Show this algorithm's speedup over the others (default: cem)."),
    ] = None,
    cluster: cluster_runs.Cluster = None,
    same_environment: cluster_runs.SameEnvironment = False,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="The run's folder; an existing run is resumed.")
    ] = Path("results/run"),
    mend: Repair = False,
    fresh: Fresh = False,
    rerun_failed: Annotated[
        bool, typer.Option("--rerun-failed", help="Measure again the cells that did not end ok.")
    ] = False,
    dry_run: Annotated[
        bool,
        typer.Option(
            "--dry-run", help="Print the cells and their estimated cost; measure nothing."
        ),
    ] = False,
    as_json: Json = False,
) -> None:
    """Measure algorithms on surfaces, with fresh processes for every round.

    Rounds continue until the figures are precise (--precision); wide intervals
    get more rounds. Each result is saved at once, and what the folder already
    holds is not measured again. -p NAME=VALUE sets a parameter of all algorithms
    that have it, -p ALGORITHM.NAME=VALUE of one. docs/measuring.md explains what
    is timed and what an interval means.
    """
    from cembench.commands.progress import run_with_progress
    from cembench.results import run_folder
    from cembench.results.profiles import algorithms_of, surfaces_of
    from cembench.results.record_rows import REFERENCE
    from cembench.results.store import Store
    from cembench.running.environment import usable_cores
    from cembench.running.options import Options
    from cembench.running.plan import MeasurementSettings, gather_surfaces, mesh_files, plan_cells

    run_folder.check(output)
    machines = cluster_runs.place_of(cluster, same_environment=same_environment)
    if machines is not None and pairing is Pairing.process:
        raise ParameterError(
            "--pairing process is for runs on this machine; leave it out, or leave --cluster out."
        )
    policies = _policies(solves)
    one_round = bool(sets) and rounds is None and precision is None
    repeats, share = settings_of_rounds(1 if one_round else rounds, precision)
    options = Options(
        timeout,
        None if machines and memory is None else memory_bytes(memory),
        fresh,
        rerun_failed,
        seed,
        reference=reference or REFERENCE,
        most_rounds=max_rounds,
        budget=budget_seconds(budget, profile),
        pairing=pairing.value,
        repeat_busy=repeat_busy,
        jobs=jobs or (usable_cores() if sets else 1),
    )
    declared, named = declared_command(command, program)
    plugin = [*plugin, *declared]
    registry = registry_with(plugin)
    usual = algorithms_of(profile, registry) if profile else registry.usual_algorithms
    asked = split(algorithms)
    if asked == ["all"]:
        asked = list(registry.algorithms)
    wanted = dict.fromkeys([*(asked or usual), *named])
    chosen = [registry.algorithm(name) for name in wanted]
    _check_reference(reference, chosen)
    files = [*mesh, *(file for folder in mesh_dir for file in mesh_files(folder))]
    files += [fetch_verbs.fetched(registry.dataset(name)) for name in split(dataset)]
    generated = [*(surfaces_of(profile, registry) if profile else []), *split(surfaces)]
    if not files and not generated and not sets:
        raise ParameterError(
            "no surface to run on: name a --profile, or at least one --mesh FILE, --dataset NAME "
            "(see `cembench fetch`), --set NAME or --surfaces NAME (see `cembench list surfaces`)."
        )
    if limit is not None and not sets:
        raise ParameterError("--limit needs --set: add --set NAME, or leave --limit out.")
    if mend and sets:
        raise ParameterError(
            "--repair works with --mesh and --mesh-dir: repair the files of a set with "
            "`cembench repair`, or leave it out."
        )
    with err.status("reading surfaces", spinner="line"):
        found, standing = gather_surfaces(registry, chosen, files, generated, faces, mend=mend)
    many = set_verbs.gather(sets, registry, chosen, limit) if sets else None
    if many is not None:
        found, standing = [*found, *many.meshes], {**standing, **many.roles}
    tasks = []
    given = assignments(parameter)
    for policy in policies:
        how = MeasurementSettings(policy, installed_backend(backend), threads, repeats, share)
        tasks += plan_cells(chosen, found, given, how, plugin, standing)
    if dry_run:
        on_cluster = machines is not None
        _present_plan(tasks, Store(output), options, as_json=as_json, on_cluster=on_cluster)
        return
    if many is not None:
        set_verbs.write_set_exhibit(output, many, sets)
    elif not as_json:
        print_notices(found)
    if machines is None:
        records = run_with_progress(tasks, Store(output), options)
    else:
        records = cluster_runs.measure(
            *(tasks, Store(output), options, machines),
            faces=faces,
            same_environment=same_environment,
        )
    _present(records, as_json=as_json, where=output, reference=reference)


#: How `doctor` marks what is not ok, by whether it is required.
_MARKS = {True: ("bad", "bold red"), False: ("--", "yellow")}


@app.command(epilog="Example:  cembench doctor --json")
def doctor(*, as_json: Json = False) -> None:
    """Check the installation, and say how to install what is missing."""
    from cembench.workflows.doctor import examine

    with err.status("checking", spinner="line"):
        findings = examine()
    if as_json:
        print_json([asdict(finding) for finding in findings])
    else:
        for finding in findings:
            mark = ("ok", "green") if finding.ok else _MARKS[finding.required]
            line = Text.assemble(mark).append(" " * (4 - len(mark[0])))
            out.print(line.append(f"{finding.name:<11}{finding.detail}"), soft_wrap=True)
            if not finding.ok:
                out.print(f"    {'':<11}{finding.remedy}", style="dim", soft_wrap=True)
    if any(finding.required and not finding.ok for finding in findings):
        raise typer.Exit(1)


#: Modules that hold the other commands.
_MORE = (
    reproduce_verbs,
    run_verbs,
    report_verbs,
    publish_verbs,
    sign_verbs,
    validate_verbs,
    holes_verbs,
    theory_verbs,
    morph_verbs,
    fetch_verbs,
    repair_verbs,
    cut_verbs,
    peers_verbs,
)
for verb, example in (entry for module in _MORE for entry in module.VERBS):
    app.command(epilog=example)(verb)


def _check_reference(reference: str | None, chosen: Sequence[Algorithm]) -> None:
    names = [algorithm.name for algorithm in chosen]
    if reference is not None and reference not in names:
        raise ParameterError(
            f"--reference {reference!r} is not among the algorithms of this run: "
            f"{', '.join(names)}."
        )


def _present(records: list[Record], *, as_json: bool, where: Path, reference: str | None) -> None:
    from cembench.report.content.evidence import Evidence
    from cembench.report.content.many import MANY
    from cembench.report.run_tables import (
        machine_lines,
        many_table,
        results_table,
        speedups_table,
    )
    from cembench.results.outliers import outlier_lines
    from cembench.results.record_rows import REFERENCE, rows
    from cembench.results.store import Store

    reference = reference or REFERENCE
    suspects = [Text(f"! {line}", style="yellow") for line in outlier_lines(records)]
    evidence = Evidence(Store(where), tuple(records), ())
    if as_json:
        print_json(rows(records, reference))
    elif len({record.cell.mesh_hash for record in records}) > MANY:
        out.print(many_table(records))
        for words in (*machine_lines(evidence.machines), *suspects):
            out.print(words)
        out.print(f"\nRecords and maps: {where.resolve()}", soft_wrap=True)
        out.print(f"Pictures and profiles: cembench report {where}", soft_wrap=True)
    else:
        out.print(results_table(evidence))
        speedups = speedups_table(records, reference)
        if speedups is not None:
            out.print("", speedups, sep="\n")
        for words in suspects:
            out.print(words)
        out.print(f"\nRecords and maps: {where.resolve()}", soft_wrap=True)
    if any(record.outcome.status != "ok" for record in records):
        raise typer.Exit(1)


def _present_plan(
    tasks: Sequence[Task],
    store: Store,
    options: Options,
    *,
    as_json: bool,
    on_cluster: bool = False,
) -> None:
    """Print which cells would be measured, and their estimated cost."""
    from cembench.commands.progress import duration
    from cembench.report.run_tables import plan_table
    from cembench.running.estimate import estimate, planned_seconds

    records = store.records() if (store.folder / "records").is_dir() else []
    held = {r.cell.key: r.outcome.status for r in records if not options.measures_again(r)}
    lines = [
        (
            task.cell,
            task.facts.faces,
            None if task.cell.key in held else estimate(task.cell, task.facts.faces, records),
        )
        for task in tasks
    ]
    costs = [cost for _, _, cost in lines if cost is not None]
    seconds = planned_seconds(costs, options.budget)
    largest = max((cost.memory_bytes for cost in costs), default=0)
    each = [cost for _, _, cost in lines]
    hours = cluster_runs.hours(tasks, each, options.budget) if on_cluster else None
    if as_json:
        cells = [
            {
                "key": cell.key,
                "mesh": cell.mesh,
                "algorithm": cell.algorithm,
                "solves": cell.solves,
                "faces": faces,
                "held": held.get(cell.key),
                "estimate": None if cost is None else asdict(cost),
            }
            for cell, faces, cost in lines
        ]
        more = {"cluster": hours} if hours else {}
        print_json({"cells": cells, "seconds": seconds, "memory_bytes": largest} | more)
        return
    shown = [
        (cell, faces, cost.basis if cost else f"recorded: {held[cell.key]}", cost)
        for cell, faces, cost in lines
    ]
    out.print(plan_table(shown))
    rough = (
        " (rough: few similar cells were measured here before)"
        if any(cost.basis == "rough" for cost in costs)
        else ""
    )
    out.print(
        f"\n{len(costs)} of {len(tasks)} cells to measure: about {duration(seconds)}, "
        f"{largest / 2**30:.1f} GiB at most{rough}"
    )
    if hours:
        cluster_runs.show_hours(hours)


def _policies(given: list[str]) -> list[str]:
    names = list(dict.fromkeys(split(given)))
    for name in names:
        if name not in [policy.value for policy in Solves]:
            raise ParameterError(
                f"--solves {name!r} is unknown; allowed: reuse, backslash, or reuse,backslash."
            )
    return names or [Solves.reuse.value]


def _facts(registry: Registry, *, measure: bool) -> dict[str, SurfaceFacts | None]:
    """Return the recorded facts of each kept surface; with `measure`, find the missing ones."""
    from cembench.report.surface_facts import find_facts, kept_facts

    families = [family for family in registry.surfaces.values() if family.kept]
    facts = {family.name: kept_facts(registry, family) for family in families}
    todo = [family for family in families if measure and facts[family.name] is None]
    for k, family in enumerate(todo, start=1):
        words = f"[{k}/{len(todo)}] {family.name}"
        if not err.is_terminal:
            err.print(words)
        with err.status(f"{words}: making, mapping, drawing", spinner="line"):
            facts[family.name] = find_facts(registry, family)
    return facts


def _registry_as_json(
    registry: Registry, kind: Kind | None, facts: Mapping[str, SurfaceFacts | None]
) -> dict[str, Any]:
    from cembench.report.surface_facts import row_check

    def about(registered: Any) -> dict[str, Any]:
        return {
            "name": registered.name,
            "title": registered.title,
            "source": registered.source,
            "parameters": {p.name: p.default for p in registered.parameters},
            "notes": registered.notes,
            "origin": registered.origin,
        }

    def about_algorithm(a: Algorithm) -> dict[str, Any]:
        more = {"target": a.target, "takes": a.mesh_type.__name__}
        return about(a) | more | {"usual": a.usual, "conformal": a.conformal}

    def about_surface(s: Surface) -> dict[str, Any]:
        known = facts.get(s.name)
        more = {"paper_row": s.paper_row or None, "landmarks": s.landmarks is not None}
        if known is None:
            return about(s) | more | {"facts": None}
        flat = known.mesh.model_dump() | known.model_dump(exclude={"mesh"})
        return about(s) | more | {"facts": flat | {"table2": row_check(known.mesh)}}

    listed: dict[str, Any] = {}
    if kind in (None, Kind.algorithms):
        listed["algorithms"] = [about_algorithm(a) for a in registry.algorithms.values()]
    if kind in (None, Kind.surfaces):
        listed["surfaces"] = [about_surface(s) for s in registry.surfaces.values()]
    return listed


def main() -> None:
    """Run the command line; :mod:`cembench.commands.ending` chooses the exit code."""
    with ending():
        app()


if __name__ == "__main__":
    main()
