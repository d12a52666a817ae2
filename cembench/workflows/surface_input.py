"""Make a checked surface from a mesh, a file, a name, or a pair of arrays."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cembench.core.errors import MeshError
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
from cembench.registry import Registry, load_registry
from cembench.running.plan import file_named, generate_surface

#: A checked mesh, the path of a mesh file, the name of a generated surface or of a public one that
#: was fetched, or arrays (V, F).
SurfaceInput: TypeAlias = TriangleMesh | str | os.PathLike[str] | tuple[ArrayLike, ArrayLike]

#: The kinds of surface that algorithms take, the most special first.
KINDS: tuple[type[TriangleMesh], ...] = (DiskMesh, HoledMesh)


def checked_surface(
    given: SurfaceInput,
    kinds: Sequence[type[TriangleMesh]] = KINDS,
    registry: Registry | None = None,
) -> TriangleMesh:
    """Return a surface as the first of these kinds that fits.

    Parameters
    ----------
    given : mesh, path, name or pair of arrays
        See :data:`SurfaceInput`. If a name is also a file, the file is read.
    kinds : sequence of mesh classes
        Tried in order; if none fits, the first one's error is raised.
    registry : Registry, optional
        Registry of names; default: everything installed.

    Raises
    ------
    MeshError
        The surface is damaged, or is of none of these kinds.

    """
    if isinstance(given, TriangleMesh):
        if isinstance(given, tuple(kinds)):
            return given
        return _first(kinds, lambda kind: _converted(given, kind))
    if isinstance(given, str | os.PathLike):
        name = str(given)
        registry = registry or load_registry()
        if name in registry.surfaces and not Path(name).is_file():
            return checked_surface(generate_surface(registry, name), kinds, registry)
        path = file_named(registry, name)
        return _first(kinds, lambda kind: read_mesh(path, kind))
    V, F = pair_of_arrays(given)
    return _first(kinds, lambda kind: kind.from_arrays(V, F))


def pair_of_arrays(given: Any) -> tuple[Any, Any]:
    """Return the two arrays of a pair; raise :class:`MeshError` for anything else."""
    if isinstance(given, tuple | list) and len(given) == 2:
        return given[0], given[1]
    size = f" of {len(given)} items" if isinstance(given, tuple | list) else ""
    raise MeshError(
        f"a surface is a mesh, a path, the name of a registered surface or a pair of arrays "
        f"(V, F); got {type(given).__name__}{size}."
    )


def _converted(mesh: TriangleMesh, kind: type[TriangleMesh]) -> TriangleMesh:
    return kind.from_arrays(mesh.V, mesh.F, name=mesh.name)


def _first(
    kinds: Sequence[type[TriangleMesh]], make: Callable[[type[TriangleMesh]], TriangleMesh]
) -> TriangleMesh:
    """Return the mesh of the first kind that fits; otherwise raise the first kind's error."""
    for kind in kinds[1:]:
        try:
            return make(kind)
        except MeshError:
            continue
    return make(kinds[0])


def mesh_of_arrays(V: NDArray[np.float64], F: NDArray[np.int64], name: str) -> TriangleMesh:
    """Return the mesh of the most special kind that fits these arrays, or a plain one."""
    kinds: tuple[type[TriangleMesh], ...] = (TriangleMesh, *KINDS)
    return _first(kinds, lambda kind: kind.from_arrays(V, F, name=name))
