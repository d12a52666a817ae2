"""Which map of a surface to the disk keeps its Dirichlet energy small and meets landmarks (34)?

E_R(f) = E_D(f) + lambda sum_j |f(landmark_j) - target_j|^2, the boundary held on the circle. The
minimiser solves one sparse symmetric positive definite system, L_ii + 2 lambda D.

A single point has no capacity in the plane: pulled alone, a vertex comes out of its surroundings as
a spike, and triangles fold. So a landmark here is a small disk round its vertex that is carried
along: a few more pairs in (34), whose weights sum to 1; with radius 0 it is (34) to the letter.
Where the minimiser folds all the same, a smaller lambda moves the landmarks part of the way without
folds, and the next step starts from that image, whose own E_D it lessens, until they meet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.clock import phase
from cembench.errors import AlgorithmFailed
from cembench.geometry.cholesky import Cholesky
from cembench.geometry.laplacian import cotangent_laplacian, laplacian
from cembench.geometry.mesh import DiskMesh
from cembench.geometry.planar import signed_areas

Complex = NDArray[np.complex128]
Ints = NDArray[np.int64]
Real = NDArray[np.float64]

#: The weight of the landmarks in (34) unless the user says otherwise; E_D of a disk is about pi.
LAMBDA = 100.0
#: Radius of a landmark's disk: this share of the way to the next landmark or the boundary, ...
REACH = 0.4
#: ... but at most this, in units of the disk's radius.
LARGEST_REACH = 0.15
#: Steps are taken until the landmarks are so near to their targets, in units of the disk's radius.
NEAR = 2e-3
#: How many steps are taken, and how often lambda is made smaller within one.
MOST_STEPS, MOST_TRIES = 40, 8
#: What share of the way to the first fold a step goes.
CAUTION = 0.7
#: Where no landmark moves so far, in its distance to the next, there is no getting on.
LEAST_STEP = 0.02


@dataclass(frozen=True)
class Registration:
    """A registration map and how it was found.

    Parameters
    ----------
    uv : complex128 (n,)
        The map; no triangle is folded.
    lambdas : tuple of float
        The lambda of each step; a single one, as asked for, where nothing folded.
    landmark_error : float
        Largest distance of a landmark from its target, in units of the disk's radius.

    """

    uv: Complex
    lambdas: tuple[float, ...]
    landmark_error: float


def register(
    mesh: DiskMesh,
    start: Complex,
    landmarks: Ints,
    targets: Complex,
    *,
    lam: float = LAMBDA,
    reach: float = REACH,
) -> Registration:
    """Bring the landmarks of a map to the disk to their targets, by minimising (34).

    Parameters
    ----------
    mesh : DiskMesh
        The surface.
    start : complex128 (n,)
        Its conformal map, already aligned; its boundary values are kept.
    landmarks : int64 (k,)
        Vertices inside the surface; with none the start is the answer.
    targets : complex128 (k,)
        Where they should come to lie, inside the disk.
    lam : float
        The weight of the landmarks.
    reach : float
        Radius of a landmark's disk, as a share of the way to the next landmark; 0 for a vertex.

    Raises
    ------
    AlgorithmFailed
        The landmarks cannot be met without folds, however small lambda is.

    """
    if not len(landmarks):
        return Registration(start, (), 0.0)
    z, lambdas = start, []
    error = _error(z, landmarks, targets)
    L = laplacian(mesh)
    for _ in range(MOST_STEPS):
        at, pairs = z[landmarks], _pairs(mesh.F, z, landmarks, targets, reach)
        z, used = _step(mesh, L, z, pairs, lam)
        lambdas.append(used)
        error = _error(z, landmarks, targets)
        if used == lam or error <= NEAR:
            return Registration(z, tuple(lambdas), error)
        if (np.abs(z[landmarks] - at) < LEAST_STEP * _room(at)).all():
            break
        # Dirichlet's energy is that of the image from now on: the next map is composed with this.
        with phase("laplacian"):
            L = cotangent_laplacian(np.stack([z.real, z.imag], axis=1), mesh.F)
    raise AlgorithmFailed(
        f"{mesh.name}: after {len(lambdas)} steps with lambda down to {min(lambdas):.2g} a "
        f"landmark is still {error:.2g} (of the disk's radius 1) from its target, and going on "
        "would fold triangles. Use fewer landmarks, look for one that is misplaced, or take a "
        "smaller --lambda so that they need not meet."
    )


def _error(z: Complex, landmarks: Ints, targets: Complex) -> float:
    return float(np.abs(z[landmarks] - targets).max())


@dataclass(frozen=True)
class _Pairs:
    """The terms of (34): vertices, where they should go, and weights that sum to 1 a landmark."""

    vertices: Ints
    targets: Complex
    weights: Real


def _pairs(F: Ints, z: Complex, landmarks: Ints, targets: Complex, reach: float) -> _Pairs:
    """The landmarks with the disks round them, each carried by its landmark's displacement."""
    at = z[landmarks]
    radius = np.minimum(reach * _room(at), LARGEST_REACH)
    area = np.bincount(F.ravel(), weights=np.repeat(signed_areas(z, F), 3), minlength=len(z))
    pairs = []
    for j, vertex in enumerate(landmarks):
        away = np.abs(z - at[j])
        v = np.union1d(np.flatnonzero(away < radius[j]), vertex)
        fall = 1 - (away[v] / radius[j]) ** 2 if radius[j] > 0 else np.ones(len(v))
        w = fall * area[v]  # by area: vertices that crowd somewhere pull no harder there
        pairs.append((v, z[v] + (targets[j] - at[j]), w / w.sum()))
    vertices, places, weights = zip(*pairs, strict=True)
    return _Pairs(np.concatenate(vertices), np.concatenate(places), np.concatenate(weights))


