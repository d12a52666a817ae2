"""Better maps of graded meshes, whose triangles are needles, or vary in size over decades.

There the least conformal energy of maps that are linear on triangles may have far larger angle
errors than needed. First, it weighs triangles by the area of their image: steps of
:func:`cembench.conformal.even_weights.evened` count all alike. Second, such a map hardly follows
the conformal one where a long edge of the boundary lies beside short ones. With every triangle
split into four the surface is the same, and so is its conformal map; the finer mesh follows it more
closely, and at the given vertices it has a map of the given mesh.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from cembench.conformal.even_weights import evened
from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.laplacian import corner_products
from cembench.conformal.last_resort import valid_map
from cembench.conformal.metrics import angle_errors, flipped_triangles
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh

#: A mesh is graded if this share of its triangles has an angle below so many degrees, and the
#: natural logarithms of the areas have this standard deviation; or if they have the larger one.
NEEDLES, THIN, SPREAD, WIDE = 0.04, 5.0, 1.2, 1.5
#: Every k-th triangle is looked at, these or a few more in all.
SAMPLE = 4_000
#: Then so many even steps are taken.
USUAL_STEPS = 2
#: If more degrees of mean angle error are left there, or with that share of needles alone,
#: triangles are split so many times, as long as there are not more of them than this.
POOR, USUAL_SPLITS, MAX_TRIANGLES = 5.0, 2, 25_000


def better_if_graded(method: Callable[..., Parameterization]) -> Callable[..., Parameterization]:
    """Let an algorithm for disks have the parameters `even` and `splits`.

    It ends in at most `even` steps of :func:`evened`, and maps the surface once more with every
    triangle split into four `splits` times; the map with the smaller mean angle error is kept. None
    leaves both to the mesh: none on most, :data:`USUAL_STEPS` on graded ones, and up to
    :data:`USUAL_SPLITS` where a map is poor that needles or grading may have spoilt.
    """

    @functools.wraps(method)
    def better(mesh: DiskMesh, **parameters: Any) -> Parameterization:
        own = method(mesh, **parameters)
        steps, splits = parameters.get("even"), parameters.get("splits")
        needles, graded = _shape(mesh) if None in (steps, splits) else (False, False)
        if steps is None:
            steps = USUAL_STEPS if graded else 0
        own = _evened(mesh, own, steps)
        if splits is None:
            poor = (needles or graded) and angle_errors(mesh, own.uv).mean() > POOR
            splits = usual_splits(mesh.m) if poor else 0
        if not splits:
            return own
        made = _by_split_surface(method, mesh, splits, parameters)
        if made is not None:
            made = _evened(mesh, made, steps)
            if _cost(mesh, made.uv) < _cost(mesh, own.uv):
                return replace(made, extras=made.extras | {"splits": splits})
        return replace(own, extras=own.extras | {"splits": 0})

    return better


def is_graded(mesh: DiskMesh) -> bool:
    """Whether the areas of a mesh vary so much that E_C misses triangles; needles tell sooner.

    Its least E_C may then have far larger angle errors than needed.

    Examples
    --------
    >>> import cembench
    >>> is_graded(cembench.surface("hemi-ellipsoid", 600))
    False
    """
    return _shape(mesh)[1]


def _shape(mesh: DiskMesh) -> tuple[bool, bool]:
    """Return whether a mesh has many needles, and whether it is graded."""
    dots, double_area = corner_products(mesh.V, mesh.F[:: max(1, mesh.m // SAMPLE)])
    thin = dots.max(axis=1) * np.tan(np.deg2rad(THIN)) > double_area
    needles = bool(thin.mean() > NEEDLES)
    return needles, bool(np.log(double_area).std() > (SPREAD if needles else WIDE))


def usual_splits(faces: int) -> int:
    """Return how often a mesh of so many triangles is split where its map is poor.

    Examples
    --------
    >>> usual_splits(100), usual_splits(5_000), usual_splits(100_000)
    (2, 1, 0)
    """
    return sum(faces * 4**k <= MAX_TRIANGLES for k in range(1, USUAL_SPLITS + 1))


def _by_split_surface(
    method: Callable[..., Parameterization],
    mesh: DiskMesh,
    splits: int,
    parameters: dict[str, Any],
) -> Parameterization | None:
    """Return the map of a mesh that a method makes with its triangles split; None if it fails."""
    import igl  # imported here: loading it takes a tenth of a second

    with phase("assembly"):
        V, F = igl.upsample(mesh.V, mesh.F, splits)
        fine = DiskMesh.trusted(V, F.astype(np.int64))
    try:
        made = method(fine, **parameters | {"repair": False})  # the given mesh's folds are repaired
    except AlgorithmFailed:
        return None
    repair = parameters.get("repair", True)
    if repair and parameters.get("last_resort", True):
        uv, repairs = valid_map(mesh, made.uv[: mesh.n].copy())
    else:
        uv, repairs = accepted_repair(mesh, made.uv[: mesh.n].copy(), repair=repair)
    return replace(made, uv=uv, extras=made.extras | repairs)


def _evened(mesh: DiskMesh, made: Parameterization, steps: int) -> Parameterization:
    """Return a map after at most so many even steps."""
    if not steps:
        return made
    uv, taken = evened(mesh, made.uv, steps)
    return replace(made, uv=uv, extras=made.extras | {"even_steps": taken})


def _cost(mesh: DiskMesh, uv: Any) -> tuple[int, float]:
    """Return the folds of a map, then its mean angle error."""
    return flipped_triangles(mesh, uv), float(angle_errors(mesh, uv).mean())
