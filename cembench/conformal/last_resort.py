"""A valid map of a disk wherever doubles hold one, whatever an algorithm returned.

A triangle whose three corners lie on arcs of length h has an area of about h^3 / 4, and its sign is
lost in rounding below :data:`MIN_ARC`; so arcs at folds are widened to that. The interior around
the folds is laid out again in patches (:mod:`cembench.conformal.folds`). Where that is not enough,
or costs angles, the surface's mean value weights place the vertices of the smallest patches around
the folds that are left, and E_C is lowered there by steps that fold nothing. Where that costs
angles too, every interior vertex becomes a mean of its neighbours with positive weights: mean value
weights of the image, which reproduce it, except near folds, where they are the surface's. On a
convex boundary such a map has no folds (Tutte 1963; Floater 2003). At worst the surface's weights
are used everywhere.
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

from cembench.conformal.fold_repair import MAX_COST, figures
from cembench.conformal.folds import MIN_ARC as DISTINCT
from cembench.conformal.folds import in_order, interior_without_folds, without_folds
from cembench.conformal.harmonic import arc_length_circle
from cembench.conformal.laplacian import laplacian
from cembench.conformal.mean_value import convex_extension, mean_value_weights
from cembench.conformal.metrics import flipped_triangles
from cembench.conformal.planar import folded_triangles
from cembench.conformal.untangling import FIRST, untangled
from cembench.core.arrays import Complex, Mask
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.topology import vertex_graph
from cembench.mesh.triangle_mesh import DiskMesh

DiskAlgorithm = Callable[..., Parameterization]

#: Shortest arc, in radians, between the corners of a triangle that doubles resolve.
MIN_ARC = 3e-8
#: Numbers of rings of vertices around the folds that are laid out again; more of them do not help.
PATCH_RINGS = (1, 2)
#: Numbers of rings of vertices around the folds that get the surface's weights.
RINGS = (0, 2, 8)
#: Patches are no remedy if more than this share of the triangles fold; they are all that is tried
#: if they raise the mean angle error by no more than the share CHEAP.
MAX_FOLDED, CHEAP = 0.3, 0.01
#: Rings of vertices around folds that mean value weights place in patches, and how many times.
MEANS_RINGS, MEANS_ROUNDS = (0, 1, 2, 4), 8
#: A valid map is good enough if its mean angle error is at most so many degrees above that of the
#: algorithm's own map, and not above so many.
ENOUGH, GOOD = 1.0, 10.0
#: Up to this size the whole interior is laid out again, twice, if the above costs more, or is bad.
MAX_TRIANGLES = 20_000
#: Newton steps for that, and for patches. They start at a valid map; two are often enough.
LAYOUT_STEPS = 8
#: A map whose mean angle error, in degrees, is above this may be worse than mean value weights
#: everywhere.
BAD = 30.0


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
        folded = own.extras.get("folded_before_repair")
        uv, extras = valid_map(mesh, own.uv, crowded=crowded, folded=folded)
        return Parameterization(uv, own.iterations, own.energy_history, own.extras | extras)

    return always_valid


def valid_map(
    mesh: DiskMesh, own: Complex | None, *, crowded: bool = False, folded: int | None = None
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
    folded : int, optional
        The number of folded triangles of `own`, if known.

    Returns
    -------
    z : complex (n,)
        The map; `own` itself if that is valid and not crowded. It is folded only if doubles hold
        neither the mean value map nor Tutte's.
    extras : dict
        ``fold_repairs``, ``folded_before_repair`` and ``before_repair`` as for
        :func:`cembench.conformal.fold_repair.accepted_repair`. Where arcs were widened or the
        surface's mean value weights used, ``last_resort`` has ``moved_boundary_vertices`` and
        ``mean_value_vertices``, the numbers of vertices concerned.

    Examples
    --------
    >>> import cembench
    >>> disk = cembench.surface("flat-disk", 600)
    >>> z, extras = valid_map(disk, None)
    >>> extras["last_resort"]["mean_value_vertices"] == len(disk.interior)
    True
    """
    with phase("folds"):
        if folded is None:
            folded = 0 if own is None else flipped_triangles(mesh, own)
        extras: dict[str, Any] = {"fold_repairs": 0, "folded_before_repair": folded}
        if own is not None and not (folded or crowded):
            return own, extras
        choice, enough = _Choice(mesh, own), 0.0
        if own is not None and folded:
            extras["before_repair"] = before = figures(mesh, own, folded)
            cheap = (1 + CHEAP) * before["angle_error_mean_deg"]
            enough = max(cheap, min(before["angle_error_mean_deg"] + ENOUGH, GOOD))
            extras["fold_repairs"] = _offer_patches(choice, own, folded)
            if not choice.reaches(cheap):
                _offer_means_in_patches(choice)
            if not choice.reaches(enough):
                extras["fold_repairs"] += _offer_harmonic_map(choice, own, folded)
            if not choice.reaches(enough):
                _offer_convex_maps(choice, own)
        if own is None or crowded or (folded and not choice.reaches(BAD)):
            _offer_mean_value_maps(choice, own)
        if not choice.reaches(min(enough, BAD)):
            _offer_layouts(choice)
        extras["fold_repairs"] += choice.solves
        b = mesh.boundary
        moved = len(b) if own is None else int(np.count_nonzero(choice.z[b] != own[b]))
        if moved or choice.by_means:
            extras["last_resort"] = {
                "moved_boundary_vertices": moved,
                "mean_value_vertices": choice.by_means,
            }
    return choice.z, extras


