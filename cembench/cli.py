"""The command line. Exit code 0 if every asked cell ended ok, 1 if one did not, 2 on bad usage."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn
from rich.progress import TimeElapsedColumn as Elapsed

from cembench.errors import CembenchError, ParameterError

if TYPE_CHECKING:
    from cembench.geometry.mesh import TriangleMesh
    from cembench.records import Record
    from cembench.registry import Algorithm, Registry
    from cembench.running.plan import Task
    from cembench.store import Store

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Benchmark conformal parameterizations of surfaces: fair, checked, repeatable.",
)
out = Console(highlight=False)
err = Console(stderr=True, highlight=False)

Json = Annotated[bool, typer.Option("--json", help="Print JSON on standard output.")]
Plugins = Annotated[
    list[str],
    typer.Option("--plugin", help="FILE.py or module:name with more algorithms. Repeatable."),
]
Parameters = Annotated[
    list[str],
    typer.Option("-p", "--parameter", metavar="NAME=VALUE", help="Set a parameter. Repeatable."),
]
Threads = Annotated[int, typer.Option(min=1, help="Threads of the numerical libraries.")]
Timeout = Annotated[float, typer.Option(min=0.1, help="Seconds that a cell may take.")]


class Solves(StrEnum):
    """Keep a factor while its matrix stands, or factor at every solve like MATLAB's backslash."""

    reuse = "reuse"
    backslash = "backslash"


class Backend(StrEnum):
    """The library that factors."""

    cvxopt = "cvxopt"
    superlu = "superlu"
    pardiso = "pardiso"


class Kind(StrEnum):
    """What `list` lists."""

    algorithms = "algorithms"
    surfaces = "surfaces"


SolvesOption = Annotated[Solves, typer.Option(help="Keep factors, or factor at every solve.")]
BackendOption = Annotated[Backend, typer.Option(help="The library that factors matrices.")]


@app.command(
    "list",
    epilog="Examples:  cembench list  ·  cembench list algorithms --verbose  ·  "
    "cembench list --plugin mine.py",
)
def list_(
    kind: Annotated[Kind | None, typer.Argument(help="Only these.")] = None,
    *,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Say all about each.")] = False,
    plugin: Plugins = [],  # noqa: B006 - typer copies defaults
    as_json: Json = False,
) -> None:
    """Which algorithms and surfaces are there?"""
    from cembench.registry import load_registry
    from cembench.reporting.terminal import algorithms_table, surfaces_table

    registry = load_registry(plugin)
    if as_json:
        _print_json(_registry_as_json(registry, kind))
        return
    if kind in (None, Kind.algorithms):
        out.print(algorithms_table(list(registry.algorithms.values()), verbose=verbose))
    if kind is None:
        out.print()
    if kind in (None, Kind.surfaces):
        out.print(surfaces_table(list(registry.surfaces.values()), verbose=verbose))


@app.command(
    "map",
    epilog="Examples:  cembench map face.obj -o face_uv.obj --preview  ·  "
    "cembench map face.ply -a cem -p max_iterations=13 --json",
)
def map_(
    mesh: Annotated[Path, typer.Argument(help="Surface: OBJ, OFF, PLY or STL.")],
    *,
    algorithm: Annotated[str, typer.Option("-a", "--algorithm", help="See `list`.")] = "cem",
    parameter: Parameters = [],  # noqa: B006
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Surface with UVs: OBJ or PLY.")
    ] = None,
    preview: Annotated[
        bool, typer.Option("--preview", help="Draw a PNG, beside the output.")
    ] = False,
    plugin: Plugins = [],  # noqa: B006
    solves: SolvesOption = Solves.reuse,
    backend: BackendOption = Backend.cvxopt,
    threads: Threads = 1,
    timeout: Timeout = 600.0,
    as_json: Json = False,
) -> None:
    """Map one surface, check the map, and write it.

    The UVs are the map itself (the unit disk for target "disk"), with 17 significant digits.
    """
    from cembench.geometry.files import check_writable_format, write_mesh
    from cembench.registry import load_registry
    from cembench.reporting.frame import row
    from cembench.reporting.terminal import figures_table
    from cembench.running.local import run_tasks
    from cembench.running.plan import How, plan_cells, read_mesh_for

    chosen = load_registry(plugin).algorithm(algorithm)
    if output is not None:
        check_writable_format(output, with_uv=True)
    with err.status("reading", spinner="line"):
        surface = read_mesh_for(mesh, [chosen])
    how = How(solves.value, _installed(backend), threads, repeats=1)
    tasks = plan_cells([chosen], [surface], _assignments(parameter), how, plugin)
    with err.status(f"{chosen.title} on {surface.m:,} triangles", spinner="line"):
        ((_, record, uv, _),) = run_tasks(tasks, timeout=timeout)
    ok = record.outcome.status == "ok"
    written: dict[str, str] = {}
    if ok and uv is not None:
        if output is not None:
            write_mesh(output, surface, uv)
            written["output"] = str(output)
        if preview:
            picture = (output or Path(f"{mesh.stem}_{algorithm}")).with_suffix(".png")
            with err.status("drawing", spinner="line"):
                written["preview"] = str(picture)
                _draw(surface, uv, picture, record)
    if as_json:
        _print_json(row(record) | written)
    else:
        _print_notices([surface])
        out.print(figures_table(record))
        for what, where in written.items():
            out.print(f"[bold]{what}[/bold]  {escape(where)}")
        if ok and not written:
            out.print("Nothing was written; add -o FILE.obj to keep the map.", style="dim")
    if not ok:
        _complain(f"{record.outcome.status}: {record.outcome.cause}")
        raise typer.Exit(1)


