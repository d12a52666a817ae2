"""glTF 2.0: `.glb` and `.gltf` read through trimesh; `.glb` written with textures inside.

glTF has single precision only. Vertices are therefore written relative to the centre of the
surface, and a node moves them back. Own code writes, since trimesh is an extra.
"""

from __future__ import annotations

import io
import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.core.arrays import Real
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.soup import Soup, Texture, columns, complex_of, in_single_precision, reading_as

_FLOAT, _UINT32, _VERTICES, _INDICES, _REPEAT, _LINEAR, _MIPMAPS = (
    5126, 5125, 34962, 34963, 10497, 9729, 9987,
)  # fmt: skip
#: How a binary file of version 2 begins.
_GLB = struct.pack("<4sI", b"glTF", 2)


def read(path: Path, *, uv: bool = False) -> Soup:
    """Read all triangles of a scene; vertices at the same position become one vertex.

    glTF has a vertex for each texture coordinate or normal, so seams would cut the surface open.
    With `uv` the first texture coordinates of each are read, too.
    """
    import trimesh

    with reading_as(path.suffix[1:].upper()):
        pieces = _scene(path).dump()
    meshes = [piece for piece in pieces if isinstance(piece, trimesh.Trimesh)]
    notices: tuple[Notice, ...] = ()
    if len(meshes) < len(pieces):
        text = f"{len(pieces) - len(meshes)} pieces that are points or lines were ignored"
        notices = (Notice(NoticeKind.LINES_IGNORED, text),)
    if not meshes:
        return Soup.from_arrays(np.empty((0, 3)), [], [])
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    V = np.concatenate([np.asarray(mesh.vertices, dtype=np.float64) for mesh in meshes])
    F = np.concatenate(
        [np.asarray(m.faces, dtype=np.int64) + at for m, at in zip(meshes, first, strict=False)]
    )
    uv_index = F.ravel()
    apart, same = np.unique(V, axis=0, return_inverse=True)
    if len(apart) < len(V):
        V, F = apart, same.reshape(-1)[F]
    soup = Soup.from_arrays(V, F, np.full(len(F), 3), notices=notices)
    given = np.concatenate([_uv_of(mesh) for mesh in meshes]) if uv else np.empty((0, 2))
    has_uv = bool(np.isfinite(given).any())
    return replace(soup, uv=complex_of(given), uv_index=uv_index) if has_uv else soup


def _scene(path: Path) -> Any:
    """Load a scene; trimesh reads texture coordinates only of what has a material, so all get one.

    Blender, for one, writes none for a mesh that was only unwrapped.
    """
    import trimesh

    content = path.read_bytes()
    start, end = 0, len(content)
    if content[:8] == _GLB:
        start, end = 20, 20 + struct.unpack_from("<I", content, 12)[0]
    tree = json.loads(content[start:end])
    parts = [part for mesh in tree.get("meshes", ()) for part in mesh["primitives"]]
    for part in parts:
        part.setdefault("material", len(tree.get("materials", ())))
    tree["materials"] = [*tree.get("materials", ()), {}]
    text = json.dumps(tree).encode()
    if start:
        text += b" " * (-len(text) % 4)
        rest = content[end:]
        sizes = struct.pack("<III", start + len(text) + len(rest), len(text), 0x4E4F534A)
        text = _GLB + sizes + text + rest
    resolver = trimesh.resolvers.FilePathResolver(str(path))
    kind = path.suffix[1:].lower()
    return trimesh.load_scene(io.BytesIO(text), file_type=kind, resolver=resolver, process=False)


def _uv_of(mesh: Any) -> Real:
    """Return the first texture coordinates of a mesh (n, 2); NaN if it has none."""
    uv = getattr(mesh.visual, "uv", None)
    return np.full((len(mesh.vertices), 2), np.nan) if uv is None else np.asarray(uv, np.float64)


