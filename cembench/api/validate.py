"""Validate a solver: contract, correctness, quality and speed."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cembench.api.settings import MAX_FACES, AnyPath, Rounds, Threads, Timeout
from cembench.core.arguments import Range, checked
from cembench.core.reporter import SILENT, Reporter
from cembench.results.intervals import DEFAULT_ROUNDS

if TYPE_CHECKING:
    from cembench.running.surfaces import SurfaceInput
    from cembench.validation.verdict import Validation


@checked
def validate(
    plugin: AnyPath,
    *,
    against: Sequence[str] | None = None,
    profile: Literal["quick", "standard", "paper"] | None = None,
    surfaces: Iterable[SurfaceInput] = (),
    mesh_dir: Sequence[AnyPath] = (),
    faces: Annotated[int, Range(24, MAX_FACES)] | None = None,
    rounds: Rounds = DEFAULT_ROUNDS,
    up_to: Annotated[int, Range(0, MAX_FACES)] = 30_000,
    parameters: Mapping[str, Any] | None = None,
    require: Sequence[Literal["faster", "not-slower", "better", "not-worse", "no-folds"]] = (),
    checks_only: bool = False,
    threads: Threads = 1,
    timeout: Timeout = 120.0,
    output: AnyPath | None = None,
    reporter: Reporter = SILENT,
) -> Validation:
    """Check whether a solver is correct, and compare its quality and speed with baselines.

    There are four stages, each run only if the ones before found no fault: the contract,
    correctness on surfaces with a known map, quality and speed against a baseline, and growth of
    time with size. docs/write_a_solver.md has an example.

    Parameters
    ----------
    plugin : path or str
        FILE.py, FILE.py:NAME, module:name, or a registered name.
    against : sequence of str, optional
        Names of the baselines (default: cem, or the usual one for the target).
    profile : {"quick", "standard", "paper"}, optional
        Compare on the stand-ins of this profile.
    surfaces : iterable of meshes, paths, names or pairs of arrays
        Compare on these surfaces; default: the six standard ones.
    mesh_dir : sequence of paths
        Compare on all mesh files in a folder.
    faces : int, optional
        Number of triangles of generated surfaces; the default surfaces have 5,000.
    rounds : int
        Number of rounds; fewer than 6 give no interval.
    up_to : int
        Triangles of the largest mesh in the scaling stage; 0: skip it.
    parameters : mapping, optional
        Parameters of the solver.
    require : sequence of str
        What the solver must also be to pass: faster, not-slower, better, not-worse, no-folds.
    checks_only : bool
        Check contract and correctness only, without timing.
    threads : int
        Threads of the numerical libraries, the baselines' too; OpenBLAS keeps one.
    timeout : float
        Time limit of a call, in seconds.
    output : path, optional
        Write JSON, HTML and the runs to this folder.
    reporter : Reporter
        Receives what is being done.

    Returns
    -------
    Validation
        ``.valid``, ``.findings``, and the comparisons with the baselines.

    Raises
    ------
    RegistryError
        The solver or a baseline is unknown, or its file cannot be imported.
    MeshError
        A surface is damaged, or the solver does not take it.
    ParameterError
        A parameter is unknown or out of range, or a baseline cannot be compared.

    Examples
    --------
    >>> import cembench
    >>> found = cembench.validate("harmonic-circle", checks_only=True)
    >>> found.algorithm, found.valid
    ('harmonic-circle', True)
    """
    from cembench.api.run_plan import read_surfaces
    from cembench.core import folders
    from cembench.results.profiles import Profile, surfaces_of
    from cembench.running.options import Options
    from cembench.running.plan import MeasurementSettings, distribute_parameters, plan_cells
    from cembench.validation.examine import ValidationHooks, ValidationOptions, examine
    from cembench.validation.solver import Solver, in_a_process, load_solver
    from cembench.validation.verdict import Requirement

    if output is not None:
        folders.check(Path(output), "validation")
    with reporter.busy(f"importing {os.fspath(plugin)}"):
        algorithm, registry, plugins = load_solver(os.fspath(plugin))
    arguments = distribute_parameters([algorithm], parameters or {})[algorithm.name]
    options = Options(timeout=timeout)
    on = [*(surfaces_of(Profile(profile), registry) if profile else []), *surfaces]
    with reporter.busy("reading surfaces"):
        meshes, roles = read_surfaces(
            *(on, map(Path, mesh_dir), registry, [algorithm], reporter), faces=faces, repair=False
        )
    plan_cells([algorithm], meshes, {}, MeasurementSettings())  # fail now, not after the checks
    asked = ValidationOptions(
        against=against,
        meshes=meshes,
        standing=roles,
        faces=faces or 5000,
        rounds=rounds,
        up_to=up_to,
        require=[Requirement(one) for one in require],
        checks_only=checks_only,
        options=options,
        command=reporter.command,
    )
    hooks = ValidationHooks(reporter.step, lambda cells: reporter.watching(cells, resumes=False))
    solver = Solver(algorithm, plugins, arguments, threads, in_a_process(options))
    with _folder(output) as folder:
        validation = examine(solver, registry, folder, asked, hooks)
        if output is not None:
            write_validation(validation, folder)
    return validation


@contextmanager
def _folder(output: AnyPath | None) -> Iterator[Path]:
    """Yield the folder for the runs: the user's, or a temporary one."""
    from cembench.core import folders

    if output is not None:
        folders.claim(Path(output), "validation")
        yield Path(output)
        return
    with tempfile.TemporaryDirectory(prefix="cembench-") as folder:
        yield Path(folder)


def written_files(folder: Path) -> dict[str, str]:
    """Return the paths of a validation that was written to a folder."""
    return {"output": str(folder / "validation.json"), "page": str(folder / "index.html")}


def write_validation(validation: Validation, folder: Path) -> None:
    """Write a validation to a folder as JSON and HTML.

    Raises
    ------
    RecordError
        The folder cannot be written.
    """
    from cembench.core import folders
    from cembench.core.atomic import draft_folder, unwritable, write_model
    from cembench.report.render.html import write_html
    from cembench.validation.document import document_of

    try:
        with draft_folder(folder) as draft:
            write_model(draft / "validation.json", validation)
            write_html(document_of(validation, folder, draft), draft)
            folders.publish(draft, folder, "validation")
    except OSError as error:
        raise unwritable(folder, error) from error