@app.command(
    epilog="Examples:  cembench run --mesh a.obj --mesh b.ply -a cem,lscm  ·  "
    "cembench run --surfaces spherical-cap -o results/cap --json",
)
def run(
    *,
    mesh: Annotated[list[Path], typer.Option("--mesh", help="A mesh file. Repeatable.")] = [],  # noqa: B006
    surfaces: Annotated[
        list[str], typer.Option("--surfaces", help="Generated surfaces, comma-separated.")
    ] = [],  # noqa: B006
    faces: Annotated[int | None, typer.Option(help="Triangles of the generated surfaces.")] = None,
    algorithms: Annotated[
        list[str], typer.Option("-a", "--algorithms", help="Comma-separated; default: all.")
    ] = [],  # noqa: B006
    parameter: Parameters = [],  # noqa: B006
    plugin: Plugins = [],  # noqa: B006
    repeats: Annotated[int, typer.Option(min=1, help="Timed calls a cell.")] = 3,
    timeout: Timeout = 600.0,
    solves: SolvesOption = Solves.reuse,
    backend: BackendOption = Backend.cvxopt,
    threads: Threads = 1,
    output: Annotated[
        Path, typer.Option("-o", "--output", help="The run's folder; resumed if it exists.")
    ] = Path("results/run"),
    fresh: Annotated[bool, typer.Option("--fresh", help="Measure again what is there.")] = False,
    as_json: Json = False,
) -> None:
    """Measure algorithms on surfaces, each pair in a process of its own.

    Records and maps are kept in the run's folder; what it already holds is not measured again.
    -p NAME=VALUE goes to all algorithms that have it, -p ALGORITHM.NAME=VALUE to one.
    """
    from cembench.registry import load_registry
    from cembench.running.plan import How, generate_surface, plan_cells, read_mesh_for
    from cembench.store import Store

    registry = load_registry(plugin)
    names = _split(algorithms) or list(registry.algorithms)
    chosen = [registry.algorithm(name) for name in names]
    if not mesh and not surfaces:
        raise ParameterError(
            "nothing to run on: name at least one --mesh FILE or --surfaces NAME "
            "(see `cembench list surfaces`)."
        )
    with err.status("reading surfaces", spinner="line"):
        found = [read_mesh_for(path, chosen) for path in mesh]
        found += [generate_surface(registry, name, faces) for name in _split(surfaces)]
    how = How(solves.value, _installed(backend), threads, repeats)
    tasks = plan_cells(chosen, found, _assignments(parameter), how, plugin)
    if not as_json:
        _print_notices(found)
    records = _measure(tasks, Store(output), timeout=timeout, fresh=fresh)
    _present(records, as_json=as_json, where=output)


@app.command(epilog="Example:  cembench reproduce -o results/reproduce")
def reproduce(
    *,
    output: Annotated[Path, typer.Option("-o", "--output", help="Where the results go.")] = Path(
        "results/reproduce"
    ),
    fresh: Annotated[bool, typer.Option("--fresh", help="Measure again what is there.")] = False,
    as_json: Json = False,
) -> None:
    """Measure every algorithm on every generated surface, draw each map, and say where it all lies.

    Takes about a minute. What the folder already holds is not measured again.
    """
    from cembench.registry import load_registry
    from cembench.running.plan import How, generate_surface, plan_cells
    from cembench.store import Store

    registry = load_registry()
    surfaces = [generate_surface(registry, name) for name in registry.surfaces]
    tasks = plan_cells(list(registry.algorithms.values()), surfaces, {}, How())
    store = Store(output)
    records = _measure(tasks, store, timeout=600.0, fresh=fresh)
    pictures = output / "pictures"
    pictures.mkdir(parents=True, exist_ok=True)
    with err.status("drawing", spinner="line"):
        for task, record in zip(tasks, records, strict=True):
            uv = store.uv(task.cell)
            picture = pictures / f"{task.cell.mesh}--{task.cell.algorithm}.png"
            if uv is not None and (fresh or not picture.exists()):
                _draw(task.mesh, uv, picture, record)
    _present(records, as_json=as_json, where=output)


