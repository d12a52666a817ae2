"""Map a surface with holes by every algorithm for such surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from cembench.core.arguments import Range, checked

if TYPE_CHECKING:
    from cembench.api.parameterize import Result
    from cembench.running.surfaces import SurfaceInput


@checked
def holes(
    surface: SurfaceInput, *, outer: Annotated[int, Range(0, 2**63 - 1)] | None = None
) -> dict[str, Result]:
    """Map a surface with holes to a disk with circular holes, with every suitable algorithm.

    Parameters
    ----------
    surface : mesh, path, name or pair of arrays (V, F)
        A surface of genus 0 with two boundary loops or more.
    outer : int, optional
        A vertex of the outer boundary, counted from 0 (default: the widest boundary).

    Returns
    -------
    dict of Result
        The maps by algorithm name, without algorithms that found no valid map.

    Raises
    ------
    MeshError
        The surface is damaged or has no hole.
    AlgorithmFailed
        No algorithm found a valid map; the message gives the cause for each.

    Examples
    --------
    >>> import cembench
    >>> found = cembench.holes(cembench.surface("catenoid-ring", 200))
    >>> sorted(found)
    ['direct-cem-holes', 'harmonic-filled', 'koebe-cem']

    """
    from cembench.api.parameterize import parameterize
    from cembench.core.errors import AlgorithmFailed
    from cembench.mesh.triangle_mesh import HoledMesh
    from cembench.registry import load_registry
    from cembench.running.surfaces import load_surface

    mesh = load_surface(surface, (HoledMesh,))
    given: dict[str, Any] = {} if outer is None else {"outer": outer}
    found, causes = {}, []
    for name, algorithm in load_registry().algorithms.items():
        if algorithm.target != "circular holes":
            continue
        known = {parameter.name for parameter in algorithm.parameters}
        try:
            own: dict[str, Any] = given if "outer" in known else {}
            found[name] = parameterize(mesh, name, **own)
        except AlgorithmFailed as error:
            causes.append(str(error))
    if not found:
        raise AlgorithmFailed(
            "; ".join(causes) or "no algorithm for surfaces with holes is installed"
        )
    return found
