"""Difficulty of surfaces (size, thin triangles, crowding) and its effect on maps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.metrics import in_common_gauge, is_disk_map
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.report.surface_facts import factor_spans


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
