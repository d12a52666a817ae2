"""Fast disk map: a harmonic map corrected in the half plane, then by reflection."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import numpy as np
import scipy
from numpy.typing import NDArray
from pydantic import Field

from cembench.conformal.beltrami import (
    beltrami_coefficients,
    generalised_weights,
    linear_beltrami_solver,
    unfolded,
    weights_of_map,
)
from cembench.conformal.doubling import DoubledSurface, doubled
from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.harmonic import (
    HarmonicExtension,
    arc_length_circle,
    harmonic_extension,
)
from cembench.conformal.laplacian import laplacian, laplacian_of_weights
from cembench.conformal.last_resort import with_last_resort
from cembench.conformal.planar import polygon_area, signed_areas
from cembench.core.arrays import Complex
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed, NotPositiveDefinite
from cembench.core.parameterization import Parameterization
from cembench.linear_algebra.cholesky import keeps_factors
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

#: Largest modulus of a reflected vertex; one at the centre would go to infinity.
FARTHEST = 1e8
#: The public program's factor on a reflected triangle's coefficient; the exact one is 1.
MIRRORED_SHARE = 1 / 3


@algorithm(
    "fdm",
    title="FDM",
    target="disk",
    source="Choi & Lui, Fast disk conformal parameterization, J. Sci. Comput. 65 (2015)",
)
@with_last_resort
def fdm(
    mesh: DiskMesh,
    *,
    tolerance: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 1e-5,
    max_iterations: Annotated[int, Field(ge=1, le=1_000_000)] = 5,
    delaunay: bool = False,
    public_program: bool = False,
    repair: bool = True,
    last_resort: bool = False,
) -> Parameterization:
    """Map a disk by correcting a harmonic map, first in the half plane and then by reflection.

    Faithful to the published method and to the program that its authors made public: a harmonic map
    whose boundary keeps its arc length; one correction after the Cayley transform to the upper half
    plane; then, on the map reflected in the circle, one linear Beltrami solve and one normalisation
    per iteration, until the mean of abs(mu) changes by less than `tolerance`. Taken from that
    program where the article leaves it open: the boundary edge that goes to z = 1 has the least sum
    of abs(mu) over its two ends, with mu of a vertex the mean over its triangles; a reflected
    triangle's coefficient carries a factor 1/3; the 1 % of vertices held far out are counted on the
    doubled surface. The published standard deviations of angles need both of the first two
    (docs/algorithms.md has the figures); the third changes no printed digit.

    Decided here: the midpoint of that edge is taken across the branch cut of the argument; a start
    that folds is replaced by uniform weights; triangles that have collapsed in the plane take the
    surface's cotangents, the limit of what their coefficients give; a vertex at the centre is
    reflected to a modulus of 1e8. If the last map folds, boundary vertices that changed places are
    put in order, and patches around the folds are laid out again (`fold_repairs` counts the
    rounds). On meshes of a few hundred triangles, of which the held vertices are a large share, the
    iteration can diverge: the returned map is the iterate of the least mean abs(mu), and
    `iterations_dropped` counts those after it, 0 elsewhere. The last solve of each iteration has
    the matrix of the start: where factors are reused so is this one, which spares five of the
    program's 13 factorisations; where they are not, its weights are computed from the map each
    time. `delaunay` takes the weights of the intrinsic Delaunay triangulation in every solve whose
    matrix is the surface's own Laplacian: in all but that of the reflected map.
    """
    if not len(mesh.interior):
        raise AlgorithmFailed("the mesh has no interior vertex, so there is nothing to correct")
    L = laplacian(mesh, delaunay=delaunay)
    own = L if delaunay else None
    inside = HarmonicExtension(L, mesh.boundary)
    shared = inside if delaunay or keeps_factors() else None
    double = doubled(mesh)

    def energy(z: Complex) -> float:
        return 0.5 * float(np.vdot(z, L @ z).real) - polygon_area(z[mesh.boundary])

    z = _corrected_in_half_plane(mesh, _start(mesh, inside), own, public_program)
    mu = _coefficients(mesh, z)
    distortion, history = _mean_modulus(mu), [energy(z)]
    best, least, dropped = z, distortion, 0
    for _ in range(max_iterations):
        z = _corrected_by_reflection(mesh, double, z, mu, shared)
        mu = _coefficients(mesh, z)
        before, distortion = distortion, _mean_modulus(mu)
        history.append(energy(z))
        dropped += 1
        if public_program or distortion < least + tolerance:
            best, least, dropped = z, min(distortion, least), 0
        if abs(before - distortion) < tolerance:
            break
    z, folds = accepted_repair(mesh, best, L, repair=repair)
    kept = history[: len(history) - dropped]
    extras = {**folds, "iterations_dropped": dropped}
    return Parameterization(z, len(kept) - 1, tuple(kept), extras)


def _coefficients(mesh: DiskMesh, z: Complex) -> Complex:
    with phase("beltrami"):
        return beltrami_coefficients(z, mesh.F, mesh.V)


def _mean_modulus(mu: Complex) -> float:
    """Return the mean of |mu|, with folds reversed and collapsed triangles as 1."""
    return float(np.nan_to_num(np.abs(unfolded(mu)), nan=1.0).mean())


def _start(mesh: DiskMesh, inside: HarmonicExtension) -> Complex:
    """Return the harmonic map that keeps arc length; with uniform weights if that one fails."""
    circle = arc_length_circle(mesh) * np.exp(2j * np.pi / 100)
    try:
        z = inside(circle)
        if (signed_areas(z, mesh.F) > 0).all():
            return z
    except NotPositiveDefinite:
        pass  # uniform weights, below, are always positive
    uniform = laplacian_of_weights(mesh.F, np.ones(mesh.F.shape), mesh.n)
    return harmonic_extension(uniform, mesh.boundary, circle)


def _corrected_in_half_plane(
    mesh: DiskMesh, z: Complex, L: scipy.sparse.csc_array | None, public_program: bool
) -> Complex:
    """Make the map conformal except near z = 1, where it is kept ("north pole").

    L is the surface's Laplacian if that is the matrix to use.
    """
    b = mesh.boundary
    p, q = _ends_of_best_edge(mesh, z)
    z = z / (_divisor_of_public_program(p, q) if public_program else _middle(p, q))
    w = 1j * (1 + z) / (1 - z)
    w[b] = w[b].real
    if L is None:
        with phase("assembly"):
            weights = weights_of_map(w, mesh.F, _coefficients(mesh, w), mesh.V)
        solve = partial(linear_beltrami_solver, mesh.F, weights)
    else:
        solve = partial(harmonic_extension, L)
    kept = np.setdiff1d(_largest(z.real, max(round(mesh.n / 5), 100)), b)
    kept = np.union1d(kept, [np.argmin(w.real), np.argmax(w.real)])
    x = solve(kept, w.real[kept])
    kept = np.union1d(kept, b)
    y = solve(kept, w.imag[kept])
    w = x + 1j * y
    return (w - 1j) / (w + 1j)


def _ends_of_best_edge(mesh: DiskMesh, z: Complex) -> tuple[complex, complex]:
    """Return the ends, on the circle, of the boundary edge with the least |mu| at them."""
    corners, b = mesh.F.ravel(), mesh.boundary
    mu = np.repeat(_coefficients(mesh, z), 3)
    total = np.bincount(corners, mu.real) + 1j * np.bincount(corners, mu.imag)
    at = np.abs(total / np.bincount(corners))[b]
    k = int(np.argmin(at + np.roll(at, -1)))
    return complex(z[b[k]]), complex(z[np.roll(b, -1)[k]])


def _middle(p: complex, q: complex) -> complex:
    """Return the midpoint of the shorter arc between two points of the unit circle."""
    return complex(p / abs(p) * np.exp(0.5j * np.angle(q / p)))


def _divisor_of_public_program(p: complex, q: complex) -> complex:
    """Return the public program's divisor: for angles a and b it takes a + b/2."""
    return complex(np.exp(1j * (np.angle(p) + np.angle(q) / 2)))


