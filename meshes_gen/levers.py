"""Levers that make a procedural surface as hard to map as a scanned one.

A body of :mod:`meshes_gen.remesh` is evenly meshed, Delaunay and cut along a smooth curve. Scans
are none of these: most of the conformal energy of the paper's public models lies in the triangles
at a boundary that follows mesh edges. No lever changes the number of vertices, of triangles, or of
boundary vertices; the same seed gives the same bytes.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

import numpy as np
import scipy
from pydantic import Field

from cembench.core.arrays import Indices, Real, marked
from cembench.mesh.triangle_mesh import TriangleMesh

from .local_operations import (
    boundary_mask,
    delaunay_flips,
    edges_of,
    mean_of_neighbours,
    on_grid,
    vertex_normals,
)
from .remesh import break_delaunay, flip_ears

M = TypeVar("M", bound=TriangleMesh)
C = TypeVar("C", bound=Callable[..., TriangleMesh])

Seed = Annotated[int, Field(ge=0)]
Jag = Annotated[float, Field(ge=0, le=1.5)]
Smooth = Annotated[float, Field(ge=0, le=40)]
Even = Annotated[float, Field(ge=0, le=2)]
Gain = Annotated[float, Field(ge=0, le=4)]
NonDelaunay = Annotated[float, Field(ge=0, le=0.3)]
Cut = Annotated[float, Field(ge=0, le=0.6)]

#: Edge lengths over which the filter separates the relief of a body from its shape.
RELIEF = 4.0
#: How far into the surface a slide of boundary vertices fades, as a multiple of the largest.
REACH = 3.0
#: Maximum number of slides, and the offset from the centre at which vertices are balanced.
PASSES, BALANCED = 4, 0.01


@dataclass(frozen=True)
class Levers:
    """How a body is made harder to map; the defaults leave it as it is.

    Parameters
    ----------
    jag : float
        Each boundary vertex is moved across the boundary, within the surface, by a random share of
        the neighbouring edges' length, uniform in (-jag, jag).
    smooth : float
        The surface is smoothed over this many edge lengths.
    even : float
        Smoothing lengths are multiplied by the local curvature over its mean, to this power.
    gain : float
        The relief, which is what smoothing over 4 edge lengths removes, is multiplied by this.
    non_delaunay : float
        Share of the interior edges that are flipped until they are not Delaunay.
    centred : bool
        Whether boundary vertices slide along the boundary until their images are balanced about
        the centre when the middle triangle's image is there. This decides how CEM starts (Eq. 15).
    cut : float
        How far the cut moves into the body, as a share of its longest side.
    """

    jag: float = 0.0
    smooth: float = 0.0
    even: float = 0.0
    gain: float = 1.0
    non_delaunay: float = 0.0
    centred: bool = False
    cut: float = 0.0


#: The levers that leave a body as it is.
NO_LEVERS = Levers()


def with_levers(function: C) -> C:
    """Add `jag`, `non_delaunay` and, unless it has one, `seed` to a function that makes a mesh."""
    own = inspect.signature(function).parameters
    added = {"jag": Jag, "non_delaunay": NonDelaunay, "seed": Seed}
    defaults = {"jag": 0.0, "non_delaunay": 0.0, "seed": 0}
    added = {name: kind for name, kind in added.items() if name not in own}

    @functools.wraps(function)
    def made(
        *sizes: Any, jag: float = 0.0, non_delaunay: float = 0.0, seed: int = 0, **given: Any
    ) -> Any:
        mesh = function(*sizes, **(given | ({"seed": seed} if "seed" in own else {})))
        return hardened(mesh, Levers(jag=jag, non_delaunay=non_delaunay), seed)

    made.__annotations__ = function.__annotations__ | added
    more = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=defaults[name])
        for name in added
    ]
    made.__signature__ = inspect.Signature([*own.values(), *more])  # type: ignore[attr-defined]
    return made  # type: ignore[return-value]  # with three more parameters


def hardened(mesh: M, levers: Levers, seed: int = 0) -> M:
    """Return a mesh with the levers applied; `seed` sets what is random. `cut` is the body's."""
    if levers == Levers(cut=levers.cut):
        return mesh
    V, F = np.array(mesh.V), np.array(mesh.F)
    if levers.centred:
        V = _centred(V, F, mesh.loops[0])
        F = delaunay_flips(V, F)
    if levers.gain != 1:
        shape = _smoothed(V, F, RELIEF)
        V = shape + levers.gain * (V - shape)
    if levers.smooth:
        V = _smoothed(V, F, levers.smooth, levers.even)
    if levers.jag:
        V = _jagged(V, F, levers.jag, np.random.default_rng([seed, 1]))
    F = delaunay_flips(V, F)
    if levers.non_delaunay:
        F = break_delaunay(V, F, seed, levers.non_delaunay)
    F = flip_ears(F, len(V))
    return type(mesh).from_arrays(V, F, name=mesh.name, notices=mesh.notices)


def _on_boundary(F: Indices, n: int) -> Indices:
    """Return each boundary vertex with the vertices before and after it, (k, 3)."""
    edges = edges_of(F, n)
    ends = edges.ends[edges.on_boundary]
    before = np.empty(n, dtype=np.int64)
    before[ends[:, 1]] = ends[:, 0]
    return np.stack([before[ends[:, 0]], *ends.T], axis=1)[np.argsort(ends[:, 0])]


