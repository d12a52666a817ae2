"""The two surfaces of OpenABF's benchmark, by its formulas (`BenchmarkFlattening.cpp`).

Given the benchmark's targets, 50,000 to 1,000,000, they have its counts of triangles.
"""

from __future__ import annotations

from math import floor, pi, sqrt
from typing import Annotated

import numpy as np
from pydantic import Field

from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import MAX_FACES, surface_family

#: Height of the waves, for squares of side 1.
AMPLITUDE = 0.3
SOURCE = "educelab/OpenABF, BenchmarkFlattening.cpp"


@surface_family("openabf-wavy", title="OpenABF's wavy square", source=f"{SOURCE} (pull request 46)")
def wavy(faces: Annotated[int, Field(ge=24, le=MAX_FACES)] = 50_000) -> DiskMesh:
    """A square grid of unit squares with one wave in each direction: nearly flat.

    z = 0.3 sin(2 pi x / k) cos(2 pi y / k) on the k by k squares, k = floor(sqrt(faces / 2)), each
    of two triangles with diagonals in one direction. Two of its corners are of one triangle.
    """
    k = floor(sqrt(faces / 2))
    y, x = np.divmod(np.arange((k + 1) ** 2), k + 1)
    z = AMPLITUDE * np.sin(2 * pi * x / k) * np.cos(2 * pi * y / k)
    at = (np.arange(k)[:, None] * (k + 1) + np.arange(k)).ravel()
    right, above, across = at + 1, at + k + 1, at + k + 2
    F = np.stack([at, above, right, right, above, across], axis=1).reshape(-1, 3)
    return DiskMesh.from_arrays(np.stack([x, y, z], axis=1), F, name="openabf-wavy")


@surface_family(
    "openabf-sphere", title="OpenABF's hemisphere", source=f"{SOURCE} (pull request 87)"
)
def sphere(faces: Annotated[int, Field(ge=24, le=MAX_FACES)] = 50_000) -> DiskMesh:
    """The unit hemisphere in rings of equal latitude, each with as many vertices.

    `rings` = floor(sqrt(faces / 8)) + 1 rings of 4 `rings` vertices around the pole: the triangles
    are needles there, and about as long as wide at the equator.
    """
    rings = floor(sqrt(faces / 8)) + 1
    sectors = 4 * rings
    ring, sector = np.divmod(np.arange(rings * sectors), sectors)
    polar, around = 0.5 * pi * (ring + 1) / rings, 2 * pi * sector / sectors
    V = np.stack(
        [np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=1
    )
    start = np.arange(sectors)
    after = (start + 1) % sectors
    inner = (1 + np.arange(rings - 1) * sectors)[:, None]
    a, b = (inner + start).ravel(), (inner + after).ravel()
    bands = np.stack([a, a + sectors, b, b, a + sectors, b + sectors], axis=1).reshape(-1, 3)
    fan = np.stack([np.zeros(sectors, dtype=np.int64), 1 + start, 1 + after], axis=1)
    V = np.concatenate([[[0.0, 0.0, 1.0]], V])
    return DiskMesh.from_arrays(V, np.concatenate([fan, bands]), name="openabf-sphere")
