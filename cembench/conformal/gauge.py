"""Which of the Moebius images of a map to the disk is taken: a measure whose mean goes to 0."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.harmonic import edge_lengths
from cembench.mesh.triangle_mesh import TriangleMesh

Real = NDArray[np.float64]

#: What is centred: the outer boundary, by length; the middle triangle; the surface, by area.
Gauge = Literal["boundary", "triangle", "area"]


def gauge_measure(mesh: TriangleMesh, gauge: Gauge, outer: NDArray[np.int64]) -> Real:
    """Which non-negative weights (n,), 1 in sum, has the measure that is centred?

    `outer` is the outer boundary loop.
    """
    measure = np.zeros(mesh.n)
    if gauge == "boundary":
        lengths = edge_lengths(mesh, outer)
        measure[outer] = lengths + np.roll(lengths, 1)
    elif gauge == "triangle":
        measure[middle_triangle(mesh.V, mesh.F)] = 1
    else:
        a, b, c = (mesh.V[mesh.F[:, k]] for k in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        measure[:] = np.bincount(mesh.F.ravel(), weights=np.repeat(area, 3), minlength=mesh.n)
    return measure / measure.sum()


def middle_triangle(V: Real, F: NDArray[np.int64]) -> NDArray[np.int64]:
    """Which triangle's barycentre is nearest to the mean vertex? V is (n, 2 or 3); its corners."""
    a, b, c = (V.take(F[:, k], axis=0) for k in range(3))
    off = a + b + c - 3 * V.mean(axis=0)
    return F[np.argmin(np.einsum("td,td->t", off, off))]