class _Choice:
    """The best map offered: fewest folds, E_C in bounds, then least mean angle error.

    E_C is in bounds up to a multiple of that of the algorithm's own map
    (:data:`cembench.conformal.fold_repair.MAX_COST`). It says nothing of maps with angle errors
    above :data:`BAD`, which come last.
    """

    def __init__(self, mesh: DiskMesh, own: Complex | None) -> None:
        self.mesh = mesh
        self.cost, self.most_energy = (mesh.m + 1, True, True, np.inf), np.inf
        #: Number of vertices of the best map that have the surface's weights; solves in all.
        self.by_means = self.solves = 0
        if own is not None:
            energy = figures(mesh, own, 0)["conformal_energy"]
            self.most_energy = MAX_COST["conformal_energy"] * max(energy, 0)
            self.offer(own)

    @functools.cached_property
    def graph(self) -> scipy.sparse.csr_array:
        """Which vertices share an edge."""
        return vertex_graph(self.mesh.F, self.mesh.n)

    @functools.cached_property
    def weights(self) -> scipy.sparse.csr_array:
        """Mean value weights of the surface."""
        return mean_value_weights(self.mesh.V, self.mesh.F)

    @functools.cached_property
    def inside(self) -> Mask:
        """Which vertices lie inside."""
        return ~_rings(self.graph, self.mesh.boundary, 0)

    def offer(self, z: Complex, by_means: int = 0) -> None:
        """Keep a map if it is better."""
        folds = flipped_triangles(self.mesh, z)
        new = figures(self.mesh, z, folds)
        bad = new["angle_error_mean_deg"] > BAD
        above = not bad and new["conformal_energy"] > self.most_energy
        cost = (folds, bad, above, new["angle_error_mean_deg"])
        if cost < self.cost:
            self.z, self.cost, self.by_means = z, cost, by_means

    def reaches(self, angle: float) -> bool:
        """Whether the best map has no folds, E_C in bounds, and at most this mean angle error."""
        folds, _, above, error = self.cost
        return not folds and not above and error <= angle

    def offer_means(self, z: Complex, surface: Mask, W: scipy.sparse.csr_array) -> None:
        """Offer the map with the boundary of `z` and positive weights.

        They are W's at the vertices `surface` (n,), elsewhere mean value weights of the image z.
        """
        mesh, b, i = self.mesh, self.mesh.boundary, self.mesh.interior
        if not surface[i].all():
            with np.errstate(all="ignore"):  # folded triangles may have no area or length
                image = mean_value_weights(np.stack([z.real, z.imag], axis=1), mesh.F)
            image.data[~np.isfinite(image.data)] = 0
            share = surface.astype(np.float64)
            W = scipy.sparse.diags_array(share) @ W + scipy.sparse.diags_array(1 - share) @ image
        with contextlib.suppress(AlgorithmFailed):
            self.solves += 1
            means = convex_extension(scipy.sparse.csr_array(W), b, i, z) if len(i) else z
            self.offer(means, int(surface[i].sum()))


def _offer_patches(choice: _Choice, own: Complex, folded: int) -> int:
    """Offer the map with the interior around folds laid out again; return the rounds."""
    mesh = choice.mesh
    if folded > MAX_FOLDED * mesh.m:
        return 0
    # No layout of the interior removes a fold whose corners are all on the boundary.
    corners = mesh.F[folded_triangles(own, mesh.F)]
    stuck = corners[np.isin(corners, mesh.boundary).all(axis=1)]
    z = _widened(mesh, own, stuck)
    if z is None:
        return 0
    z, rounds = interior_without_folds(mesh, z, PATCH_RINGS)
    choice.offer(z)
    return rounds


