"""Conformal equivalence of triangle meshes, to the unit disk."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from cembench.conformal.discrete_metric import angle_sums
from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.gauge import Gauge, gauge_measure, middle_triangle, moved_to_gauge
from cembench.conformal.harmonic import edge_lengths
from cembench.conformal.laplacian import laplacian
from cembench.core.arrays import Complex, Indices, Real
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.side_lengths import side_lengths
from cembench.mesh.topology import boundary_loops, undirected_edges
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

from .flat_metric import FlatMetric, flat_metric
from .free import cross_ratio_change

#: Number of boundary vertices that are tried, from the mean vertex outward.
TRIED = 4


@algorithm(
    "cetm",
    title="CETM",
    target="disk",
    source="Springborn, Schroeder & Pinkall, Conformal equivalence of triangle meshes, 2008",
    usual=False,
)
def cetm(
    mesh: DiskMesh,
    *,
    tolerance: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 1e-10,
    max_iterations: Annotated[int, Field(ge=0, le=10_000)] = 50,
    gauge: Gauge = "boundary",
    repair: bool = True,
) -> Parameterization:
    """Map to the disk by scaling edges at their vertices, by way of a half plane.

    A boundary vertex goes to infinity: all edges at it are made equally long, it is removed with
    its triangles, and its neighbours keep their scale. Newton's method on a convex energy, with one
    analysed pattern (`factorisations`), then finds the scale at which the angles sum to 2 pi inside
    and to pi on the rest of the boundary, which thus becomes a straight line. A Moebius map takes
    the half plane to the disk, and the vertex back to the circle. The length cross ratios of the
    map are those of the surface (`cross_ratios` is the largest change of their logarithms).

    Decided here: the vertex is the boundary vertex nearest to the mean vertex (`at_infinity`), or
    the next of about four candidates if triangles break with it. Steps and stopping rule are those
    of cetm-free (`curvature`, radians). No interior edge may join two boundary vertices, since it
    would fall on the line together with what it cuts off: that is a failure, as are triangles that
    break the triangle inequality; cetm-flips maps both. The flat surface is laid out by one solve;
    the image is moved into the `gauge` of direct-cem. Images of triangles have straight edges, so a
    few can fold although the discrete map is conformal: these are repaired as in CEM
    (`fold_repairs`), after which cross ratios are no longer kept.
    """
    b = mesh.boundary
    ear = _checked_ear(mesh)
    away = np.linalg.norm(mesh.V[b] - mesh.V.mean(axis=0), axis=1)
    order = b[np.argsort(away, kind="stable")]
    tried = order[:: max(1, len(b) // TRIED)] if ear is None else [ear]
    failed: AlgorithmFailed | None = None
    for v in map(int, tried):
        try:
            F, flattened = _with_infinity_at(mesh, v, tolerance, max_iterations)
            break
        except AlgorithmFailed as error:
            failed = error
    else:
        raise failed or AlgorithmFailed("there is no boundary vertex")
    z = _half_plane(mesh, v, F, flattened)
    uv = _on_disk(mesh, z, v)
    uv = moved_to_gauge(uv, gauge_measure(mesh, gauge, b))
    uv[b] /= np.abs(uv[b])
    kept = cross_ratio_change(mesh, uv)
    uv, folds = accepted_repair(mesh, uv, laplacian(mesh), repair=repair)
    extras = flattened.told | {"cross_ratios": kept, "at_infinity": v} | folds
    return Parameterization(uv, len(flattened.history) - 1, extras=extras)


def _with_infinity_at(
    mesh: DiskMesh, v: int, tolerance: float, max_iterations: int
) -> tuple[Indices, FlatMetric]:
    """Return the triangles that do not touch v, and their flat metric with v at infinity."""
    touching = np.any(np.int64(v) == mesh.F, axis=1)
    F = mesh.F[~touching]
    if not len(F):
        raise AlgorithmFailed(
            f"every triangle touches boundary vertex {v}: the mesh has too few triangles"
        )
    u, link = _infinity(mesh, v, mesh.F[touching])
    flat = np.full(mesh.n, 2 * np.pi)
    flat[mesh.boundary] = np.pi
    flattened = flat_metric(
        F,
        side_lengths(mesh.V, F),
        u,
        np.append(link, v),
        flat,
        tolerance=tolerance,
        max_iterations=max_iterations,
    )
    return F, flattened


def _checked_ear(mesh: DiskMesh) -> int | None:
    """Return the tip of an ear if its base is the only chord, None if there is no chord.

    An ear is a triangle joined to the surface by one edge only; a chord is an interior edge between
    boundary vertices.

    Raises
    ------
    AlgorithmFailed
        There are other chords.
    """
    on = np.zeros(mesh.n, dtype=bool)
    on[mesh.boundary] = True
    ends, faces = undirected_edges(mesh.F)
    chords = ends[(faces == 2) & on[ends].all(axis=1)]
    if not len(chords):
        return None
    tips = np.flatnonzero((np.bincount(mesh.F.ravel(), minlength=mesh.n) == 1) & on)
    if len(chords) == 1 and len(tips):
        return int(tips[0])
    raise AlgorithmFailed(
        f"{len(chords)} edges inside join boundary vertices, for example {chords[0].tolist()}: "
        "with a straight boundary they would lie on it, and the triangles that they cut off "
        "would have no area. Use cetm-flips, or split these edges"
    )


def _infinity(mesh: DiskMesh, v: int, star: Indices) -> tuple[Real, Indices]:
    """Return the u (n,) at which all edges to v are equally long, and the neighbours of v.

    It is that of the inversion of space in a sphere around v.
    """
    away = np.linalg.norm(mesh.V - mesh.V[v], axis=1)
    away[v] = 1.0
    if not away.min() > 0:
        raise AlgorithmFailed(f"another vertex coincides with boundary vertex {v}")
    u = -2 * np.log(away)
    return u - u.mean(), np.setdiff1d(star, [v])


def _half_plane(mesh: DiskMesh, v: int, F: Indices, found: FlatMetric) -> Complex:
    """Lay out the flat surface above the real axis, with the old boundary on the axis."""
    loops = boundary_loops(F, mesh.n)
    if len(loops) != 1:
        raise AlgorithmFailed(f"without boundary vertex {v} the surface is not connected")
    after = np.roll(mesh.boundary, -1)[mesh.boundary == v]
    loop = np.roll(loops[0], -int(np.flatnonzero(loops[0] == after)[0]))
    on_line = np.isin(loop, mesh.boundary)
    turns = np.pi - angle_sums(F, found.angles, mesh.n)[loop]
    lengths = edge_lengths(mesh, loop) * np.exp((found.u[loop] + found.u[np.roll(loop, -1)]) / 2)
    curve = _closed_by_link(lengths, turns, int(np.count_nonzero(on_line)))
    z = np.zeros(mesh.n, dtype=np.complex128)
    z[loop] = curve
    fixed = np.zeros(mesh.n, dtype=bool)
    fixed[np.append(loop, v)] = True
    return found.laid_out(F, fixed, z)


def _closed_by_link(lengths: Real, turns: Real, k: int) -> Complex:
    """Return a polygon whose first k vertices lie on the real axis, at exactly their distances.

    The other edges, which are longer by orders of magnitude, absorb the closing error.
    """
    line = np.concatenate([[0.0], np.cumsum(lengths[: k - 1])])
    directions = np.exp(1j * np.cumsum(turns[k - 1 :]))
    way = lengths[k - 1 :] * directions
    way += (-line[-1] - way.sum()) * lengths[k - 1 :] / lengths[k - 1 :].sum()
    link = line[-1] + np.cumsum(way)[:-1]
    return np.concatenate([line, link])


def _on_disk(mesh: DiskMesh, z: Complex, v: int) -> Complex:
    """Map the half plane by (z - p) / (z - conj p), with p in the middle triangle, and add v."""
    corners = middle_triangle(mesh.V, mesh.F)
    p = complex(z[corners[corners != v]].mean())
    if not p.imag > 0:
        raise AlgorithmFailed("the centre of the surface is mapped to the boundary")
    w = np.empty_like(z)
    others = np.arange(mesh.n) != v
    w[others] = (z[others] - p) / (z[others] - p.conjugate())
    w[v] = 1.0
    return w
