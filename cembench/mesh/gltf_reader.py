"""glTF files, `.glb` and `.gltf`, through trimesh: all triangles of the scene, in place."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.soup import Soup, damaged


def read_gltf(path: Path) -> Soup:
    """Read all triangles of a scene; vertices at the same position become one vertex.

    glTF has a vertex for each texture coordinate or normal, so seams would cut the surface open.
    """
    import trimesh

    try:
        scene = trimesh.load_scene(path, process=False)
        pieces = scene.dump()
    except MemoryError:
        raise
    except Exception as error:  # whatever a library raises on damaged bytes
        raise damaged(f"it cannot be read as glTF: {type(error).__name__}: {error}") from None
    meshes = [piece for piece in pieces if isinstance(piece, trimesh.Trimesh)]
    notices: tuple[Notice, ...] = ()
    if len(meshes) < len(pieces):
        told = f"{len(pieces) - len(meshes)} pieces that are points or lines were ignored"
        notices = (Notice(NoticeKind.LINES_IGNORED, told),)
    if not meshes:
        return Soup.from_arrays(np.empty((0, 3)), [], [])
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    V = np.concatenate([np.asarray(mesh.vertices, dtype=np.float64) for mesh in meshes])
    F = np.concatenate(
        [np.asarray(m.faces, dtype=np.int64) + at for m, at in zip(meshes, first, strict=False)]
    )
    apart, same = np.unique(V, axis=0, return_inverse=True)
    if len(apart) < len(V):
        V, F = apart, same.reshape(-1)[F]
    return Soup.from_arrays(V, F, np.full(len(F), 3), notices=notices)
