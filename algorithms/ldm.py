"""Linear disk map: half of a map of the doubled surface to the sphere."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from cembench.conformal.beltrami import (
    beltrami_coefficients,
    linear_beltrami_solver,
    weights_of_map,
)
from cembench.conformal.doubling import DoubledSurface, doubled_surface
from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.harmonic import harmonic_extension
from cembench.conformal.last_resort import with_last_resort
from cembench.conformal.moebius import three_point_map
from cembench.conformal.planar import polygon_area
from cembench.conformal.spherical import balanced_planar_map
from cembench.conformal.stereographic import to_plane, to_sphere
from cembench.core.arrays import Complex
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

#: Number of vertices nearest to the south pole that are held while the north is corrected.
HELD = 50
#: Minimal distance of a vertex from the south pole when projecting from there.
NEAREST = 1e-8


@algorithm(
    "ldm",
    title="LDM",
    target="disk",
    source="Choi & Lui, A linear formulation for disk conformal parameterization (2015)",
)
@with_last_resort
def ldm(
    mesh: DiskMesh, *, delaunay: bool = False, repair: bool = True, last_resort: bool = False
) -> Parameterization:
    """Map a disk by half of a conformal map of the doubled surface to the sphere.

    Faithful to the published method and to the program that its authors made public: the doubled
    surface is mapped to the plane harmonically except at its most regular triangle, the two poles
    are balanced, the distortion at the north pole is corrected with the 50 vertices nearest to the
    south pole held, a Moebius map through three boundary vertices and the projection of one half
    give the disk, and a last solve with the boundary on the circle removes the remaining distortion
    by composition. A handful of linear solves, no iteration.

    Decided here: the first of the three boundary vertices is the one farthest from the mean vertex,
    so that the numbering plays no role, where the program takes the first of its list (on Chinese
    Lion 242 of the 245 choices give the published digits, this one among them); the disk's width is
    that of its boundary; a vertex exactly at the south pole is moved by 1e-8; triangles that have
    collapsed in the plane take the surface's cotangents, the limit of what their coefficients give.
    If the last map folds, boundary vertices that changed places are put in order, and patches
    around the folds are laid out again (`fold_repairs` counts the rounds). `delaunay` takes the
    weights of the intrinsic Delaunay triangulation in every solve: both linear Beltrami solvers
    have the surface's own Laplacian as their matrix.
    """
    return map_numbered(mesh, farthest_from_mean(mesh), delaunay=delaunay, repair=repair)


def map_numbered(
    mesh: DiskMesh,
    first: int,
    *,
    mirrored: bool = False,
    delaunay: bool = False,
    repair: bool = True,
) -> Parameterization:
    """Map by LDM with the choices that depend on the numbering of a mesh given explicitly.

    Parameters
    ----------
    mesh : DiskMesh
        The surface.
    first : int
        Index in the boundary loop of the first of the three vertices, counted from 0.
    mirrored : bool
        Whether the most regular triangle is taken from the mirror copy, where it is equally
        regular.
    delaunay, repair : bool
        As for `ldm`.
    """
    L, double, L_double, V = doubled_surface(mesh, delaunay=delaunay)
    z = balanced_planar_map(L_double, V, np.roll(double.F, mesh.m if mirrored else 0, axis=0))
    w = _corrected_at_north(double, V, z, L_double if delaunay else None)
    z = _laid_on_disk(mesh, w[: mesh.n], first)
    b = mesh.boundary
    if delaunay:
        z = harmonic_extension(L, b, z[b])
    else:
        z = linear_beltrami_solver(mesh.F, _weights(z, mesh.F, mesh.V), b, z[b])
    try:
        z, folds = accepted_repair(mesh, z, L, repair=repair)
    except AlgorithmFailed as error:
        raise AlgorithmFailed(
            f"LDM does not lay the boundary of this surface around the disk: {error}. This is a "
            "limit of the method where a surface is long for its boundary; use direct-cem, or "
            "last_resort=True"
        ) from error
    return Parameterization(z, extras=folds)


def _weights(z: Complex, F: NDArray[np.int64], V: NDArray[np.float64]) -> NDArray[np.float64]:
    with phase("beltrami"):
        mu = beltrami_coefficients(z, F, V)
    with phase("assembly"):
        return weights_of_map(z, F, mu, V)


def _corrected_at_north(
    double: DoubledSurface, V: NDArray[np.float64], z: Complex, L: scipy.sparse.csc_array | None
) -> Complex:
    """Make the map conformal at the north pole too; return it as projected from the south pole.

    L is the doubled surface's Laplacian if that is the matrix to use.
    """
    near = np.abs(z)
    held = np.argsort(near, kind="stable")[: min(HELD, len(z) - 1)]
    z = np.where(near < NEAREST, NEAREST, z)
    w: Complex = 1 / z.conj()
    if L is not None:
        return harmonic_extension(L, held, w[held])
    return linear_beltrami_solver(double.F, _weights(w, double.F, V), held, w[held])


def farthest_from_mean(mesh: DiskMesh) -> int:
    """Return the index in the boundary loop of the vertex farthest from the mean vertex."""
    apart = np.linalg.norm(mesh.V[mesh.boundary] - mesh.V.mean(axis=0), axis=1)
    return int(np.argmax(apart))


def _laid_on_disk(mesh: DiskMesh, w: Complex, first: int) -> Complex:
    """Map one half of the sphere, given by w, to the disk, and its boundary to the circle."""
    b = np.roll(mesh.boundary, -first)
    loop = to_sphere(w[b], "south")
    far = int(np.argmax(np.linalg.norm(loop - loop[0], axis=1)))
    between = (far + 1) // 2 if far > 1 else (far + len(b)) // 2
    chosen = [0, far, between]
    w = three_point_map(w[b][chosen], _congruent(loop[chosen]))(w)
    S = to_sphere(w)
    S[:, 2] -= S[b, 2].mean()
    z = to_plane(S, "south" if S[:, 2].mean() >= 0 else "north")
    z[~np.isfinite(z)] = 0.0  # a vertex at the pole itself; the last solve places it
    z *= 2 / np.ptp(z.real[b])
    z -= complex(z.real[b].min(), z.imag[b].min()) + (1 + 1j)
    if polygon_area(z[b]) < 0:
        z = -np.conj(z)
    modulus = np.abs(z[b])
    if not modulus.min() > 0:
        raise AlgorithmFailed("a boundary vertex is mapped to the centre of the disk")
    z[b] /= modulus
    return z


def _congruent(corners: NDArray[np.float64]) -> Complex:
    """Return a congruent planar copy of a triangle (3, 3), its first side about 0 on the axis."""
    a, b, c = corners
    length = float(np.linalg.norm(b - a))
    axis = (b - a) / length
    x = float(np.dot(c - a, axis))
    y = float(np.linalg.norm(c - a - x * axis))
    return np.array([-length / 2, length / 2, complex(x - length / 2, y)])
