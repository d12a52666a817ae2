"""Difficulty of surfaces (thin and coarse triangles, chords, seams, crowding) for maps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.harmonic import edge_lengths
from cembench.conformal.metrics import corner_angles, in_common_gauge, is_disk_map
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.flips import area_of_sides
from cembench.mesh.side_lengths import side_lengths
from cembench.mesh.topology import undirected_edges
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.report.surface_facts import factor_spans

#: An angle of a triangle above this, in degrees, counts as obtuse.
OBTUSE = 120.0


@dataclass(frozen=True)
class Difficulty:
    """Difficulty of mapping a surface to a disk, judged by its best map.

    Parameters
    ----------
    span : float
        Span of the conformal factor, a ratio of lengths: the 99.9 over the 0.1 percentile.
    crowding : float
        The same along the boundary, in the common gauge: the 99 over the 1 percentile of the
        edges' image lengths over their lengths.
    """

    span: float
    crowding: float


@dataclass(frozen=True)
class Shape:
    """What of a triangulation makes maps hard, whatever map is taken.

    Parameters
    ----------
    obtuse_share : float
        Share of triangles with an angle above :data:`OBTUSE`.
    chord_share : float
        Number of interior edges with both ends on the boundary, over that of boundary vertices.
    angle_defect : float
        Mean curvature that a vertex of the interior holds, |2 pi - sum of its angles|, in degrees:
        how coarse the surface is.
    boundary_excess : float
        Length of the boundary over that of a flat disk of the same area, 2 sqrt(pi A): large for
        surfaces with seams, cuts that follow a tree.
    """

    obtuse_share: float
    chord_share: float
    angle_defect: float
    boundary_excess: float


def shape(mesh: TriangleMesh) -> Shape:
    """Return what of a triangulation makes maps hard.

    >>> import cembench
    >>> flat = shape(cembench.surface("flat-disk", 500))
    >>> f"{flat.boundary_excess:.1f}", flat.chord_share, flat.angle_defect < 1e-6
    ('1.0', 0.0, True)
    """
    angles = corner_angles(mesh.V, mesh.F)
    on_boundary = np.zeros(mesh.n, dtype=bool)
    on_boundary[np.concatenate(mesh.loops)] = True
    edges, _ = undirected_edges(mesh.F)
    around = sum(len(loop) for loop in mesh.loops)  # as many edges as vertices
    chords = int(on_boundary[edges].all(axis=1).sum()) - around
    total = np.bincount(mesh.F.ravel(), angles.ravel(), mesh.n)[~on_boundary]
    area = float(area_of_sides(*side_lengths(mesh.V, mesh.F).T).sum())
    length = sum(float(edge_lengths(mesh, loop).sum()) for loop in mesh.loops)
    return Shape(
        float((angles.max(axis=1) > OBTUSE).mean()),
        chords / around,
        float(np.abs(360 - total).mean()) if len(total) else 0.0,
        length / (2 * np.sqrt(np.pi * area)),
    )


def difficulty(mesh: TriangleMesh, uv: NDArray[np.complex128]) -> Difficulty | None:
    """Return the difficulty of a surface by a map (n,); None if that has no common gauge."""
    crowded = boundary_crowding(mesh, uv)
    span = factor_spans(mesh, uv)["conformal_factor_span_99_8"]
    return None if crowded is None else Difficulty(span, crowded)


def boundary_crowding(mesh: TriangleMesh, uv: NDArray[np.complex128]) -> float | None:
    """Return how unevenly a map to the disk scales the boundary, in the common gauge.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface; the boundary is its outer one.
    uv : complex128 (n,)
        The map.

    Returns
    -------
    float or None
        The 99 over the 1 percentile of image length over length of the boundary's edges; None
        if the map has no such gauge, or an edge has no length.
    """
    if not is_disk_map(mesh, uv):
        return None
    try:
        centred = in_common_gauge(mesh, uv)
    except AlgorithmFailed:
        return None
    loop = mesh.loops[0]
    after = np.roll(loop, -1)
    lengths = np.linalg.norm(mesh.V[after] - mesh.V[loop], axis=1)
    images = np.abs(centred[after] - centred[loop])
    if not (lengths.min() > 0 and images.min() > 0):
        return None
    low, high = np.percentile(images / lengths, [1, 99])
    return float(high / low)
