"""Validate a solver: contract, correctness, quality and speed."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from cembench.core import folders
from cembench.core.atomic import draft_folder, unwritable, write_model
from cembench.running.options import Options
from cembench.running.plan import distribute_parameters
from cembench.running.surfaces import SurfaceInput, load_surface
from cembench.validation.examine import ValidationOptions, examine
from cembench.validation.solver import Solver, in_a_process, load_solver
from cembench.validation.verdict import Validation


def validate(
    plugin: str | os.PathLike[str],
    *,
    against: Sequence[str] | None = None,
    surfaces: Sequence[SurfaceInput] = (),
    rounds: int = 6,
    up_to: int = 30_000,
    checks_only: bool = False,
    timeout: float = 120.0,
    parameters: Mapping[str, Any] | None = None,
) -> Validation:
    """Check whether a solver is correct, and compare it with baselines.

    This is `cembench validate`; docs/write_a_solver.md explains the stages.

    Parameters
    ----------
    plugin : path or str
        ``FILE.py``, ``FILE.py:NAME``, ``module:name`` or a registered name.
    against : sequence of str, optional
        Names of the baselines; default: the usual one for the solver's target.
    surfaces : sequence of meshes, paths, names or pairs of arrays
        Surfaces to compare on; default: the six standard ones.
    rounds : int
        Number of timing rounds.
    up_to : int
        Triangles of the largest mesh for the growth of time; 0: skip that stage.
    checks_only : bool
        Whether to check contract and correctness only, without timing.
    timeout : float
        Time limit of a call, in seconds.
    parameters : mapping, optional
        Parameters of the solver.

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
    algorithm, registry, plugins = load_solver(os.fspath(plugin))
    arguments = distribute_parameters([algorithm], parameters or {})[algorithm.name]
    options = Options(timeout=timeout)
    asked = ValidationOptions(
        against=against,
        meshes=[load_surface(one, [algorithm.mesh_type], registry=registry) for one in surfaces],
        rounds=rounds,
        up_to=up_to,
        checks_only=checks_only,
        options=options,
    )
    solver = Solver(algorithm, plugins, arguments, in_a_process(options))
    with tempfile.TemporaryDirectory(prefix="cembench-") as folder:
        return examine(solver, registry, Path(folder), asked)


def write_validation(found: Validation, folder: Path) -> dict[str, str]:
    """Write a validation to a folder as JSON and HTML; return the paths.

    Raises
    ------
    RecordError
        The folder cannot be written.

    """
    from cembench.report.render.html import FILE, write_html  # needs an extra
    from cembench.validation.document import document_of

    name = "validation.json"
    try:
        with draft_folder(folder) as draft:
            write_model(draft / name, found)
            write_html(document_of(found, folder, draft), draft)
            folders.publish(draft, folder, "validation")
    except OSError as error:
        raise unwritable(folder, error) from error
    return {"output": str(folder / name), "page": str(folder / FILE)}
