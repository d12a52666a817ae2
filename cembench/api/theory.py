"""Test the statements of the paper's Section 4 on a surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from cembench.core.arguments import Range, checked

if TYPE_CHECKING:
    from cembench.api.theory_facts import TheoryFacts
    from cembench.running.surfaces import SurfaceInput


@checked
def theory(
    surface: SurfaceInput, *, iterations: Annotated[int, Range(1, 1_000_000)] = 200
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

    Returns
    -------
    TheoryFacts
        The premises and statements, each with the figure that decides it.

    Raises
    ------
    MeshError
        The surface is damaged or not a disk.

    Examples
    --------
    >>> import cembench
    >>> cembench.theory(cembench.surface("flat-disk", 200)).facts["premises_hold"]
    True

    """
    from cembench.api.theory_facts import RIVAL, theory_facts
    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.registry import load_registry
    from cembench.running.surfaces import load_surface

    mesh = load_surface(surface, (DiskMesh,))
    return theory_facts(mesh, load_registry().algorithms.get(RIVAL), iterations)
