"""Test the statements of the paper's Section 4 on a surface."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cembench.api.settings import AnyPath, Faces
from cembench.core.arguments import Range, checked
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.results.exhibits import Exhibit
    from cembench.running.surfaces import SurfaceInput

    from .theory_facts import TheoryFacts

__all__ = ["theory"]


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
    from cembench.registry import load_registry
    from cembench.results import exhibits, run_folder

    from .theory_exhibit import add_exhibit, exhibit_name
    from .theory_facts import RIVAL, theory_facts

    if run is not None:
        run_folder.check(Path(run))
    mesh = loaded(surface, faces=faces)
    with reporter.busy(f"Section 4 on {mesh.name}"):
        if run is not None:  # fail now, not after the computation
            exhibits.exhibit_folder(Path(run), exhibit_name(mesh.name))
        facts_of_disk = theory_facts(mesh, load_registry().algorithms.get(RIVAL), iterations)
        if run is not None:
            command = exhibits.command(
                "theory", surface, mesh.name, iterations=iterations, faces=faces
            )
            add_exhibit(Path(run), facts_of_disk, command)
    return facts_of_disk


# For the command line


def loaded(surface: SurfaceInput, *, faces: int | None, **_: Any) -> DiskMesh:
    """Return the disk that was named."""
    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.running.surfaces import load_surface

    return load_surface(surface, (DiskMesh,), faces=faces)


def shown(facts_of_disk: Sequence[TheoryFacts], command: str) -> list[Exhibit]:
    """Return the exhibits of surfaces, which `command` makes."""
    from .theory_exhibit import theory_exhibit

    return [theory_exhibit(one, command) for one in facts_of_disk]


def facts(facts_of_disk: Sequence[TheoryFacts]) -> list[Any]:
    """Return the results as plain data."""
    return [one.facts for one in facts_of_disk]


def failures(facts_of_disk: Sequence[TheoryFacts]) -> list[str]:
    """Return the surfaces where a statement fails although all premises hold."""
    return [
        f"{one.facts['mesh']}: a statement fails although all premises hold"
        for one in facts_of_disk
        if one.facts["premises_hold"] and not one.facts["statements_hold"]
    ]
