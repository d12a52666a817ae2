"""Binary PLY with texture coordinates that MeshLab, Blender, VTK and trimesh read.

MeshLab accepts them only in single precision: as `s` and `t` of a vertex or, if the surface has
seams, as `texcoord` of a face.
"""

from __future__ import annotations

import numpy as np

from cembench.mesh.writers.textured import Textured, in_single_precision


def ply_bytes(surface: Textured) -> bytes:
    """Return a little-endian PLY file: coordinates float64, texture coordinates float32."""
    V, F, uv = surface.V, surface.F, surface.uv
    lines = ["ply", "format binary_little_endian 1.0"]
    if surface.texture_file is not None:
        lines.append(f"comment TextureFile {surface.texture_file}")
    lines += [f"element vertex {len(V)}", *(f"property double {axis}" for axis in "xyz")]
    by_vertex = uv is not None and not surface.has_seams
    by_corner = uv is not None and surface.has_seams
    vertex, face = [("x", "<f8", 3)], [("k", "u1"), ("F", "<i4", 3)]
    if by_vertex:
        lines += ["property float s", "property float t"]
        vertex.append(("st", "<f4", 2))
    lines += [f"element face {len(F)}", "property list uchar int vertex_indices"]
    if by_corner:
        lines.append("property list uchar float texcoord")
        face += [("c", "u1"), ("st", "<f4", 6)]
    vertices, faces = np.zeros(len(V), vertex), np.zeros(len(F), face)
    vertices["x"], faces["k"], faces["F"] = V, 3, F
    if uv is not None:
        st = in_single_precision(uv, "PLY's texture coordinates")
        if by_vertex:
            vertices["st"] = st
        else:
            faces["c"], faces["st"] = 6, st[surface.corners].reshape(-1, 6)
    header = "\n".join([*lines, "end_header", ""])
    return header.encode("utf-8", "surrogateescape") + vertices.tobytes() + faces.tobytes()
