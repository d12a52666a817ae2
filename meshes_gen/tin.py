"""A survey's triangulated irregular network: random points, breaklines, and the needles they make.

Surveyors measure points at random, and densely along breaklines such as kerbs, whose top and foot
are a hand apart. The Delaunay triangulation of the plan then has triangles of all sizes, needles
among them, and long straight boundary edges.
"""

from __future__ import annotations

from typing import Annotated

import numpy as np
import scipy
from pydantic import Field

from cembench.core.arrays import Complex, Indices, Real
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import MAX_FACES, surface_family

#: Number of corners of the plan besides the ends of breaklines; share of it in which points lie.
CORNERS, INSIDE = 5, 0.98
#: Share of the points on breaklines; distance of the two lines of one, over that of points.
ON_LINES, APART = 0.6, 0.02
#: Powers of ten of the smallest and largest distance of twins, over that of points.
NEAREST, FARTHEST = -5.0, -1.0
#: Height of the step at a breakline, over the relief.
STEP = 0.003


@surface_family("tin", title="Survey TIN", source="random points, breaklines and needles")
def tin(
    faces: Annotated[int, Field(ge=200, le=MAX_FACES)] = 5_000,
    *,
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0,
    breaklines: Annotated[int, Field(ge=1, le=100)] = 10,
    twins: Annotated[float, Field(ge=0, le=0.4)] = 0.02,
    relief: Annotated[float, Field(ge=0, le=10)] = 0.15,
) -> DiskMesh:
    """The Delaunay triangulation of random points and breaklines in a polygon, with heights.

    Three fifths of the points are on `breaklines`, each a pair of close curves with a step between
    them, from boundary to boundary. A share `twins` lies beside other points, ten to 100,000 times
    closer than the mean distance. Heights are waves of amplitude `relief` over a plan of radius 1.
    """
    rng = np.random.default_rng(seed)
    count = faces // 2
    spacing = np.sqrt(np.pi / count)
    turns = 2 * np.pi * (np.arange(CORNERS) + rng.uniform(-0.3, 0.3, CORNERS)) / CORNERS
    lines = [_Line(rng, APART * spacing) for _ in range(breaklines)]
    on_each = int(ON_LINES * count) // (2 * breaklines)
    points = np.concatenate([line.points(on_each) for line in lines])
    left = int((1 - ON_LINES - twins) * count)
    radius, angle = np.sqrt(rng.uniform(0, 1, left)), rng.uniform(0, 2 * np.pi, left)
    points = np.concatenate([points, radius * np.exp(1j * angle)])
    size = int(twins * count)
    away = spacing * 10 ** rng.uniform(NEAREST, FARTHEST, size)
    beside = points[rng.choice(len(points), size, replace=False)]
    twin = beside + away * np.exp(1j * rng.uniform(0, 2 * np.pi, size))
    ends = np.concatenate([np.exp(1j * turns), *(line.ends for line in lines)])
    corners = ends[np.argsort(np.angle(ends))]
    plan, F = _triangulated(corners, np.concatenate([points, twin]))
    waves = rng.uniform(1, 7, (4, 2)) @ np.stack([plan.real, plan.imag])
    height = np.sin(waves + rng.uniform(0, 2 * np.pi, (4, 1))).mean(axis=0)
    height += STEP * sum(line.share_above(plan) for line in lines)
    return DiskMesh.from_arrays(np.stack([plan.real, plan.imag, relief * height], 1), F, name="tin")


class _Line:
    """A breakline: two waves across the plan, one `apart` above the other."""

    def __init__(self, rng: np.random.Generator, apart: float) -> None:
        self.apart, self.turn = apart, np.exp(1j * rng.uniform(0, 2 * np.pi))
        self.middle, self.wave, self.number, self.phase = rng.uniform(
            [-0.6, 0.02, 2, 0], [0.6, 0.15, 6, 2 * np.pi]
        )

    def _height(self, x: Real) -> Real:
        return self.middle + self.wave * np.sin(self.number * x + self.phase)

    @property
    def ends(self) -> Complex:
        """Where the two waves leave the unit circle, (4,)."""
        dense = self.points(40_001).reshape(2, -1)
        first, last = (np.argmax(np.abs(w) < 1, axis=1) for w in (dense, dense[:, ::-1]))
        ends = np.concatenate([dense[[0, 1], first], dense[[0, 1], -1 - last]])
        return ends / np.abs(ends)

    def points(self, count: int) -> Complex:
        """Return so many points of each wave."""
        x = np.linspace(-1, 1, count)
        return (
            np.concatenate([x + 1j * (self._height(x) + up) for up in (0, self.apart)]) * self.turn
        )

    def share_above(self, plan: Complex) -> Real:
        """Return how far points are from the lower wave to the upper one, 0 to 1."""
        w = plan / self.turn
        return np.clip((w.imag - self._height(w.real)) / self.apart, 0, 1)


def _triangulated(corners: Complex, points: Complex) -> tuple[Complex, Indices]:
    """Return the Delaunay triangulation of a convex polygon with points inside, the others left."""
    sides = np.roll(corners, -1) - corners
    from_each = (points / INSIDE)[:, None] - corners
    plan = np.concatenate([corners, points[((np.conj(sides) * from_each).imag > 0).all(axis=1)]])
    F = scipy.spatial.Delaunay(np.stack([plan.real, plan.imag], axis=1)).simplices.astype(np.int64)
    a, b, c = (plan[F[:, k]] for k in range(3))
    clockwise = (np.conj(b - a) * (c - a)).imag < 0
    F[clockwise] = F[clockwise, ::-1]
    used, F = np.unique(F, return_inverse=True)
    return plan[used], F.reshape(-1, 3)