def _offer_means_in_patches(choice: _Choice) -> None:
    """Offer the best map with the surface's mean value weights around folds, all else as it is.

    What folds at the edge of a patch makes it larger in the next round. Then E_C is lowered there
    by steps that fold nothing. The smallest patches that do are taken.
    """
    mesh, start = choice.mesh, choice.z
    folded = folded_triangles(start, mesh.F)
    if len(folded) > MAX_FOLDED * mesh.m:
        return
    graph, W, inside = choice.graph, choice.weights, choice.inside
    for rings in MEANS_RINGS:
        near = _rings(graph, mesh.F[folded], rings)
        z = _widened(mesh, start, np.flatnonzero(near))
        if z is None or not (near & inside).any():
            return
        for _ in range(MEANS_ROUNDS):
            free = near & inside
            choice.solves += 1
            try:
                z = convex_extension(W, np.flatnonzero(~free), np.flatnonzero(free), z)
            except AlgorithmFailed:
                break
            left = folded_triangles(z, mesh.F)
            if not len(left):
                choice.offer(z, int(free.sum()))
                lowered, _ = untangled(mesh, z, free, graph, LAYOUT_STEPS, first=0.0)
                choice.offer(lowered, int(free.sum()))
                return
            near |= _rings(graph, mesh.F[left], max(rings, 1))


def _offer_harmonic_map(choice: _Choice, own: Complex, folded: int) -> int:
    """Offer the map that repair alone makes: harmonic again, then patches; return the rounds."""
    mesh = choice.mesh
    if folded > MAX_FOLDED * mesh.m:
        return 0
    with contextlib.suppress(AlgorithmFailed):
        z, rounds = without_folds(mesh, laplacian(mesh, delaunay=True), own)
        choice.offer(z)
        return rounds
    return 0


def _offer_convex_maps(choice: _Choice, own: Complex) -> None:
    """Offer maps with the image's mean value weights except near its folds."""
    mesh, graph, W = choice.mesh, choice.graph, choice.weights
    folded = folded_triangles(own, mesh.F)
    for rings in RINGS:
        near = _rings(graph, mesh.F[folded], rings)
        z = _widened(mesh, own, np.flatnonzero(near))
        if z is None:
            return
        both = np.concatenate([folded, folded_triangles(z, mesh.F)])
        choice.offer_means(z, _rings(graph, mesh.F[both], rings), W)


def _offer_layouts(choice: _Choice) -> None:
    """Offer the best map with its interior laid out anew, where this takes a moment.

    First by steps that may fold on the way, which go farther, and then by steps that may not.
    """
    mesh = choice.mesh
    if choice.cost[0] or mesh.m > MAX_TRIANGLES or not choice.inside.any():
        return
    for first in (FIRST, 0.0):
        laid_out, _ = untangled(mesh, choice.z, choice.inside, choice.graph, LAYOUT_STEPS, first)
        choice.offer(laid_out, choice.by_means)


def _offer_mean_value_maps(choice: _Choice, own: Complex | None) -> None:
    """Offer maps with the surface's weights everywhere; uniform ones if these fold too."""
    mesh, everywhere = choice.mesh, np.ones(choice.mesh.n, dtype=bool)
    by_length = np.zeros(mesh.n, dtype=np.complex128)
    by_length[mesh.boundary] = arc_length_circle(mesh)
    widened = None if own is None else _widened(mesh, own, mesh.boundary)
    for W in (choice.weights, choice.graph):
        choice.offer_means(by_length, everywhere, W)
        if widened is not None:
            choice.offer_means(widened, everywhere, W)
        if not choice.cost[0]:
            return


def _rings(graph: scipy.sparse.csr_array, vertices: NDArray[np.int64], count: int) -> Mask:
    """Return which vertices (n,) are at most `count` edges away from some vertices."""
    near = np.zeros(graph.shape[0], dtype=bool)
    near[vertices] = True
    for _ in range(count):
        near |= graph @ near.astype(np.float64) > 0
    return near


def _widened(mesh: DiskMesh, z: Complex, vertices: NDArray[np.int64]) -> Complex | None:
    """Return the map with its boundary in order and arcs at these vertices wide enough.

    None if the boundary does not go around the circle.
    """
    at = np.isin(mesh.boundary, vertices)
    least = np.where(at | np.roll(at, -1), MIN_ARC, DISTINCT)
    widened = z.copy()
    try:
        widened[mesh.boundary] = in_order(z[mesh.boundary], least)
    except AlgorithmFailed:
        return None
    return widened
