"""xatlas, which cuts a surface into charts of small distortion and packs them."""

from __future__ import annotations

import numpy as np

from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Atlas
from cembench.core.program import Library
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import algorithm


@algorithm(
    "xatlas",
    title="xatlas",
    target="atlas",
    source="https://github.com/jpcy/xatlas",
    library=Library("xatlas", "xatlas"),
)
def xatlas(mesh: TriangleMesh) -> Atlas:
    """Map a surface to an atlas by xatlas with its default settings.

    It computes in single precision and uses all available threads, whatever `--threads` says.
    """
    import xatlas as library

    V, F = mesh.V.astype(np.float32), mesh.F.astype(np.uint32)
    _, index, uv = library.parametrize(V, F)
    if index.shape != mesh.F.shape:
        raise AlgorithmFailed(f"xatlas returned {len(index)} of {mesh.m} triangles")
    return Atlas((uv[:, 0] + 1j * uv[:, 1].astype(np.float64))[index.astype(np.int64)])
