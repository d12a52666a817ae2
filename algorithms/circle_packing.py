"""Circle packing: a circle for every vertex, tangent along edges, filling the unit disk."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from cembench.conformal.discrete_metric import BlockPattern, angle_sums, angles
from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.gauge import Gauge, gauge_measure, moved_to_gauge
from cembench.conformal.laplacian import laplacian
from cembench.core.arrays import Complex, Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.linear_algebra.cholesky import Cholesky, factor_like
from cembench.mesh.side_lengths import side_lengths
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

#: Number of earlier steps used for extrapolation, and its largest size in logarithms.
MEMORY, FARTHEST = 8, 2.0
#: Bisection steps for the scale at which the boundary's circles close up.
BISECTIONS = 200


@algorithm(
    "circle-packing",
    title="Circle packing",
    target="disk",
    source="Orick, Collins & Stephenson, A linearized circle packing algorithm, 2017",
    usual=False,
    conformal=False,
    combinatorial=True,
)
def circle_packing(
    mesh: DiskMesh,
    *,
    tolerance: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 1e-6,
    max_iterations: Annotated[int, Field(ge=1, le=1_000_000)] = 500,
    gauge: Gauge = "boundary",
    repair: bool = True,
) -> Parameterization:
    """Map a disk by the circle packing of its graph, one circle per vertex.

    Ignores geometry: the maximal packing of the unit disk, in which circles of adjacent vertices
    are tangent, depends on the edges of the mesh and on nothing else. It approximates a conformal
    map where triangles are nearly regular; elsewhere it shows the price of ignoring their shape. In
    each step the circles of the boundary are laid around the unit circle, touching it from inside;
    the centres inside are found by one solve with weights from the radii; and new radii are
    computed from the angles and sectors at the centres.

    Decided here: the fixed point is reached by extrapolation over eight steps (Anderson) in the
    logarithms of the radii. The iteration ends when the angles of the circles' triangles around
    every interior vertex sum to 2 pi within `tolerance`, radians (`angle_sum`), and fails after
    `max_iterations`. The image consists of the centres, but a boundary vertex goes to the point
    where its circle touches the unit circle. A Moebius map, which preserves packings, moves the
    image into the `gauge` of direct-cem. Folds are repaired as in CEM (`fold_repairs`).
    """
    if not len(mesh.interior):
        raise AlgorithmFailed(
            "the mesh has no interior vertex, so the circle packing has no unknowns"
        )
    packing = _Packing(mesh)
    z, history = _packed(packing, tolerance, max_iterations)
    uv = _touching(mesh, z, packing.radii)
    uv = moved_to_gauge(uv, gauge_measure(mesh, gauge, mesh.boundary))
    uv[mesh.boundary] /= np.abs(uv[mesh.boundary])
    uv, folds = accepted_repair(mesh, uv, laplacian(mesh), repair=repair)
    extras = {"angle_sum": history[-1], "ignores": "geometry"}
    return Parameterization(uv, len(history), extras={**extras, **folds})


def _touching(mesh: DiskMesh, z: Complex, radii: Real) -> Complex:
    """Return the hyperbolic centres inside and the points of contact on the boundary.

    The hyperbolic centre of a circle, unlike the Euclidean one, is preserved by Moebius maps.
    """
    uv = z.copy()
    uv[mesh.boundary] /= np.abs(uv[mesh.boundary])
    i = mesh.interior
    away = np.abs(z[i])
    near, far = np.arctanh(away - radii[i]), np.arctanh(away + radii[i])
    uv[i] *= np.tanh((near + far) / 2) / np.where(away > 0, away, 1.0)
    return uv


class _Packing:
    """The map from radii to better radii; `radii` are those of the latest centres."""

    def __init__(self, mesh: DiskMesh) -> None:
        self.mesh = mesh
        self.inside = np.zeros(mesh.n, dtype=bool)
        self.inside[mesh.interior] = True
        with phase("assembly"):
            self._pattern = BlockPattern(mesh.F, self.inside)
        self._cholesky: Cholesky | None = None
        self.radii = np.ones(mesh.n)

    def centres(self, log_radii: Real) -> Complex:
        """Lay out the boundary's circles, and solve for the centres inside."""
        mesh, F, b = self.mesh, self.mesh.F, self.mesh.boundary
        with phase("assembly"):
            r = np.exp(log_radii - log_radii[b].max())
            scale, arcs = _closed_ring(r[b])
            r = self.radii = r * scale
            z = np.zeros(mesh.n, dtype=np.complex128)
            z[b] = (1 - r[b]) * np.exp(1j * (np.cumsum(arcs) - arcs))
            R = r[F]
            inradius = np.sqrt(R.prod(axis=1) / R.sum(axis=1))
            weights = inradius[:, None] / (R.sum(axis=1, keepdims=True) - R)
            A, right = self._pattern.dirichlet(weights, ~self.inside, z)
        self._cholesky = factor_like(self._cholesky, A)
        z[self.inside] = self._cholesky.solve(right)
        return z

    def better(self, z: Complex) -> Real:
        """Return the log radii for which the sectors at the centres have the right areas."""
        F, n = self.mesh.F, self.mesh.n
        with phase("angles"):
            sides = side_lengths(np.stack([z.real, z.imag], axis=1), F)
            at, _ = angles(sides)
            sector = sides.sum(axis=1, keepdims=True) / 2 - sides
            share = np.bincount(F.ravel(), (at * sector**2).ravel(), n)
            total = angle_sums(F, at, n)
            if not (share.min() > 0 and total.min() > 0):
                raise AlgorithmFailed(
                    f"{int((share <= 0).sum())} circles have vanished: the boundary is too "
                    "crowded for a packing in double precision"
                )
            return np.asarray(np.log(share / total) / 2)

    def angle_error(self, log_radii: Real) -> float:
        """Return the largest error of the angle sum 2 pi of the circles' triangles at a vertex."""
        F = self.mesh.F
        with phase("angles"):
            R = np.exp(log_radii - log_radii.max())[F]
            sums, _ = angles(R.sum(axis=1, keepdims=True) - R)
            off = angle_sums(F, sums, self.mesh.n)[self.inside] - 2 * np.pi
            return float(np.abs(off).max())


