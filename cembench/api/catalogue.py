"""The registered algorithms and surfaces, by name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cembench.mesh.triangle_mesh import TriangleMesh
    from cembench.registry import Algorithm, Surface


def list_algorithms(plugins: Sequence[str] = ()) -> list[Algorithm]:
    """Return the registered algorithms, with their target, parameters and source.

    Parameters
    ----------
    plugins : sequence of str
        Python files or ``module:name`` with more algorithms.

    Returns
    -------
    list of Algorithm
        The algorithms, sorted by name.

    Examples
    --------
    >>> import cembench
    >>> "cem" in [algorithm.name for algorithm in cembench.list_algorithms()]
    True

    """
    from cembench.registry import load_registry

    return list(load_registry(plugins).algorithms.values())


def list_surfaces(plugins: Sequence[str] = ()) -> list[Surface]:
    """Return the registered surface families.

    Parameters
    ----------
    plugins : sequence of str
        Python files or ``module:name`` with more families.

    Returns
    -------
    list of Surface
        The surface families, sorted by name.

    Examples
    --------
    >>> import cembench
    >>> "spherical-cap" in [family.name for family in cembench.list_surfaces()]
    True

    """
    from cembench.registry import load_registry

    return list(load_registry(plugins).surfaces.values())


def surface(name: str, faces: int | None = None, **parameters: Any) -> TriangleMesh:
    """Return a mesh from a registered surface family.

    The decorator :func:`cembench.surface_family` declares new families.

    Parameters
    ----------
    name : str
        A name from :func:`list_surfaces`.
    faces : int, optional
        Approximate number of triangles; default: the family's own size.
    **parameters
        Parameters of the family, such as `seed`.

    Returns
    -------
    DiskMesh or HoledMesh
        The surface.

    Raises
    ------
    RegistryError
        The name is unknown; the message lists the known ones.
    ParameterError
        A parameter is unknown, or its value is out of range.

    Examples
    --------
    >>> import cembench
    >>> cembench.surface("flat-disk", 200).name
    'flat-disk'

    """
    from cembench.registry import load_registry

    family = load_registry().surface(name)
    given = parameters if faces is None else {"faces": faces, **parameters}
    mesh: TriangleMesh = family.function(**family.arguments(given))
    return mesh
