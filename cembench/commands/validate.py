"""The command `validate`: judge a solver."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from cembench.commands.console import Json, assignments, err, out, print_json, split
from cembench.commands.external import Command, Settings, declared_command
from cembench.commands.options import MOST_FACES, Parameters, Repeats, Timeout
from cembench.core.errors import ParameterError
from cembench.results.intervals import DEFAULT_ROUNDS
from cembench.results.profiles import Profile
from cembench.validation.requirement import Requirement

if TYPE_CHECKING:
    from cembench.mesh.triangle_mesh import TriangleMesh
    from cembench.registry import Algorithm, Registry
    from cembench.running.plan import PaperRole
    from cembench.validation.examine import ValidationHooks
    from cembench.validation.verdict import Validation

Names = list[str]


def validate(
    plugin: Annotated[
        str | None,
        typer.Argument(
            metavar="PLUGIN", help="FILE.py, FILE.py:NAME, module:name, or a registered name."
        ),
    ] = None,
    *,
    command: Command = None,
    program: Settings = [],  # noqa: B006 - typer copies defaults
    against: Annotated[
        Names,
        typer.Option(
            help="Baselines, comma-separated (default: cem, or the usual one for the target)."
        ),
    ] = [],  # noqa: B006 - typer copies defaults
    profile: Annotated[
        Profile | None, typer.Option(help="Compare on the stand-ins of this profile.")
    ] = None,
    surfaces: Annotated[
        Names, typer.Option(help="Compare on these surfaces (see `list surfaces`).")
    ] = [],  # noqa: B006
    mesh: Annotated[list[Path], typer.Option(help="Compare on this file. Repeatable.")] = [],  # noqa: B006
    mesh_dir: Annotated[
        list[Path], typer.Option(help="Compare on all mesh files in a folder.")
    ] = [],  # noqa: B006
    faces: Annotated[
        int | None,
        typer.Option(
            min=24,
            max=MOST_FACES,
            help="Number of triangles of the --surfaces; the default surfaces have 5,000.",
        ),
    ] = None,
    repeats: Repeats = DEFAULT_ROUNDS,
    up_to: Annotated[
        int,
        typer.Option(
            min=0,
            max=MOST_FACES,
            help="Triangles of the largest mesh in the scaling stage; 0: skip it.",
        ),
    ] = 30_000,
    parameter: Parameters = [],  # noqa: B006
    require: Annotated[
        list[Requirement],
        typer.Option(
            metavar="WHAT",
            help="Exit with 1 unless the solver also is: faster, not-slower, better, not-worse, "
            "no-folds. Repeatable.",
        ),
    ] = [],  # noqa: B006
    checks_only: Annotated[
        bool,
        typer.Option("--checks-only", help="Check contract and correctness only, without timing."),
    ] = False,
    timeout: Timeout = 120.0,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Write JSON, HTML and the runs to this folder."),
    ] = None,
    as_json: Json = False,
) -> None:
    """Check whether a solver is correct, and compare its quality and speed with baselines.

    There are four stages, each run only if the ones before found no fault: the
    contract, correctness on surfaces with a known map, quality and speed against
    a baseline, and growth of time with size. Exit code 0: valid, and --require is
    met; 1: not; 2: wrong usage. docs/write_a_solver.md has an example.
    """
    from cembench.core import extras, folders
    from cembench.running.options import Options
    from cembench.running.plan import distribute_parameters
    from cembench.validation.examine import ValidationOptions, examine
    from cembench.validation.solver import Solver, in_a_process, load_solver
    from cembench.validation.terminal import validation_text
    from cembench.workflows.validate import write_validation

    declared, _ = declared_command(command, program)
    if (plugin is None) == (not declared):
        raise ParameterError(
            "name one solver: a PLUGIN (FILE.py, module:name or a registered name), or a program "
            "with --command COMMAND."
        )
    plugin = plugin or declared[0]
    if output is not None:
        extras.require(extras.Extra.REPORT, f"the page in {output}")
        folders.check(output, "validation")
    with err.status(f"importing {escape(command or plugin)}", spinner="line"):
        algorithm, registry, plugins = load_solver(plugin)
    arguments = distribute_parameters([algorithm], assignments(parameter))[algorithm.name]
    options = Options(timeout=timeout)
    solver = Solver(algorithm, plugins, arguments, in_a_process(options))
    with err.status("reading surfaces", spinner="line"):
        meshes, standing = _chosen(algorithm, registry, profile, surfaces, mesh, mesh_dir, faces)
    asked = ValidationOptions(
        against=split(against) or None,
        meshes=meshes,
        standing=standing,
        faces=faces or 5000,
        rounds=repeats,
        up_to=up_to,
        require=require,
        checks_only=checks_only,
        options=options,
        command=shlex.join(["cembench", *sys.argv[1:]]),
    )
    with _folder(output) as folder:
        found = examine(solver, registry, folder, asked, _printing_hooks())
        written = write_validation(found, folder) if output is not None else {}
    if as_json:
        print_json(_as_json(found, written))
    else:
        out.print(validation_text(found))
        for path in written.values():
            out.print(path, style="dim", markup=False, soft_wrap=True)
    if not found.passed:
        raise typer.Exit(1)


def _chosen(
    algorithm: Algorithm,
    registry: Registry,
    profile: Profile | None,
    surfaces: Names,
    files: list[Path],
    folders: list[Path],
    faces: int | None,
) -> tuple[list[TriangleMesh], dict[str, PaperRole]]:
    """Return the surfaces the user names (none: the default ones), and their roles in the paper."""
    from cembench.results.profiles import surfaces_of
    from cembench.running.plan import MeasurementSettings, gather_surfaces, mesh_files, plan_cells

    files = [*files, *(file for folder in folders for file in mesh_files(folder))]
    names = [*(surfaces_of(profile, registry) if profile else []), *split(surfaces)]
    found, standing = gather_surfaces(registry, [algorithm], files, names, faces)
    plan_cells([algorithm], found, {}, MeasurementSettings())  # fail now, not after the checks
    return found, standing


@contextmanager
def _folder(output: Path | None) -> Iterator[Path]:
    """Yield the folder for the runs: the user's, or a temporary one."""
    from cembench.core import folders

    if output is not None:
        folders.claim(output, "validation")
        yield output
        return
    with TemporaryDirectory(prefix="cembench-") as folder:
        yield Path(folder)


def _printing_hooks() -> ValidationHooks:
    """Return hooks that print a line for each stage and the progress of timing."""
    from cembench.commands.progress import progress_on
    from cembench.validation.examine import ValidationHooks

    def stage_begins(stage: str) -> None:
        err.print(f"{stage} ...", style="dim")

    return ValidationHooks(stage_begins, partial(progress_on, err))


def _as_json(found: Validation, written: dict[str, str]) -> dict[str, Any]:
    """Return the validation as data for JSON output."""
    from cembench.validation.verdict import sentence

    said = {"valid": found.valid, "passed": found.passed, "verdict": sentence(found)}
    return said | found.model_dump(mode="json") | written


#: Each command with the examples in its help.
VERBS = (
    (
        validate,
        "Examples:  cembench validate mine.py  ·  cembench validate mine.py:fast --against cem,fdm "
        "--profile quick -o results/mine  ·  cembench validate mine.py --require not-slower",
    ),
)
