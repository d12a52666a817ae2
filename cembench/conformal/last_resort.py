"""A valid map of a disk wherever doubles hold one, whatever an algorithm returned.

A triangle whose three corners lie on arcs of length h has an area of about h^3 / 4, and its sign is
lost in rounding below :data:`LEAST_ARC`. So arcs at folds are widened to that. Then patches of the
interior around the folds are laid out again, small ones first, by two methods: the conformal energy
with a barrier (:mod:`cembench.conformal.untangling`), and mean value weights, which are positive.
In every patch the one of better angles is taken. If folds remain, the whole interior gets mean
value weights: on a convex boundary such a map has no folds (Tutte 1963, Floater 2003).
"""

from __future__ import annotations

import contextlib
import functools
import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.conformal.fold_repair import figures
from cembench.conformal.folds import LEAST_ARC as DISTINCT
from cembench.conformal.folds import in_order
from cembench.conformal.harmonic import arc_length_circle
from cembench.conformal.mean_value import convex_extension, mean_value_weights
from cembench.conformal.metrics import angle_errors, flipped_triangles
from cembench.conformal.planar import folded_triangles
from cembench.conformal.untangling import untangled
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.topology import vertex_graph
from cembench.mesh.triangle_mesh import DiskMesh

Complex = NDArray[np.complex128]
Mask = NDArray[np.bool_]
DiskAlgorithm = Callable[..., Parameterization]

#: Shortest arc, in radians, between the corners of a triangle that doubles resolve.
LEAST_ARC = 3e-8
#: Numbers of rings of vertices around the folds that are laid out again, in this order.
RINGS = (1, 2, 4, 8, 16, 32)
#: Patches are no remedy if more than this share of the triangles fold, and a map whose mean angle
#: error, in degrees, is above BAD may be worse than mean value weights everywhere.
MOST_FOLDED, BAD = 0.1, 30.0


def with_last_resort(method: DiskAlgorithm) -> DiskAlgorithm:
    """Let an algorithm for disks end in a valid map if its `repair` and `last_resort` are on.

    Its own map, or its failure, is the start of :func:`valid_map`.
    """
    defaults = {
        name: parameter.default for name, parameter in inspect.signature(method).parameters.items()
    }

    @functools.wraps(method)
    def always_valid(mesh: DiskMesh, **parameters: Any) -> Parameterization:
        chosen = defaults | parameters
        if not (chosen["repair"] and chosen["last_resort"]):
            return method(mesh, **parameters)
        try:
            own = method(mesh, **parameters | {"repair": False})
        except AlgorithmFailed as error:
            uv, extras = valid_map(mesh, None)
            return Parameterization(uv, extras=extras | {"failure": str(error)})
        crowded = own.extras.get("stopped") == "crowded"
        uv, extras = valid_map(mesh, own.uv, crowded=crowded)
        return Parameterization(uv, own.iterations, own.energy_history, own.extras | extras)

    return always_valid


def valid_map(
    mesh: DiskMesh, own: Complex | None, *, crowded: bool = False
) -> tuple[Complex, dict[str, Any]]:
    """Return a map without folds, as close to an algorithm's own as its angles allow.

    Parameters
    ----------
    mesh : DiskMesh
        The surface.
    own : complex (n,) or None
        Its map with the boundary on the unit circle; None if the algorithm failed.
    crowded : bool
        Whether arcs of `own` are longer than they should be, because doubles hold no shorter ones.

    Returns
    -------
    z : complex (n,)
        The map; `own` itself if that is valid and not crowded. It is folded only if doubles do not
        hold the mean value map and Tutte's either.
    extras : dict
        ``fold_repairs``, ``folded_before_repair`` and ``before_repair`` as for
        :func:`cembench.conformal.fold_repair.accepted_repair`. Where arcs were widened or mean
        value weights used, ``last_resort`` has ``arcs_widened`` and ``mean_value_vertices``, the
        numbers of boundary vertices that were moved and of interior vertices that were placed so.

    Examples
    --------
    >>> import cembench
    >>> disk = cembench.surface("flat-disk", 600)
    >>> z, extras = valid_map(disk, None)
    >>> extras["last_resort"]["mean_value_vertices"] == len(disk.interior)
    True

    """
    with phase("folds"):
        folded = 0 if own is None else flipped_triangles(mesh, own)
        extras: dict[str, Any] = {"fold_repairs": 0, "folded_before_repair": folded}
        if own is None:
            maps = []
        elif not folded:
            maps = [(own, _resort(0, 0))]
        else:
            extras["before_repair"] = figures(mesh, own, folded)
            z, extras["fold_repairs"], resort = _repaired_patches(mesh, own, folded)
            maps = [(z, resort)]
        if not maps or crowded or _cost(mesh, maps[0][0]) > (0, BAD if folded else np.inf):
            extras["fold_repairs"] += 1
            maps += _convex_maps(mesh, own)
        uv, resort = min(maps, key=lambda one: _cost(mesh, one[0]))
    return uv, extras | ({"last_resort": resort} if any(resort.values()) else {})


