"""Morph surfaces into each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from cembench.core.errors import ParameterError
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.running.surfaces import SurfaceInput, load_surface
from cembench.workflows.morphing.landmarks import Landmarks, check_landmarks
from cembench.workflows.morphing.morph import Morph
from cembench.workflows.morphing.morph import morph as register_all
from cembench.workflows.parameterize import parameterize


def morph(
    surfaces: Sequence[SurfaceInput],
    landmarks: Mapping[str, Sequence[int]] | None = None,
    *,
    algorithm: str = "direct-cem",
    **options: Any,
) -> Morph:
    """Register surfaces to the first one, whose vertices then move through all of them.

    Parameters
    ----------
    surfaces : sequence of meshes, paths, names or pairs of arrays (V, F)
        Two or more topological disks.
    landmarks : mapping, optional
        For each landmark name, its vertex on every surface, counted from 0. The first landmark
        goes to the centre of the disk. Without landmarks, curvature aligns the surfaces.
    algorithm : str
        Name of the algorithm for the maps to the disk.
    **options
        `lam`, `reach`, `pose` of :func:`cembench.workflows.morphing.morph.morph`.

    Returns
    -------
    Morph
        ``morph.at(t)`` returns the first surface's vertices, float64 (n, 3), at a time from 0 to 1.

    Raises
    ------
    MeshError
        A surface is damaged or not a disk.
    ParameterError
        There are fewer than two surfaces, or the landmarks are inconsistent.
    AlgorithmFailed
        No map or no registration without folds was found.

    Examples
    --------
    >>> import cembench
    >>> face = cembench.surface("hemi-ellipsoid", 300)
    >>> path = cembench.morph([face, (face.V * [1, 1, 2], face.F)])
    >>> path.at(0.5).shape == (face.n, 3)
    True

    """
    if len(surfaces) < 2:
        raise ParameterError("a morph needs two surfaces or more; name at least one more.")
    meshes = [load_surface(surface, (DiskMesh,)) for surface in surfaces]
    names = tuple(landmarks or {})
    rows = [list((landmarks or {})[name]) for name in names]
    for name, row in zip(names, rows, strict=True):
        if len(row) != len(meshes):
            raise ParameterError(
                f"landmark {name!r} has {len(row)} vertices; it needs one for each of "
                f"the {len(meshes)} surfaces."
            )
    places = Landmarks(names, np.array(rows, dtype=np.int64).reshape(len(names), len(meshes)))
    check_landmarks(places, meshes)
    maps = [parameterize(mesh, algorithm).z for mesh in meshes]
    return register_all(meshes, maps, places, **options)