def _room(at: Complex) -> Real:
    """How far is each landmark from the next one, or from the boundary? Shape (k,)."""
    apart = np.abs(at[:, None] - at[None, :])
    np.fill_diagonal(apart, np.inf)
    return np.minimum(apart.min(axis=1), 1 - np.abs(at))


def _step(
    mesh: DiskMesh, L: sparse.csc_array, z: Complex, pairs: _Pairs, lam: float
) -> tuple[Complex, float]:
    """The minimiser of (34) for the largest lambda up to `lam` found that folds nothing."""
    i, b = mesh.interior, mesh.boundary
    with phase("assembly"):
        rows = sparse.csr_array(L)[i]
        L_ii, right = sparse.csc_array(rows[:, i]), -(rows[:, b] @ z[b])
        pull = np.zeros(mesh.n)
        pulled = np.zeros(mesh.n, dtype=np.complex128)
        np.add.at(pull, pairs.vertices, 2 * pairs.weights)
        np.add.at(pulled, pairs.vertices, 2 * pairs.weights * pairs.targets)
    factor: Cholesky | None = None
    tried = lam
    for _ in range(MOST_TRIES):
        A = sparse.csc_array(L_ii + sparse.diags_array(tried * pull[i]))
        if factor is None:
            factor = Cholesky(A)
        else:
            factor.update(A)
        new = z.copy()
        new[i] = factor.solve(right + tried * pulled[i])
        share = first_fold(z, new, mesh.F)
        if share > 1:
            return new, tried
        tried = _smaller(tried, z, new, pairs, CAUTION * share)
    return z, tried


def _smaller(lam: float, z: Complex, new: Complex, pairs: _Pairs, share: float) -> float:
    """Which lambda moves the landmarks this share as far? From the capacity C of their disks.

    A disk that is pulled by lambda against a capacity C moves the share g = 2 lambda / (C + 2
    lambda) of its way; at least a quarter of lambda is taken off.
    """
    wanted = float(pairs.weights @ np.abs(pairs.targets - z[pairs.vertices]))
    moved = float(pairs.weights @ np.abs(new[pairs.vertices] - z[pairs.vertices]))
    g = min(max(moved / max(wanted, 1e-300), 1e-6), 1 - 1e-6)
    capacity = 2 * lam * (1 - g) / g
    less = max(share, 1e-3) * g
    return min(0.75 * lam, capacity * less / (2 * (1 - less)))


def first_fold(z: Complex, new: Complex, F: Ints) -> float:
    """How far along the straight way from z to `new` does a triangle first lose its area?

    A share of the way, in (0, 1]; infinite where `new` has no fold. No triangle of z is folded.
    """
    if (signed_areas(new, F) > 0).all():
        return np.inf
    a, b, c = (z[F[:, k]] for k in range(3))
    p, q = b - a, c - a
    da, db, dc = ((new - z)[F[:, k]] for k in range(3))
    u, v = db - da, dc - da
    # Twice the area at share s: (p + s u) x (q + s v).
    const = np.imag(np.conj(p) * q)
    linear = np.imag(np.conj(p) * v + np.conj(u) * q)
    square = np.imag(np.conj(u) * v)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(linear**2 - 4 * square * const)
        # The stable pair of roots of a quadratic.
        half = -0.5 * (linear + np.where(linear >= 0, root, -root))
        roots = np.stack([half / square, const / half])
    roots = np.where(np.isfinite(roots) & (roots > 0), roots, np.inf)
    return float(min(roots.min(), 1.0))
