"""Registration: a map to the disk with small Dirichlet energy that meets landmarks (34).

E_R(f) = E_D(f) + lambda sum_j |f(landmark_j) - target_j|^2, with the boundary fixed on the
circle. The minimiser solves one sparse symmetric positive definite system, L_ii + 2 lambda D.

A single point has no capacity in the plane: a vertex pulled alone leaves its surroundings as a
spike, and triangles fold. So a landmark here is a small disk around its vertex that moves with it:
a few more pairs in (34), with weights that sum to 1. With radius 0 it is exactly (34). If the
minimiser still folds, a radial stretch first brings the landmarks to about the right distances from
the centre. Then a smaller lambda moves them part of the way without folds, and the next step starts
from that image and reduces its E_D, until the landmarks meet their targets.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.conformal.laplacian import by_rows, cotangent_laplacian, laplacian
from cembench.conformal.planar import signed_areas
from cembench.core.arrays import Complex, Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.linear_algebra.cholesky import Cholesky, factor_like
from cembench.mesh.triangle_mesh import DiskMesh

Ints = NDArray[np.int64]

#: Default weight of the landmarks in (34); E_D of a disk is about pi.
LAMBDA = 100.0
#: Radius of a landmark's disk: this share of the distance to the next landmark or boundary, ...
REACH = 0.4
#: ... but at most this much, in units of the unit disk's radius.
LARGEST_REACH = 0.15
#: Tolerance for landmarks at their targets, in units of the unit disk's radius.
NEAR = 2e-3
#: Maximum number of steps, and of reductions of lambda within a step.
MAX_STEPS, MAX_TRIES = 40, 8
#: Share of the distance to the first fold that a step takes.
CAUTION = 0.7
#: Approximate capacity of a landmark's disk in the unit disk; used only to choose lambdas.
CAPACITY = 2.0
#: Least progress: a landmark's movement as a share of its distance to the next one.
MIN_STEP = 0.02


@dataclass(frozen=True)
class Registration:
    """A registration map and how it was computed.

    Parameters
    ----------
    uv : complex128 (n,)
        The map; no triangle is folded.
    lambdas : tuple of float
        The lambda of each step; only the requested one if nothing folded.
    landmark_error : float
        Largest distance of a landmark from its target, in units of the disk's radius.
    exponent : float
        Exponent of the radial stretch before the first of several steps; 1 for none.
    """

    uv: Complex
    lambdas: tuple[float, ...]
    landmark_error: float
    exponent: float = 1.0


def register(
    mesh: DiskMesh,
    start: Complex,
    landmarks: Ints,
    targets: Complex,
    *,
    lam: float = LAMBDA,
    reach: float = REACH,
) -> Registration:
    """Move the landmarks of a map to the disk to their targets, by minimising (34).

    Parameters
    ----------
    mesh : DiskMesh
        The surface.
    start : complex128 (n,)
        Its aligned conformal map; the boundary values are kept.
    landmarks : int64 (k,)
        Interior vertices; without any, the start is returned.
    targets : complex128 (k,)
        Their targets, inside the disk.
    lam : float
        The weight of the landmarks.
    reach : float
        Radius of a landmark's disk, as a share of the distance to the next landmark; 0: the vertex.

    Raises
    ------
    AlgorithmFailed
        The landmarks cannot be met without folds for any lambda.
    """
    if not len(landmarks):
        return Registration(start, (), 0.0)
    uv = _minimisers(mesh, laplacian(mesh), start, landmarks, targets, reach)(lam)
    if first_fold(start, uv, mesh.F) > 1:
        return Registration(uv, (lam,), _error(uv, landmarks, targets))
    z, exponent = radially_stretched(mesh, start, landmarks, targets)
    lambdas = []
    for _ in range(MAX_STEPS):
        at = z[landmarks]
        with phase("laplacian"):
            L = cotangent_laplacian(np.stack([z.real, z.imag], axis=1), mesh.F)
        z, used = _step(z, mesh.F, _minimisers(mesh, L, z, landmarks, targets, reach), lam)
        lambdas.append(used)
        error = _error(z, landmarks, targets)
        if used == lam or error <= NEAR:
            return Registration(z, tuple(lambdas), error, exponent)
        if (np.abs(z[landmarks] - at) < MIN_STEP * _room(at)).all():
            break
    raise AlgorithmFailed(
        f"{mesh.name}: after {len(lambdas)} steps with lambda down to {min(lambdas):.2g} a "
        f"landmark is still {error:.2g} (of the disk's radius 1) from its target, and a further "
        "step would fold triangles. Use fewer landmarks, check for a misplaced one, put the "
        "surface first on which they are more spread out in the disk (a face before a whole "
        "head), or take a smaller lambda so that they need not coincide."
    )


def _error(z: Complex, landmarks: Ints, targets: Complex) -> float:
    return float(np.abs(z[landmarks] - targets).max())


@dataclass(frozen=True)
class _Pairs:
    """The terms of (34): vertices, targets, and weights that sum to 1 for each landmark."""

    vertices: Ints
    targets: Complex
    weights: Real


def _pairs(F: Ints, z: Complex, landmarks: Ints, targets: Complex, reach: float) -> _Pairs:
    """Return the terms of the landmarks and their disks, which move with the landmarks."""
    at = z[landmarks]
    radius = np.minimum(reach * _room(at), LARGEST_REACH)
    area = np.bincount(F.ravel(), weights=np.repeat(signed_areas(z, F), 3), minlength=len(z))
    pairs = []
    for j, vertex in enumerate(landmarks):
        away = np.abs(z - at[j])
        v = np.union1d(np.flatnonzero(away < radius[j]), vertex)
        fall = 1 - (away[v] / radius[j]) ** 2 if radius[j] > 0 else np.ones(len(v))
        w = fall * area[v]  # by area, so that crowded vertices do not pull harder
        pairs.append((v, z[v] + (targets[j] - at[j]), w / w.sum()))
    vertices, places, weights = zip(*pairs, strict=True)
    return _Pairs(np.concatenate(vertices), np.concatenate(places), np.concatenate(weights))


def _room(at: Complex) -> Real:
    """Return the distance (k,) of each landmark from the next one or the boundary."""
    apart = np.abs(at[:, None] - at[None, :])
    np.fill_diagonal(apart, np.inf)
    return np.minimum(apart.min(axis=1), 1 - np.abs(at))


def _minimisers(
    mesh: DiskMesh,
    L: sparse.csc_array,
    z: Complex,
    landmarks: Ints,
    targets: Complex,
    reach: float,
) -> Callable[[float], Complex]:
    """Return a function from lambda to the minimiser of (34), which reuses one symbolic analysis.

    L is the Laplacian of E_D; z is the map whose boundary is kept and that defines the disks.
    """
    i, b = mesh.interior, mesh.boundary
    with phase("assembly"):
        pairs = _pairs(mesh.F, z, landmarks, targets, reach)
        rows = by_rows(L)[i]
        L_ii, right = sparse.csc_array(rows[:, i]), -(rows[:, b] @ z[b])
        pull = np.zeros(mesh.n)
        pulled = np.zeros(mesh.n, dtype=np.complex128)
        np.add.at(pull, pairs.vertices, 2 * pairs.weights)
        np.add.at(pulled, pairs.vertices, 2 * pairs.weights * pairs.targets)
    factor: Cholesky | None = None

    def minimiser(lam: float) -> Complex:
        nonlocal factor
        A = sparse.csc_array(L_ii + sparse.diags_array(lam * pull[i]))
        factor = factor_like(factor, A)
        image = z.copy()
        image[i] = factor.solve(right + lam * pulled[i])
        return image

    return minimiser


def _step(
    z: Complex, F: Ints, minimiser: Callable[[float], Complex], lam: float
) -> tuple[Complex, float]:
    """Return the minimiser for the largest lambda found, up to `lam`, without folds; and lambda.

    The landmarks move about the share g = 2 lambda / (C + 2 lambda) of the distance to their
    targets. C is the capacity of their disks, about 2 for disks that are small but not very small.
    The share up to the first fold determines the next lambda to try.
    """
    tried = lam
    for _ in range(MAX_TRIES):
        new = minimiser(tried)
        share = first_fold(z, new, F)
        if share > 1:
            return new, tried
        less = CAUTION * max(share, 1e-3) * 2 * tried / (CAPACITY + 2 * tried)
        tried = min(0.75 * tried, CAPACITY * less / (2 * (1 - less)))
    return z, tried


def radially_stretched(
    mesh: DiskMesh, z: Complex, landmarks: Ints, targets: Complex
) -> tuple[Complex, float]:
    """Return the map z |z|^(k-1) that best fits the landmarks' distances from the centre.

    Its dilatation is max(k, 1/k) everywhere, the least of any map between rings (Groetzsch 1928). k
    is the least-squares fit of log |target| = k log |landmark|; if that folds triangles, which stay
    straight, k is moved towards 1.

    Returns
    -------
    z : complex128 (n,)
        The stretched map; no triangle is folded.
    k : float
        The exponent.
    """
    far = np.minimum(np.abs(z[landmarks]), np.abs(targets)) > 1e-9
    wanted_radii, own_radii = np.log(np.abs(targets[far])), np.log(np.abs(z[landmarks][far]))
    if not len(own_radii):
        return z, 1.0
    k = float(wanted_radii @ own_radii / (own_radii @ own_radii))
    modulus = np.maximum(np.abs(z), 1e-300)
    for _ in range(MAX_TRIES):
        new = z * modulus ** (k - 1)
        if (signed_areas(new, mesh.F) > 0).all():
            return new, k
        k = np.sqrt(k)
    return z, 1.0


def first_fold(z: Complex, new: Complex, F: Ints) -> float:
    """Return where on the line from z to `new` a triangle first loses its area.

    A share of the distance, in (0, 1]; infinite if `new` has no fold. z must have no folds.
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
