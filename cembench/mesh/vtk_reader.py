"""VTK files, legacy `.vtk` and `.vtu`, through meshio: triangles, quads and polygons."""

from __future__ import annotations

from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path

import numpy as np

from cembench.core.errors import MeshError
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.soup import Soup, damaged

#: meshio's names of planar cells with corners in cyclic order.
_POLYGONS = ("triangle", "quad", "polygon")


def read_vtk(path: Path) -> Soup:
    """Read the planar cells of a file; others, such as lines and tetrahedra, give a notice."""
    import meshio

    try:
        with redirect_stderr(StringIO()):  # it prints what its error says as well
            mesh = meshio.read(path)
    except MemoryError:
        raise
    except (SystemExit, Exception) as error:  # meshio calls sys.exit on some damaged files
        raise damaged(
            f"it cannot be read as {path.suffix[1:].upper()}: {type(error).__name__}: {error}"
        ) from None
    blocks = [b for b in mesh.cells if b.type.rstrip("0123456789") in _POLYGONS and len(b.data)]
    curved = [b.type for b in blocks if b.type not in _POLYGONS]
    if curved:
        raise MeshError(
            f"it has cells of type {curved[0]}, whose edges are curved; export it with straight "
            "triangles."
        )
    others = {b.type: len(b.data) for b in mesh.cells if b not in blocks and len(b.data)}
    notices: tuple[Notice, ...] = ()
    if others:
        told = ", ".join(f"{count} of type {kind}" for kind, count in others.items())
        text = f"cells that are not faces were ignored: {told}"
        notices = (Notice(NoticeKind.LINES_IGNORED, text),)
    V = np.asarray(mesh.points, dtype=np.float64)
    if V.ndim != 2 or V.shape[1] not in (2, 3):
        raise damaged(f"its points have shape {V.shape}")
    if V.shape[1] == 2:
        V = np.column_stack([V, np.zeros(len(V))])
    faces = [np.asarray(face, dtype=np.int64) for block in blocks for face in block.data]
    corners = np.concatenate(faces) if faces else np.empty(0, dtype=np.int64)
    return Soup.from_arrays(V, corners, [len(face) for face in faces], notices=notices)