def write(*surfaces: Soup, texture: Texture | None = None) -> bytes:
    """Return a file with one mesh per surface; the texture is shown on both sides.

    Seams are cut open, since a glTF vertex has one texture coordinate. Its v points down.
    """
    file = _File()
    for surface in surfaces:
        _add(file, surface.cut_at_seams(), texture)
    return file.packed()


class _File:
    """The parts of a file while it is composed."""

    def __init__(self) -> None:
        self.parts: dict[str, list[dict[str, Any]]] = {}
        self.content = b""

    def add(self, kind: str, part: dict[str, Any]) -> int:
        """Add a part, unless an equal one exists, and return its index."""
        known = self.parts.setdefault(kind, [])
        if part not in known:
            known.append(part)
        return known.index(part)

    def view(self, content: bytes, **more: Any) -> int:
        """Add bytes, and return the index of their view."""
        start = len(self.content)
        self.content += content + bytes(-len(content) % 4)
        view = {"buffer": 0, "byteOffset": start, "byteLength": len(content), **more}
        return self.add("bufferViews", view)

    def array(self, values: NDArray[Any], kind: str, target: int, *, bounds: bool = False) -> int:
        """Add an array, and return the index of its accessor."""
        component = _FLOAT if values.dtype.kind == "f" else _UINT32
        view = self.view(values.tobytes(), target=target)
        about = {"bufferView": view, "componentType": component, "count": len(values), "type": kind}
        if bounds:
            about |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        return self.add("accessors", about)

    def packed(self) -> bytes:
        """Return the file: a header, the parts as JSON, the bytes."""
        described = {
            "asset": {"version": "2.0", "generator": "cembench"},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(self.parts["nodes"])))}],
            **self.parts,
            "buffers": [{"byteLength": len(self.content)}],
        }
        text = json.dumps(described, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        chunks = [(b"JSON", text), (b"BIN\0", self.content)]
        body = b"".join(struct.pack("<I4s", len(part), kind) + part for kind, part in chunks)
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def _add(file: _File, surface: Soup, texture: Texture | None) -> None:
    """Add a surface as a mesh and a node."""
    middle = (surface.V.min(axis=0) + surface.V.max(axis=0)) / 2
    points = in_single_precision(surface.V - middle, "glTF")
    in_single_precision(middle, "glTF")
    attributes = {
        "POSITION": file.array(points, "VEC3", _VERTICES, bounds=True),
        "NORMAL": file.array(surface.normals().astype("<f4"), "VEC3", _VERTICES),
    }
    if surface.uv is not None:
        downwards = columns(surface.uv) * [1, -1] + [0, 1]
        st = in_single_precision(downwards, "glTF")
        attributes["TEXCOORD_0"] = file.array(st, "VEC2", _VERTICES)
    primitive = {
        "attributes": attributes,
        "indices": file.array(surface.triangles.ravel().astype("<u4"), "SCALAR", _INDICES),
        "material": _material(file, texture if surface.uv is not None else None),
    }
    name = surface.name.encode("utf-8", "replace").decode()
    node: dict[str, Any] = {"name": name}
    node["mesh"] = file.add("meshes", {"name": name, "primitives": [primitive]})
    if middle.any():
        node["translation"] = middle.tolist()
    file.parts.setdefault("nodes", []).append(node)


def _material(file: _File, texture: Texture | None) -> int:
    """Add a material, with a texture if one is given, and return its index."""
    surface: dict[str, Any] = {"metallicFactor": 0, "roughnessFactor": 1}
    if texture is not None:
        if "images" not in file.parts:  # all surfaces share it
            file.add("images", {"bufferView": file.view(texture.png), "mimeType": "image/png"})
        sampler = {"magFilter": _LINEAR, "minFilter": _MIPMAPS, "wrapS": _REPEAT, "wrapT": _REPEAT}
        source = {"sampler": file.add("samplers", sampler), "source": 0}
        surface["baseColorTexture"] = {"index": file.add("textures", source)}
    return file.add("materials", {"pbrMetallicRoughness": surface, "doubleSided": True})
