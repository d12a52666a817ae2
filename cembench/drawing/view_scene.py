"""The data for the interactive viewer of a page: one compressed block of bytes per surface.

The block is gzip of: the length of the head (uint32), the head (JSON), and arrays one after another
in the order that the head lists them, little-endian, each at a multiple of four bytes. Coordinates
are integers from 0 to 65535 within a box. Distortions take one byte per triangle.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.beltrami import dilatations
from cembench.conformal.metrics import angle_errors
from cembench.conformal.planar import folded_triangles, signed_areas
from cembench.drawing.camera import view_rotation
from cembench.mesh.triangle_mesh import TriangleMesh

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Most triangles of a surface; larger ones are simplified.
MOST = 50_000
#: Triangles of all surfaces on one page together, to keep it small; each gets some.
TOGETHER, LEAST = 200_000, 5_000
#: Ends of the colour scales: degrees, abs(mu), and powers of two of the area scaling.
DEGREES, MU, DOUBLINGS = 10.0, 0.3, 6.0
#: Up to this many maps, image coordinates are float32, for detail inside fingers.
FEW = 2


@dataclass(frozen=True)
class ViewedMap:
    """A map for the viewer: its name, image (n,) and a caption."""

    label: str
    z: Complex
    about: str = ""


def upright(mesh: TriangleMesh, z: Complex) -> Complex:
    """Turn a map about its centre so that up on the drawn surface is up in the image.

    Conformal maps are free to rotate; turned alike, maps of one surface can be compared by eye.
    """
    seen = mesh.V @ view_rotation(mesh).T
    return rotated_to_match(z, seen[:, 0] + 1j * seen[:, 1])


def rotated_to_match(z: Complex, other: Complex) -> Complex:
    """Turn a map about the origin so that it is closest to another, averaged over vertices."""
    overlap = complex(np.vdot(z, other - other.mean()))
    return z if overlap == 0 else z * (overlap / abs(overlap))


def triangles_per_surface(surfaces: int) -> int:
    """Return the number of triangles that each of several surfaces on one page may have."""
    return min(MOST, max(LEAST, TOGETHER // max(surfaces, 1)))


def view_scene(
    mesh: TriangleMesh, maps: Sequence[ViewedMap], title: str, most: int = MOST
) -> bytes:
    """Pack a surface and its maps for the page's viewer.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    maps : sequence of ViewedMap
        At least one; the first is shown first. They are turned alike.
    title : str
        Name of the surface.
    most : int
        The surface is simplified above this number of triangles, and the page says so.

    Returns
    -------
    bytes
        The block; the same input gives the same bytes.

    """
    chosen = _simplified(mesh, most)
    first = upright(mesh, maps[0].z)
    head: dict[str, Any] = {
        "title": title,
        "triangles": mesh.m,
        "view": view_rotation(mesh).round(6).ravel().tolist(),
        "scales": {"degrees": DEGREES, "mu": MU, "doublings": DOUBLINGS},
        "maps": [],
        "arrays": [],
    }
    content = bytearray()

    def add(name: str, values: NDArray[Any]) -> None:
        kind = {"uint8": "u1", "uint16": "u2", "uint32": "u4", "float32": "f4"}[values.dtype.name]
        head["arrays"].append([name, kind, values.size])
        content.extend(values.astype(values.dtype.newbyteorder("<")).tobytes())
        content.extend(bytes(-len(content) % 4))

    V = mesh.V[chosen.vertices]
    low, extent = V.min(axis=0), float(np.ptp(V, axis=0).max()) or 1.0
    head["box"] = (np.ptp(V, axis=0) / extent).tolist()
    add("V", (65535 * (V - low) / extent).round().astype(np.uint16))
    add("F", chosen.F.astype(np.uint16 if len(V) <= 65536 else np.uint32))
    for k, shown in enumerate(maps):
        turned = rotated_to_match(shown.z, first)
        add(f"uv{k}", _in_box(turned, chosen.vertices, precise=len(maps) <= FEW))
        for name, values in _distortions(mesh, shown.z).items():
            add(f"{name}{k}", values[chosen.origin])
        folded = np.isin(chosen.origin, folded_triangles(shown.z, mesh.F))
        add(f"folded{k}", np.flatnonzero(folded).astype(np.uint32))
        head["maps"].append({"label": shown.label, "about": shown.about})
    described = json.dumps(head, separators=(",", ":")).encode()
    described += b" " * (-len(described) % 4)
    block = np.uint32(len(described)).astype("<u4").tobytes() + described + bytes(content)
    return gzip.compress(block, 6, mtime=0)


@dataclass(frozen=True)
class _Simplified:
    """The vertices that remain, the triangles between them, and each one's original triangle."""

    vertices: NDArray[np.int64]
    F: NDArray[np.int64]
    origin: NDArray[np.int64]


def _simplified(mesh: TriangleMesh, most: int) -> _Simplified:
    """Choose vertices by edge collapses (libigl); all of them if there are few triangles."""
    everything = _Simplified(np.arange(mesh.n), mesh.F, np.arange(mesh.m))
    if mesh.m <= most:
        return everything
    import igl

    _, F, origin, vertices = igl.decimate(mesh.V, mesh.F, most)
    return _Simplified(vertices, F, origin) if len(F) else everything


def _in_box(z: Complex, vertices: NDArray[np.int64], *, precise: bool) -> NDArray[Any]:
    """Centre a map in the unit square; (2 k,) u then v."""
    low = complex(z.real.min(), z.imag.min())
    size = complex(np.ptp(z.real), np.ptp(z.imag))
    extent = max(size.real, size.imag) or 1.0
    moved = ((z - low - size / 2) / extent + (0.5 + 0.5j))[vertices]
    columns = np.stack([moved.real, moved.imag], axis=1)
    if precise:
        return columns.astype(np.float32)
    return np.asarray((65535 * columns.clip(0, 1)).round().astype(np.uint16))


def _distortions(mesh: TriangleMesh, z: Complex) -> dict[str, NDArray[np.uint8]]:
    """Return each triangle's largest angle error, |mu| and area scaling as bytes.

    The scaling is relative to the whole image; 128 means even.
    """
    P = mesh.V[mesh.F]
    area = np.linalg.norm(np.cross(P[:, 1] - P[:, 0], P[:, 2] - P[:, 0]), axis=1) / 2
    image = np.abs(signed_areas(z, mesh.F))
    with np.errstate(divide="ignore", invalid="ignore"):
        scaling = np.log2((image / image.sum()) / (area / area.sum()))
        stretch = dilatations(z, mesh.F, mesh.V)
        mu = np.where(np.isfinite(stretch), (stretch - 1) / (stretch + 1), 1.0)
    return {
        "angle": _byte(angle_errors(mesh, z).max(axis=1) / DEGREES),
        "mu": _byte(mu / MU),
        "area": _byte(0.5 + np.nan_to_num(scaling, neginf=-99, posinf=99) / (2 * DOUBLINGS)),
    }


def _byte(share: Real) -> NDArray[np.uint8]:
    return np.asarray((255 * share.clip(0, 1)).round().astype(np.uint8))
