"""Solids as negative sets of functions: primitives, smooth unions, seeded noise.

Contract: a field f takes points (n, 3) and returns (n,), negative inside, roughly a signed distance
(slope near 1), so that a few Newton steps along its gradient reach the surface f = 0.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from cembench.core.arrays import Real

Field = Callable[[Real], Real]

#: Points evaluated at once; temporary arrays then stay in the processor's cache.
CHUNK = 32_768


@dataclass(frozen=True)
class Body:
    """The surface ``f = 0`` where ``keep >= 0``; a disk if `keep` cuts a closed surface once.

    Parameters
    ----------
    f : callable
        The field of the solid, negative inside.
    keep : callable
        A field that is positive where the surface is kept; its zero set is the boundary curve.
    lower, upper : float (3,)
        A box that holds the whole solid, with a margin where it is not cut.
    cells : int
        Cells of the first sampling grid along the longest side of the box.
    loops : int
        Boundary loops that the cut leaves: 1 for a disk, more for a surface with holes.
    """

    f: Field
    keep: Field
    lower: tuple[float, float, float]
    upper: tuple[float, float, float]
    cells: int = 150
    loops: int = 1

    @property
    def size(self) -> float:
        """Longest side of the box."""
        return float(np.max(np.subtract(self.upper, self.lower)))


def trimmed(body: Body, share: float) -> Body:
    """Return a body whose cut lies deeper by this share of its longest side."""
    depth = share * body.size
    return replace(body, keep=lambda p: body.keep(p) - depth) if share else body


def evaluate(f: Field, p: Real) -> Real:
    """Return f at points p (n, 3), like ``f(p)`` but in chunks on two threads."""
    if len(p) <= CHUNK:
        return f(p)
    chunks = [p[k : k + CHUNK] for k in range(0, len(p), CHUNK)]
    with ThreadPoolExecutor(2) as pool:
        return np.concatenate(list(pool.map(f, chunks)))


_TETRAHEDRON = np.array([[1, -1, -1], [-1, -1, 1], [-1, 1, -1], [1, 1, 1]], dtype=np.float64)


def gradient(f: Field, p: Real, step: float) -> Real:
    """Return the gradient of f at p (n, 3), from a tetrahedron of half-width `step`."""
    return value_and_gradient(f, p, step)[1]


def value_and_gradient(f: Field, p: Real, step: float) -> tuple[Real, Real]:
    """Return the field and its gradient at p from four values; f is correct to order step^2."""
    values = [evaluate(f, p + step * k) for k in _TETRAHEDRON]
    slope = sum(v[:, None] * k for v, k in zip(values, _TETRAHEDRON, strict=True))
    return np.mean(values, axis=0), slope / (4 * step)


def to_surface(f: Field, p: Real, step: float, reach: float, rounds: int = 4) -> Real:
    """Move points p (n, 3) along the gradient to f = 0, by at most `reach` per round."""
    p = p.copy()
    active = np.arange(len(p))
    for _ in range(rounds):
        q = p[active]
        value, slope = value_and_gradient(f, q, step)
        move = -slope * (value / np.maximum((slope**2).sum(axis=1), 0.05))[:, None]
        length = np.linalg.norm(move, axis=1)
        p[active] += move * np.minimum(1, reach / np.maximum(length, 1e-300))[:, None]
        active = active[length > 1e-3 * step]
        if not len(active):
            break
    return p


def to_curve(f: Field, g: Field, p: Real, step: float, reach: float, rounds: int = 6) -> Real:
    """Move points p (n, 3) to the curve f = g = 0 by the shortest way."""
    for _ in range(rounds):
        a, b = gradient(f, p, step), gradient(g, p, step)
        fa, fb = evaluate(f, p), evaluate(g, p)
        aa = (a * a).sum(axis=1) + 1e-9
        bb = (b * b).sum(axis=1) + 1e-9
        ab = (a * b).sum(axis=1)
        det = np.maximum(aa * bb - ab**2, 0.02 * aa * bb)
        move = -a * ((fa * bb - fb * ab) / det)[:, None] - b * ((fb * aa - fa * ab) / det)[:, None]
        length = np.linalg.norm(move, axis=1)
        p = p + move * np.minimum(1, reach / np.maximum(length, 1e-300))[:, None]
    return p


def sphere(p: Real, centre: ArrayLike, radius: float) -> Real:
    """Return the signed distance to a sphere."""
    return np.linalg.norm(p - np.asarray(centre), axis=1) - radius


def rotation(axis: str, degrees: float) -> Real:
    """Return the matrix that rotates by `degrees` about the axis "x", "y" or "z"."""
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    R = np.eye(3)
    R[i, i], R[i, j], R[j, i], R[j, j] = c, -s, s, c
    return R


def ellipsoid(p: Real, centre: ArrayLike, radii: ArrayLike, turn: Real | None = None) -> Real:
    """Return the first-order distance to an ellipsoid, rotated by `turn` about its centre."""
    q = p - np.asarray(centre)
    if turn is not None:
        q = q @ turn
    r = np.asarray(radii, dtype=np.float64)
    k0 = np.sqrt(((q / r) ** 2).sum(axis=1))
    k1 = np.sqrt(((q / r**2) ** 2).sum(axis=1))
    return np.where(k1 > 1e-9, k0 * (k0 - 1) / np.maximum(k1, 1e-9), -r.min())


def cone(p: Real, a: ArrayLike, b: ArrayLike, ra: float, rb: float) -> Real:
    """Return the distance to a capsule from a to b whose radius goes from ra to rb."""
    start, axis = np.asarray(a, dtype=np.float64), np.subtract(b, a)
    q = p - start
    t = np.clip(q @ axis / (axis @ axis), 0, 1)
    return np.linalg.norm(q - t[:, None] * axis, axis=1) - (ra + t * (rb - ra))


def tube(p: Real, points: ArrayLike, radii: ArrayLike, k: float = 0.0) -> Real:
    """Return the distance to a chain of :func:`cone` through points (j, 3), joined over k."""
    c = np.asarray(points, dtype=np.float64)
    r = np.broadcast_to(np.asarray(radii, dtype=np.float64), (len(c),))
    parts = [cone(p, c[i], c[i + 1], float(r[i]), float(r[i + 1])) for i in range(len(c) - 1)]
    d = parts[0]
    for part in parts[1:]:
        d = join(d, part, k) if k else np.minimum(d, part)
    return d


def box(p: Real, centre: ArrayLike, half: ArrayLike, rounding: float = 0.0) -> Real:
    """Return the signed distance to a box with rounded edges."""
    q = np.abs(p - np.asarray(centre)) - (np.asarray(half) - rounding)
    outside = np.linalg.norm(np.maximum(q, 0), axis=1)
    return outside + np.minimum(q.max(axis=1), 0) - rounding


def ring(p: Real, centre: ArrayLike, normal: ArrayLike, radius: float, thick: float) -> Real:
    """Return the signed distance to a torus."""
    n = np.asarray(normal, dtype=np.float64) / np.linalg.norm(normal)
    q = p - np.asarray(centre)
    along = q @ n
    across = np.sqrt(np.maximum((q * q).sum(axis=1) - along**2, 0))
    return np.hypot(across - radius, along) - thick


def join(a: Real, b: Real, k: float) -> Real:
    """Return the union of two solids, rounded over a distance k."""
    h = np.maximum(k - np.abs(a - b), 0) / k
    return np.minimum(a, b) - h * h * k / 4


def meet(a: Real, b: Real, k: float) -> Real:
    """Return the intersection of two solids, rounded over a distance k."""
    return -join(-a, -b, k)


def carve(a: Real, b: Real, k: float) -> Real:
    """Return solid a minus solid b, rounded over a distance k."""
    return meet(a, -b, k)


def bump(p: Real, centre: ArrayLike, width: ArrayLike) -> Real:
    """Return a Gaussian of height 1 about `centre`, for pushing a surface in or out."""
    q = (p - np.asarray(centre)) / np.asarray(width)
    return np.exp(-(q * q).sum(axis=1))


def halfspace(normal: ArrayLike, offset: float) -> Field:
    """Return the field that is positive on the side of a plane that `normal` points to."""
    n = np.asarray(normal, dtype=np.float64) / np.linalg.norm(normal)
    return lambda p: p @ n - offset


class Noise:
    """Smooth noise of about unit amplitude: plane waves of random direction and phase.

    `wavelength` is the mean wavelength in units of the points; the same seed gives the same noise.
    """

    def __init__(self, seed: int, wavelength: float, waves: int = 12, spread: float = 0.3) -> None:
        rng = np.random.default_rng(seed)
        d = rng.normal(size=(waves, 3))
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        k = 2 * np.pi / wavelength * rng.uniform(1 - spread, 1 + spread, size=(waves, 1))
        self._k = (d * k).T
        self._phase = rng.uniform(0, 2 * np.pi, waves)
        self._scale = np.sqrt(2 / waves)

    def __call__(self, p: Real) -> Real:
        """Return the noise at points p (n, 3)."""
        return self._scale * np.sin(p @ self._k + self._phase).sum(axis=1)