def _corrected_by_reflection(
    mesh: DiskMesh,
    double: DoubledSurface,
    z: Complex,
    mu: Complex,
    inside: HarmonicExtension | None,
) -> Complex:
    """Solve on the map and its mirror image at once, then put the boundary on the circle.

    The second matrix is the surface's own Laplacian, whatever the map: `inside` solves with that.
    """
    b = mesh.boundary
    both = np.empty(double.size, dtype=np.complex128)
    both[double.mirror] = _reflected(z)
    both[: mesh.n] = z
    with phase("assembly"):
        mirrored = MIRRORED_SHARE * _mirrored(mesh, z, mu)
        weights = np.concatenate(
            [
                weights_of_map(z, mesh.F, mu, mesh.V),
                generalised_weights(both, double.F[mesh.m :], mirrored),
            ]
        )
    far = _largest(np.abs(both), max(round(double.size / 100), 100))
    z = linear_beltrami_solver(double.F, weights, far, both[far])[: mesh.n]
    z = z - z.mean()
    z = z / max(float(np.abs(z).max()), 1.0)
    modulus = np.abs(z[b])
    if not modulus.min() > 0:
        raise AlgorithmFailed("a boundary vertex is mapped to the centre")
    if inside is not None:
        return inside(z[b] / modulus)
    with phase("assembly"):
        weights = weights_of_map(z, mesh.F, _coefficients(mesh, z), mesh.V)
    return linear_beltrami_solver(mesh.F, weights, b, z[b] / modulus)


def _mirrored(mesh: DiskMesh, z: Complex, mu: Complex) -> Complex:
    """Return the coefficients of the map reflected in the circle, triangle by triangle."""
    turn = ((z / np.conj(_off_centre(z))) ** 2)[mesh.F].sum(axis=1)
    return np.conj(unfolded(mu)) * turn / np.maximum(np.abs(turn), np.finfo(float).tiny)


def _off_centre(z: Complex) -> Complex:
    """Move vertices away from the centre, to at least the inverse of `FARTHEST`."""
    z = z.copy()
    z[np.abs(z) < 1 / FARTHEST] = 1 / FARTHEST
    return z


def _reflected(z: Complex) -> Complex:
    mirrored: Complex = 1 / _off_centre(z).conj()
    return mirrored


def _largest(x: NDArray[np.float64], k: int) -> NDArray[np.int64]:
    """Return the indices of the k largest entries, at most all but one."""
    return np.argsort(-x, kind="stable")[: min(k, len(x) - 1)]