def _closed_ring(r: Real) -> tuple[float, Real]:
    """Return the factor that makes radii (B,), at most 1, those of a closed ring, and its arcs.

    The circles touch the unit circle from inside and each neighbour; arcs are seen from 0.
    """

    def arcs(scale: float) -> Real:
        a = scale * r
        free = a / (1 - a)
        return np.asarray(2 * np.arcsin(np.minimum(np.sqrt(free * np.roll(free, -1)), 1.0)))

    low, high = 0.0, 0.5
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        if not low < middle < high:
            break
        low, high = (low, middle) if arcs(middle).sum() > 2 * np.pi else (middle, high)
    return low, arcs(low)


def _packed(packing: _Packing, tolerance: float, most: int) -> tuple[Complex, list[float]]:
    """Iterate to the packing; return its centres, and the angle error after each step."""
    x = np.zeros(packing.mesh.n)
    points: list[Real] = []
    steps: list[Real] = []
    history: list[float] = []
    for _ in range(most):
        z = packing.centres(x)
        there = packing.better(z)
        history.append(packing.angle_error(there))
        if history[-1] <= tolerance:
            return packing.centres(there), history
        x = x - x.mean()
        there = there - there.mean()
        points, steps = [*points[-MEMORY:], there], [*steps[-MEMORY:], there - x]
        x = _extrapolated(points, steps)
    raise AlgorithmFailed(
        f"the packing has not converged after {most} steps: the angle sums at vertices are still "
        f"off by {history[-1]:.2g} rad in total, tolerance {tolerance:g}. Allow more with "
        "max_iterations"
    )


def _extrapolated(points: list[Real], steps: list[Real]) -> Real:
    """Return the extrapolated limit of steps (Anderson mixing); at first the last point."""
    last = points[-1]
    if len(points) < 2:
        return last
    change = np.stack([steps[-1] - step for step in steps[:-1]], axis=1)
    along = np.stack([last - point for point in points[:-1]], axis=1)
    share = np.linalg.lstsq(change, steps[-1], rcond=1e-8)[0]
    jump = along @ share
    longest = float(np.abs(jump).max())
    return np.asarray(last - jump * min(1.0, FARTHEST / longest) if longest > 0 else last)