def _resort(arcs_widened: int, mean_value_vertices: int) -> dict[str, int]:
    """Return the record of what the last resort changed."""
    return {"arcs_widened": arcs_widened, "mean_value_vertices": mean_value_vertices}


def _cost(mesh: DiskMesh, z: Complex) -> tuple[int, float]:
    """Return the number of folds and the mean angle error of a map."""
    return flipped_triangles(mesh, z), float(angle_errors(mesh, z).mean())


def _repaired_patches(
    mesh: DiskMesh, z: Complex, count: int
) -> tuple[Complex, int, dict[str, int]]:
    """Return the map with patches around its folds laid out again, the rounds and the record."""
    own, b, rounds = z, mesh.boundary, 0
    held, by_means = np.zeros((2, mesh.n), dtype=bool)
    held[b] = True
    graph = vertex_graph(mesh.F, mesh.n)
    W = mean_value_weights(mesh.V, mesh.F)
    for rings in RINGS if count <= MOST_FOLDED * mesh.m else ():
        folded = folded_triangles(z, mesh.F)
        if not len(folded):
            break
        # At first arcs are widened only where no layout of the interior removes the fold.
        stuck = folded if rounds else folded[held[mesh.F[folded]].all(axis=1)]
        widened = _widened(z[b], np.isin(b, mesh.F[stuck]))
        if widened is None:
            break
        z = z.copy()
        z[b] = widened
        near = np.zeros(mesh.n, dtype=bool)
        near[mesh.F[np.concatenate([folded, folded_triangles(z, mesh.F)])]] = True
        for _ in range(rings):
            near |= graph @ near.astype(np.float64) > 0
        free = near & ~held
        z = _better_patches(mesh, z, free, graph, W, by_means) if free.any() else z
        rounds += 1
    return z, rounds, _resort(int((z[b] != own[b]).sum()), int(by_means.sum()))


def _better_patches(
    mesh: DiskMesh,
    z: Complex,
    free: Mask,
    graph: scipy.sparse.csr_array,
    W: scipy.sparse.csr_array,
    by_means: Mask,
) -> Complex:
    """Return the map with every patch of free vertices in its better layout without folds.

    A patch without such a layout stays as it is. `by_means` (n,) marks vertices that mean value
    weights placed; it is updated.
    """
    laid_out, patch = untangled(mesh, z, free, graph)
    layouts = [laid_out]
    with contextlib.suppress(AlgorithmFailed):
        layouts.append(convex_extension(W, np.flatnonzero(~free), np.flatnonzero(free), z))
    inside = patch >= 0
    T, of = mesh.F[inside], patch[inside]
    errors = [np.bincount(of, _error_of_triangles(mesh, layout, inside)) for layout in layouts]
    best = np.argmin(errors, axis=0)
    choice = np.where(np.isfinite(np.min(errors, axis=0)), best, -1)
    chosen = np.full(mesh.n, -1)
    chosen[T] = choice[of][:, None]
    chosen[~free] = -1
    z = z.copy()
    for k, layout in enumerate(layouts):
        z[chosen == k] = layout[chosen == k]
    by_means[chosen >= 0] = chosen[chosen >= 0] == 1
    return z


def _error_of_triangles(mesh: DiskMesh, z: Complex, some: Mask) -> NDArray[np.float64]:
    """Return the angle errors of some triangles of a map, infinite if they fold."""
    errors = angle_errors(mesh, z)[some].sum(axis=1)
    errors[folded_triangles(z, mesh.F[some])] = np.inf
    return errors


def _widened(circle: Complex, at: Mask) -> Complex | None:
    """Return a boundary in order, arcs at some vertices being at least :data:`LEAST_ARC`.

    None if it does not go around the circle.
    """
    try:
        return in_order(circle, np.where(at | np.roll(at, -1), LEAST_ARC, DISTINCT))
    except AlgorithmFailed:
        return None


def _convex_maps(mesh: DiskMesh, own: Complex | None) -> list[tuple[Complex, dict[str, int]]]:
    """Return maps with convex weights everywhere, on the algorithm's boundary and by arc length."""
    b, i = mesh.boundary, mesh.interior
    circles = [arc_length_circle(mesh)]
    widened = None if own is None else _widened(own[b], np.ones(len(b), dtype=bool))
    if widened is not None:
        circles.append(widened)
    maps = []
    for W in (mean_value_weights(mesh.V, mesh.F), vertex_graph(mesh.F, mesh.n)):
        for circle in circles:
            z = np.zeros(mesh.n, dtype=np.complex128)
            z[b] = circle
            moved = len(b) if own is None else int((own[b] != circle).sum())
            with contextlib.suppress(AlgorithmFailed):
                z = convex_extension(W, b, i, z) if len(i) else z
                maps.append((z, _resort(moved, len(i))))
        if any(not flipped_triangles(mesh, z) for z, _ in maps):
            break
    return maps
