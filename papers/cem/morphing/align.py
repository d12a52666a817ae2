"""Moebius alignment of the conformal maps of two surfaces to the disk.

Conformal maps of the disk, z -> e^{i t} (z - a) / (1 - conj(a) z), have three degrees of freedom:
the point a that goes to the centre, and the rotation t. The first landmark goes to the centre and
further ones fix the rotation. Without landmarks, the conformal barycentre and the curvature do so.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, optimize

from cembench.conformal.folds import interior_without_folds
from cembench.conformal.gauge import gauge_measure, moved_to_gauge
from cembench.conformal.moebius import Moebius
from cembench.conformal.planar import folded_triangles, signed_areas
from cembench.conformal.resample import interpolated, locate
from cembench.core.arrays import Complex, Real
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.triangle_mesh import DiskMesh

Ints = NDArray[np.int64]

#: Polar grid on which two surfaces are compared: numbers of radii and directions.
RADII, DIRECTIONS = 24, 256
#: Radius of the outermost circle of that grid; closer to the boundary, maps depend on its cut.
OUTERMOST = 0.95


def to_centre(a: complex, turn: float = 0.0) -> Moebius:
    """Return the Moebius map of the unit disk that takes a, |a| < 1, to 0 and then rotates."""
    e = complex(np.exp(1j * turn))
    return Moebius(e, -e * a, -complex(a).conjugate(), 1.0)


def best_turn(z: Complex, targets: Complex) -> float:
    """Return the rotation angle about 0 that brings points closest to their targets."""
    return float(np.angle(np.vdot(z, targets)))


def without_new_folds(mesh: DiskMesh, z: Complex) -> Complex:
    """Return the map without the folds that a Moebius map caused.

    A Moebius map bends edges, but triangles stay straight, so large triangles near the boundary may
    fold. They are repaired by :func:`cembench.conformal.folds.interior_without_folds`; mostly
    nothing changes.
    """
    if (signed_areas(z, mesh.F) > 0).all():
        return z
    z, _ = interior_without_folds(mesh, z)
    if folds := len(folded_triangles(z, mesh.F)):
        raise AlgorithmFailed(
            f"a Moebius map of the disk folds {folds} triangle(s), and they cannot be unfolded "
            "with the boundary fixed: the mesh is too coarse there"
        )
    return z


def centred(mesh: DiskMesh, z: Complex, landmarks: Ints) -> Complex:
    """Return the map with the first landmark at 0, or else the conformal barycentre at 0."""
    if len(landmarks):
        return without_new_folds(mesh, to_centre(complex(z[landmarks[0]]))(z))
    return without_new_folds(mesh, moved_to_gauge(z, vertex_areas(mesh)))


def aligned(
    mesh: DiskMesh, z: Complex, landmarks: Ints, first: DiskMesh, z_first: Complex, others: Ints
) -> Complex:
    """Return the map of a surface, aligned with that of the first by a Moebius map.

    Parameters
    ----------
    mesh, z : DiskMesh, complex128 (n,)
        A surface and its conformal map to the disk.
    landmarks : int64 (k,)
        Its landmarks.
    first, z_first : DiskMesh, complex128
        The first surface and its map, already centred.
    others : int64 (k,)
        The first surface's landmarks.

    Returns
    -------
    complex128 (n,)
        The map with its first landmark at 0, turned to the least sum of squared distances of the
        other landmarks; with a single one, turned to the most similar curvature; with none, moved
        and turned to the most similar curvature.
    """
    z = centred(mesh, z, landmarks)
    if len(landmarks) > 1:
        return z * np.exp(1j * best_turn(z[landmarks], z_first[others]))
    picture, model = _portrait(mesh, z), _portrait(first, z_first)
    turn = _turn_by_curvature(picture, model)
    if len(landmarks):
        return z * np.exp(1j * turn)
    return without_new_folds(mesh, _refined(picture, model, turn).inverse(z))


def vertex_areas(mesh: DiskMesh) -> Real:
    """Return the share (n,) of each vertex in the surface's area: a third of that of its faces."""
    return gauge_measure(mesh, "area", mesh.boundary)


def _portrait(mesh: DiskMesh, z: Complex) -> Real:
    """Return the logarithm of the conformal factor on the polar grid, without its mean.

    Its Laplacian is the Gaussian curvature, so it identifies features such as noses in any pose.
    """
    image = np.bincount(
        mesh.F.ravel(), weights=np.repeat(signed_areas(z, mesh.F) / 3, 3), minlength=mesh.n
    )
    log_factor = np.log(vertex_areas(mesh) / image) / 2
    face, weights = locate(z, mesh.F, _grid(), nearest=True)
    portrait = interpolated(weights, log_factor[mesh.F[face]]).reshape(RADII, DIRECTIONS)
    return portrait - np.average(portrait, axis=0, weights=_radii()).mean()


def _radii() -> Real:
    return OUTERMOST * np.arange(1, RADII + 1) / RADII


def _grid() -> Complex:
    return np.outer(_radii(), np.exp(2j * np.pi * np.arange(DIRECTIONS) / DIRECTIONS)).ravel()


def _turn_by_curvature(picture: Real, model: Real) -> float:
    """Return the rotation of `picture` that correlates best with `model`, to one grid step."""
    spectra = np.conj(np.fft.rfft(picture, axis=1)) * np.fft.rfft(model, axis=1)
    correlation = _radii() @ np.fft.irfft(spectra, n=DIRECTIONS, axis=1)
    return float(2 * np.pi * np.argmax(correlation) / DIRECTIONS)


def _refined(picture: Real, model: Real, turn: float) -> Moebius:
    """Return the Moebius map from the model's disk to the picture's with the least difference."""
    weights = np.repeat(_radii(), DIRECTIONS)
    grid, wanted = _grid(), model.ravel()
    # A centre column, and the first direction again behind the last, for the interpolation.
    padded = np.vstack([np.full((1, DIRECTIONS), picture[0].mean()), picture])
    padded = np.hstack([padded, padded[:, :1]])

    def move(x: Real) -> Moebius:
        a = complex(x[0], x[1])
        return to_centre(a / (1 + abs(a)), x[2])  # |a| / (1 + |a|) < 1 for every a

    def difference(x: Real) -> float:
        at = move(x)(grid)
        place = [
            np.abs(at) / OUTERMOST * RADII,
            np.mod(np.angle(at), 2 * np.pi) / (2 * np.pi) * DIRECTIONS,
        ]
        seen = ndimage.map_coordinates(padded, place, order=1, mode="nearest")
        apart = seen - wanted
        return float(weights @ (apart - weights @ apart / weights.sum()) ** 2)

    start = np.array([0.0, 0.0, -turn])
    simplex = start + np.vstack([np.zeros(3), np.diag([0.1, 0.1, 0.1])])
    optimum = optimize.minimize(
        difference, start, method="Nelder-Mead", options={"initial_simplex": simplex}
    )
    return move(optimum.x)