def _jagged(V: Real, F: Indices, jag: float, rng: np.random.Generator) -> Real:
    """Return vertices with those of the boundary moved across it, and room made behind them."""
    before, at, after = _on_boundary(F, len(V)).T
    along = V[after] - V[before]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(vertex_normals(V, F)[at], along)
    length = np.linalg.norm(V[after] - V[at], axis=1) + np.linalg.norm(V[at] - V[before], axis=1)
    V = V.copy()
    V[at] += (jag * rng.uniform(-1, 1, len(at)) * length / 2)[:, None] * across
    near = marked(len(V), F[boundary_mask(F, len(V))[F].any(axis=1)])
    near[at] = False
    some = F[near[F].any(axis=1)]
    for _ in range(3):
        normal = vertex_normals(V, some)[near]
        move = (mean_of_neighbours(V, some) - V)[near]
        V[near] += 0.5 * (move - normal * (move * normal).sum(axis=1, keepdims=True))
    return V


def _smoothed(V: Real, F: Indices, over: float, even: float = 0.0) -> Real:
    """Return vertices smoothed over this many mean edges, the boundary held.

    Lengths are multiplied by the curvature over its mean to the power `even`.
    """
    ends = edges_of(F, len(V)).ends
    edge = float(np.linalg.norm(V[ends[:, 0]] - V[ends[:, 1]], axis=1).mean())
    return on_grid(_filtered(V, V, F, over * edge * (_curvature(V, F) ** even if even else 1.0)))


def _filtered(X: Real, V: Real, F: Indices, length: Real | float) -> Real:
    """Return ``(M / length^2 + L)^-1 M / length^2 X`` with X (n, 3) held at the boundary.

    L and M are the mesh's cotangent Laplacian and vertex areas.
    """
    from cembench.conformal.laplacian import cotangent_laplacian, double_areas
    from cembench.linear_algebra.cholesky import Cholesky

    n = len(V)
    boundary = boundary_mask(F, n)
    mass = np.bincount(F.ravel(), np.repeat(double_areas(V, F) / 6, 3), n) / np.square(length)
    A = scipy.sparse.csr_array(scipy.sparse.diags_array(mass) + cotangent_laplacian(V, F))
    rows = A[~boundary]
    rhs = mass[~boundary, None] * X[~boundary] - rows[:, boundary] @ X[boundary]
    X = X.copy()
    X[~boundary] = Cholesky(scipy.sparse.csc_array(rows[:, ~boundary])).solve(rhs)
    return X


def _curvature(V: Real, F: Indices) -> Real:
    """Return the Gaussian curvature's modulus over its mean, averaged over five rings (n,)."""
    n = len(V)
    angles = np.empty(F.shape)
    for c in range(3):
        a, b = V[F[:, c - 2]] - V[F[:, c]], V[F[:, c - 1]] - V[F[:, c]]
        angles[:, c] = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), (a * b).sum(axis=1))
    defect = 2 * np.pi - np.bincount(F.ravel(), angles.ravel(), n)
    defect[boundary_mask(F, n)] = 0
    curvature = np.repeat(np.abs(defect)[:, None], 3, axis=1)
    for _ in range(5):
        curvature = (curvature + mean_of_neighbours(curvature, F)) / 2
    return np.asarray(np.clip(curvature[:, 0] / curvature[:, 0].mean(), 0.02, 50))


def _centred(V: Real, F: Indices, loop: Indices) -> Real:
    """Return vertices with those of the boundary slid along it until they are balanced.

    The Moebius map of the disk that takes the mean of the boundary vertices' images to the centre
    says where each slides; the surface behind them yields smoothly. That moves the middle triangle,
    too, hence the passes.
    """
    for _ in range(PASSES):
        angle = boundary_angles(V, F, loop)
        at = np.exp(1j * angle)
        if abs(at.mean()) < BALANCED:
            break
        a = 0j
        for _ in range(60):
            rest = ((at - a) / (1 - np.conj(a) * at)).mean()
            a = (a + rest) / (1 + np.conj(a) * rest)
        moved = (at - a) / (1 - np.conj(a) * at)
        goal = np.unwrap(np.angle(moved))
        goal += angle[0] + np.angle(moved[0] / at[0]) - goal[0]
        turns = np.concatenate([angle - 2 * np.pi, angle, angle + 2 * np.pi])
        curve = np.tile(V[loop], (3, 1))
        slide = np.zeros_like(V)
        slide[loop] = np.stack([np.interp(goal, turns, x) for x in curve.T], axis=1) - V[loop]
        V = on_grid(V + _filtered(slide, V, F, REACH * float(np.linalg.norm(slide, axis=1).max())))
    return V


def boundary_angles(V: Real, F: Indices, loop: Indices) -> Real:
    """Return where boundary vertices go in a conformal map to the disk, as angles (k,).

    The middle triangle goes to the centre: an arc is as long as its harmonic measure from there.
    """
    from cembench.conformal.gauge import middle_triangle
    from cembench.conformal.laplacian import cotangent_laplacian
    from cembench.linear_algebra.cholesky import Cholesky

    L = scipy.sparse.csr_array(cotangent_laplacian(V, F))
    inner = np.setdiff1d(np.arange(len(V)), loop)
    source = np.zeros(len(V))
    source[middle_triangle(V, F)] = 1 / 3
    rows = L[inner]
    seen = Cholesky(scipy.sparse.csc_array(rows[:, inner])).solve(source[inner])
    measure = source[loop] - rows[:, loop].T @ seen
    return np.asarray(2 * np.pi * (np.cumsum(measure) - measure / 2))
