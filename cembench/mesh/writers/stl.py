"""Binary STL: separate triangles in single precision."""

from __future__ import annotations

import numpy as np

from cembench.mesh.writers.textured import Textured, in_single_precision


def stl_bytes(surface: Textured) -> bytes:
    """Return an STL file with the normal of each triangle."""
    facets = np.zeros(
        len(surface.F), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
    )
    P = surface.V[surface.F]
    size = float(np.abs(P).max(initial=0.0)) or 1.0
    normals = np.cross((P[:, 1] - P[:, 0]) / size, (P[:, 2] - P[:, 0]) / size)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    facets["normal"] = normals / np.where(length > 0, length, 1.0)
    facets["corners"] = in_single_precision(P, "STL")
    return bytes(80) + np.uint32(len(facets)).tobytes() + facets.tobytes()
