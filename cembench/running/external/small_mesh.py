"""The small mesh for measuring a program's start-up time, on which solving costs nothing."""

from __future__ import annotations

import numpy as np

from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh

#: Number of rings of vertices, and of vertices per ring.
RINGS, AROUND = 4, 9


def small_mesh(like: TriangleMesh) -> TriangleMesh:
    """Return a shallow cap of 63 triangles; for a surface with holes, 54 triangles with a hole."""
    holed = isinstance(like, HoledMesh)
    angle = 2 * np.pi * (np.arange(AROUND)[None, :] + 0.5 * np.arange(RINGS)[:, None]) / AROUND
    radius = (np.arange(RINGS) + 1.0)[:, None] / RINGS * np.ones(AROUND)
    x, y = (radius * np.cos(angle)).ravel(), (radius * np.sin(angle)).ravel()
    V = np.stack([x, y, 0.3 * (1 - x**2 - y**2)], axis=1)
    k = np.arange(AROUND)
    after = (k + 1) % AROUND
    F = [
        np.stack(three, axis=1) + AROUND * ring
        for ring in range(RINGS - 1)
        for three in ((k, k + AROUND, after), (after, k + AROUND, after + AROUND))
    ]
    if not holed:
        V = np.concatenate([V, [[0.0, 0.0, 0.3]]])
        F.append(np.stack([np.full(AROUND, len(V) - 1), k, after], axis=1))
    kind = HoledMesh if holed else DiskMesh
    return kind.from_arrays(V, np.concatenate(F), name="small")
