"""Wavefront OBJ, and the material file for a texture."""

from __future__ import annotations

import numpy as np

from cembench.mesh.obj_text import obj_text
from cembench.mesh.writers.textured import Textured

#: Name of the material in OBJ and MTL.
MATERIAL = "map"


def obj_bytes(surface: Textured) -> bytes:
    """Return an OBJ file; numbers are the shortest decimals that read back unchanged."""
    uv = None if surface.uv is None else surface.uv @ np.array([1, 1j])
    return obj_text(surface.V, surface.F, uv, surface.corners).encode()


def with_material(text: str, library: str) -> str:
    """Make an OBJ file use our material, and no other, from a material library beside it.

    Faces with materials of their own would not show the texture.
    """
    kept = [
        line for line in text.splitlines(keepends=True) if line.split()[:1] not in _OWN_MATERIALS
    ]
    return f"mtllib {library}\nusemtl {MATERIAL}\n{''.join(kept)}"


_OWN_MATERIALS = (["usemtl"], ["mtllib"])


def mtl_bytes(texture_file: str) -> bytes:
    """Return the material file: a texture, and no highlight."""
    lines = [f"newmtl {MATERIAL}", "Ka 1 1 1", "Kd 1 1 1", "Ks 0 0 0", "d 1", "illum 1"]
    return "\n".join([*lines, f"map_Kd {texture_file}", ""]).encode("utf-8", "surrogateescape")
