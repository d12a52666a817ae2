"""Small faces of a kind: disks with a nose, two eyes and a mouth, all of them bumps or dents."""

import numpy as np
from cembench.algorithms.cem import cem
from cembench.papers.cem.morphing.landmarks import Landmarks
from cembench.surfaces.flat_disk import flat_disk

from cembench import DiskMesh

#: Where the bumps are, by name, as x + i y.
NEUTRAL = {"nose": 0.05j, "eye right": -0.35 + 0.4j, "eye left": 0.35 + 0.4j, "mouth": -0.45j}
SMILE = NEUTRAL | {"mouth": 0.12 - 0.4j, "eye left": 0.42 + 0.38j}
HEIGHTS = {"nose": 0.30, "eye right": -0.12, "eye left": -0.12, "mouth": 0.15}


def relief(places=NEUTRAL, *, faces=2500, name="relief"):
    flat = flat_disk(faces)
    z = flat.V[:, 0] + 1j * flat.V[:, 1]
    height = sum(HEIGHTS[key] * np.exp(-(np.abs(z - at) ** 2) / 0.02) for key, at in places.items())
    return DiskMesh.from_arrays(np.stack([z.real, z.imag, height], 1), flat.F, name=name)


def vertices_of(mesh, places=NEUTRAL):
    z = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    return {key: int(np.argmin(np.abs(z - at))) for key, at in places.items()}


def three():
    """Three reliefs with different numbers of vertices, their maps, and their landmarks."""
    places = (SMILE, NEUTRAL, {**NEUTRAL, "mouth": -0.15 - 0.4j})
    meshes = [
        relief(at, faces=faces, name=name)
        for at, faces, name in zip(
            places, (2500, 2000, 3000), ("smile", "calm", "wry"), strict=True
        )
    ]
    items = [vertices_of(mesh, at) for mesh, at in zip(meshes, places, strict=True)]
    rows = [[vertices[key] for vertices in items] for key in NEUTRAL]
    return meshes, [cem(mesh).uv for mesh in meshes], Landmarks(tuple(NEUTRAL), np.array(rows))
