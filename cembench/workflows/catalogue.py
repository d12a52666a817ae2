"""What there is: algorithms and surfaces by name."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm, Surface, load_registry


def list_algorithms(plugins: Iterable[str] = ()) -> list[Algorithm]:
    """Return the algorithms that can be named, with their target, parameters and source.

    Examples
    --------
    >>> import cembench
    >>> "cem" in [algorithm.name for algorithm in cembench.list_algorithms()]
    True

    """
    return list(load_registry(plugins).algorithms.values())


def list_surfaces(plugins: Iterable[str] = ()) -> list[Surface]:
    """Return the surface families that can be named.

    Examples
    --------
    >>> import cembench
    >>> "spherical-cap" in [family.name for family in cembench.list_surfaces()]
    True

    """
    return list(load_registry(plugins).surfaces.values())


def surface(name: str, faces: int | None = None, **parameters: Any) -> TriangleMesh:
    """Return a mesh of a registered surface family.

    To declare a family of your own, use the decorator :func:`cembench.surface_family`.

    Parameters
    ----------
    name : str
        See :func:`list_surfaces`.
    faces : int, optional
        Triangles to aim for; default: the family's own size.
    **parameters
        The family's own, such as `seed`.

    Raises
    ------
    RegistryError
        An unknown name; the message lists the known ones.
    ParameterError
        An unknown parameter, or a value out of its range.

    Examples
    --------
    >>> import cembench
    >>> cembench.surface("flat-disk", 200).name
    'flat-disk'

    """
    family = load_registry().surface(name)
    given = parameters if faces is None else {"faces": faces, **parameters}
    mesh: TriangleMesh = family.function(**family.arguments(given))
    return mesh