@app.command(epilog="Example:  cembench doctor --json")
def doctor(*, as_json: Json = False) -> None:
    """Is everything there that cembench needs? What is missing, and what brings it?"""
    from cembench.doctor import examine

    with err.status("looking", spinner="line"):
        findings = examine()
    if as_json:
        _print_json([asdict(finding) for finding in findings])
    else:
        for finding in findings:
            mark = (
                "[green]ok[/green]  "
                if finding.ok
                else ("[bold red]bad[/bold red] " if finding.required else "[yellow]--[/yellow]  ")
            )
            out.print(f"{mark}{finding.name:<11}{escape(finding.detail)}", soft_wrap=True)
            if not finding.ok:
                out.print(f"    {'':<11}{escape(finding.remedy)}", style="dim", soft_wrap=True)
    if any(finding.required and not finding.ok for finding in findings):
        raise typer.Exit(1)


def _measure(tasks: Sequence[Task], store: Store, *, timeout: float, fresh: bool) -> list[Record]:
    """Run the tasks with a live bar on a terminal, and with a line a cell elsewhere."""
    from cembench.running.local import run_tasks

    records = []
    columns = (
        SpinnerColumn("line"),
        TextColumn("{task.description}"),
        BarColumn(bar_width=20),
        MofNCompleteColumn(),
        Elapsed(),
    )
    with Progress(*columns, console=err, transient=True, disable=not err.is_terminal) as bar:
        line = bar.add_task("starting", total=len(tasks))

        def announce(task: Task) -> None:
            bar.update(line, description=f"{task.cell.mesh} / {task.cell.algorithm}")

        results = run_tasks(tasks, store, timeout=timeout, fresh=fresh, before=announce)
        for k, (task, record, _, resumed) in enumerate(results, start=1):
            records.append(record)
            bar.advance(line)
            if not err.is_terminal:
                how = "kept" if resumed else record.outcome.status
                err.print(
                    f"[{k}/{len(tasks)}] {task.cell.mesh} / {task.cell.algorithm}: {how}",
                    markup=False,
                )
    return records


def _present(records: list[Record], *, as_json: bool, where: Path) -> None:
    from cembench.reporting.frame import row
    from cembench.reporting.terminal import results_table

    if as_json:
        _print_json([row(record) for record in records])
    else:
        out.print(results_table(records))
        out.print(f"\nRecords and maps: {where.resolve()}", soft_wrap=True, markup=False)
    if any(record.outcome.status != "ok" for record in records):
        raise typer.Exit(1)


def _draw(mesh: TriangleMesh, uv: Any, picture: Path, record: Record) -> None:
    from cembench.reporting.preview import write_preview

    metrics = record.outcome.metrics
    caption = (
        f"E_C {metrics['conformal_energy']:.4f}   angles off by "
        f"{metrics['angle_error_mean_deg']:.2f} degrees in the mean   "
        f"{metrics['flipped_triangles']} folds"
    )
    title = f"{record.cell.mesh}: {record.title}"
    drawn = write_preview(mesh, uv, picture, title=title, caption=caption)
    if drawn.notice:
        err.print(f"note: {drawn.notice}", style="dim", markup=False, soft_wrap=True)


def _print_notices(meshes: Sequence[TriangleMesh]) -> None:
    for mesh in meshes:
        for notice in mesh.notices:
            err.print(f"note: {mesh.name}: {notice}", style="yellow", markup=False, soft_wrap=True)


def _complain(message: str) -> None:
    err.print(f"error: {message}", style="bold red", markup=False, soft_wrap=True)


def _print_json(data: Any) -> None:
    sys.stdout.write(json.dumps(data, indent=2) + "\n")


def _split(names: Sequence[str]) -> list[str]:
    return [part.strip() for name in names for part in name.split(",") if part.strip()]


def _assignments(given: Sequence[str]) -> dict[str, str]:
    pairs = {}
    for assignment in given:
        name, equals, value = assignment.partition("=")
        if not equals or not name:
            raise ParameterError(f"-p {assignment!r} is not of the form NAME=VALUE.")
        pairs[name.strip()] = value.strip()
    return pairs


def _installed(backend: Backend) -> str:
    from cembench.geometry.cholesky import linear_algebra

    with linear_algebra(backend=backend.value):
        return backend.value


def _registry_as_json(registry: Registry, kind: Kind | None) -> dict[str, Any]:
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
        return about(a) | {"target": a.target, "takes": a.mesh_type.__name__}

    listed: dict[str, Any] = {}
    if kind in (None, Kind.algorithms):
        listed["algorithms"] = [about_algorithm(a) for a in registry.algorithms.values()]
    if kind in (None, Kind.surfaces):
        listed["surfaces"] = [about(s) for s in registry.surfaces.values()]
    return listed


def main() -> None:
    """Run the command line; errors meant for the user are one line, without a traceback."""
    try:
        app()
    except CembenchError as error:
        _complain(str(error))
        sys.exit(2)


if __name__ == "__main__":
    main()
