"""Choose one of the Moebius images of a map to the disk: the mean of a measure goes to 0."""

from __future__ import annotations

from typing import Literal

import numpy as np

from cembench.conformal.harmonic import edge_lengths
from cembench.conformal.laplacian import double_areas
from cembench.core.arrays import Complex, Indices, Real
from cembench.core.blocks import in_blocks
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.triangle_mesh import TriangleMesh

#: Maximal number of Newton steps to a gauge, and the tolerance of the mean.
GAUGE_STEPS, GAUGE_ACCURACY = 200, 1e-12
#: What is centred: the outer boundary by length, the middle triangle, or the surface by area.
Gauge = Literal["boundary", "triangle", "area"]


def gauge_measure(mesh: TriangleMesh, gauge: Gauge, outer: Indices) -> Real:
    """Return the non-negative weights (n,), with sum 1, of the measure that is centred.

    `outer` is the outer boundary loop.
    """
    measure = np.zeros(mesh.n)
    if gauge == "boundary":
        lengths = edge_lengths(mesh, outer)
        measure[outer] = lengths + np.roll(lengths, 1)
    elif gauge == "triangle":
        measure[middle_triangle(mesh.V, mesh.F)] = 1
    else:
        area = np.repeat(double_areas(mesh.V, mesh.F), 3)
        measure[:] = np.bincount(mesh.F.ravel(), weights=area, minlength=mesh.n)
    return measure / measure.sum()


def moved_to_gauge(uv: Complex, measure: Real) -> Complex:
    """Move a map to the unit disk by a Moebius map so that its mean is 0.

    uv is (n,) in the closed disk; `measure` (n,) has sum 1. By Newton's method with steps cut to
    0.5.

    Raises
    ------
    AlgorithmFailed
        The mean does not reach 0: a single point has too much of the measure.
    """
    middle = complex(measure @ uv)
    for _ in range(GAUGE_STEPS):
        if abs(middle) < GAUGE_ACCURACY:
            return uv
        second = complex(measure @ (uv * uv))
        # A small b moves the mean by -b + conj(b) times the mean of z^2.
        bottom = 1 - abs(second) ** 2
        b = (middle + second * middle.conjugate()) / bottom if bottom > 0 else middle
        b *= min(1.0, 0.5 / abs(b))
        uv = (uv - b) / (1 - b.conjugate() * uv)
        middle = complex(measure @ uv)
    raise AlgorithmFailed(
        f"no Moebius map of the disk brings the gauge's mean to 0 (it stays at {abs(middle):.2g})"
    )


def middle_triangle(V: Real, F: Indices) -> Indices:
    """Return the corners of the triangle nearest to the mean vertex; V is (n, 2 or 3).

    One whose corners lie on a line, to rounding, is passed over for the next.
    """
    middle = 3 * V.mean(axis=0)

    def squared_distances(some: Indices) -> Real:
        a, b, c = (V.take(some[:, k], axis=0) for k in range(3))
        off = a + b + c - middle
        return np.asarray(np.einsum("td,td->t", off, off))

    far = in_blocks(squared_distances, F)
    for _ in range(len(F)):
        nearest = np.argmin(far)
        u, v = V[F[nearest, 1:]] - V[F[nearest, 0]]
        lengths, product = np.dot(u, u) * np.dot(v, v), np.dot(u, v)
        if not lengths - product**2 <= np.finfo(np.float64).eps * lengths:
            break
        far[nearest] = np.inf
    return F[nearest]
