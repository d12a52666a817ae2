"""Test the statements of the paper's Section 4 on a surface."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cembench.api.settings import AnyPath, Faces
from cembench.core.arguments import Range, checked
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from cembench.api.theory_facts import TheoryFacts
    from cembench.running.surfaces import SurfaceInput


@checked
def theory(
    surface: SurfaceInput,
    *,
    iterations: Annotated[int, Range(1, 1_000_000)] = 200,
    faces: Faces | None = None,
    run: AnyPath | None = None,
    reporter: Reporter = SILENT,
) -> TheoryFacts:
    """Test the statements of the paper's Section 4 on a disk.

    Tested are the premises (Definition 1, signs of the weights), Theorem 2, Corollary 1, Remark 2,
    Theorem 3 and Remark 3; the spectrum of K and the speed of the iteration are measured too.
    docs/theory.md explains the figures.

    Parameters
    ----------
    surface : mesh, path, name or pair of arrays (V, F)
        A topological disk.
    iterations : int
        Iterations of (23) and (30), run without a stopping rule.
    faces : int, optional
        Number of triangles of generated surfaces.
    run : path, optional
        Add the tables and a picture to this run, as an exhibit that its report shows.
    reporter : Reporter
        Receives what is being done.

    Returns
    -------
    TheoryFacts
        The premises and statements, each with the figure that decides it.

    Raises
    ------
    MeshError
        The surface is damaged or not a disk.
    AlgorithmFailed
        The surface has no interior vertex.
    RecordError
        The folder `run` is not a run, or cannot be written to.

    Examples
    --------
    >>> import cembench
    >>> cembench.theory(cembench.surface("flat-disk", 200)).facts["premises_hold"]
    True

    """
    from cembench.api.theory_exhibit import add_exhibit, claim_exhibit
    from cembench.api.theory_facts import RIVAL, theory_facts
    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.registry import load_registry
    from cembench.results import run_folder
    from cembench.running.surfaces import load_surface

    if run is not None:
        run_folder.check(Path(run))
    registry = load_registry()
    mesh = load_surface(surface, (DiskMesh,), faces=faces, registry=registry)
    with reporter.busy(f"Section 4 on {mesh.name}"):
        if run is not None:
            claim_exhibit(Path(run), mesh)  # fail now, not after the computation
        found = theory_facts(mesh, registry.algorithms.get(RIVAL), iterations)
        if run is not None:
            name = Path(surface).name if isinstance(surface, str | os.PathLike) else mesh.name
            size = "" if faces is None else f" --faces {faces}"
            command = f"cembench theory {name} --iterations {iterations}{size}"
            add_exhibit(Path(run), found, command)
    return found
