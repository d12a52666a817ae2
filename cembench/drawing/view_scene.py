"""The data for the interactive viewer of a page: one compressed block of bytes per surface.

The block is gzip of: the length of the head (uint32, little-endian), the head (JSON), and arrays
one after another in the order that the head lists them. Coordinates and distortions are integers
from 0 to the steps in the head, of a box or a scale. To be small, vertices and triangles are in an
order that has neighbours together, and an array holds differences: from another array (a map from
the first one), or from the row before. They are modulo 256^k and stored byte by byte: the lowest
bytes of all entries, then the next ones.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from cembench.conformal.beltrami import dilatations
from cembench.conformal.metrics import angle_errors
from cembench.conformal.planar import folded_triangles, signed_areas
from cembench.core.arrays import Complex, Real
from cembench.drawing.camera import view_rotation
from cembench.mesh.triangle_mesh import TriangleMesh

#: Most triangles of a surface; larger ones are simplified.
MOST = 50_000
#: Triangles of all surfaces on one page together, to keep it small; each gets some.
TOGETHER, LEAST = 105_000, 5_000
#: Ends of the colour scales: degrees, abs(mu), and powers of two of the area scaling,
#: which is the square of the texel density.
DEGREES, MU, DOUBLINGS = 10.0, 0.3, 6.0
#: Steps of coordinates of the surface, of its images, and of distortions.
STEPS = {"V": 2**14 - 1, "uv": 2**16 - 1, "share": 2**5 - 1}
#: Up to this many maps, image coordinates have finer steps, for detail inside fingers.
FEW, FINER = 2, 2**24 - 1


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


def triangles_per_surface(faces: Sequence[int]) -> int:
    """Return the triangles that each surface on one page may have; small ones leave theirs."""
    left = TOGETHER
    for done, own in enumerate(sorted(faces)):
        share = left // (len(faces) - done)
        if own > share:
            return min(MOST, max(LEAST, share))
        left -= own
    return MOST


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
    chosen = _neighbours_together(_simplified(mesh, most))
    first = upright(mesh, maps[0].z)
    steps = STEPS | ({"uv": FINER} if len(maps) <= FEW else {})
    head: dict[str, Any] = {
        "title": title,
        "triangles": mesh.m,
        "view": view_rotation(mesh).round(6).ravel().tolist(),
        "scales": {"degrees": DEGREES, "mu": MU, "doublings": DOUBLINGS},
        "steps": steps,
        "maps": [],
        "arrays": [],
    }
    content = bytearray()
    added: dict[str, NDArray[np.int64]] = {}

    def add(name: str, values: NDArray[Any], base: str = "") -> None:
        added[name] = rows = values.reshape(len(values), *(values.shape[1:] or (1,)))
        size = -(-int(rows.max(initial=1)).bit_length() // 8)
        head["arrays"].append([name, rows.size, rows.shape[1], size, base])
        before = added[base] if base else np.vstack([np.zeros_like(rows[:1]), rows[:-1]])
        difference = ((rows - before) % 256**size).astype("<u4").ravel()
        content.extend(difference.view(np.uint8).reshape(-1, 4)[:, :size].T.tobytes())

    V = mesh.V[chosen.vertices]
    extent = float(np.ptp(V, axis=0).max()) or 1.0
    head["box"] = (np.ptp(V, axis=0) / extent).tolist()
    add("V", _stepped((V - V.min(axis=0)) / extent, steps["V"]))
    add("F", chosen.F)
    for k, shown in enumerate(maps):
        image = _in_box(rotated_to_match(shown.z, first))[chosen.vertices]
        add(f"uv{k}", _stepped(image, steps["uv"]), "uv0" if k else "")
        for name, shares in _distortions(mesh, shown.z).items():
            values = _stepped(shares[chosen.origin], steps["share"])
            add(f"{name}{k}", values, f"{name}0" if k else "")
        folded = np.isin(chosen.origin, folded_triangles(shown.z, mesh.F))
        add(f"folded{k}", np.flatnonzero(folded))
        head["maps"].append({"label": shown.label, "about": shown.about})
    described = json.dumps(head, separators=(",", ":")).encode()
    block = np.uint32(len(described)).astype("<u4").tobytes() + described + bytes(content)
    return gzip.compress(block, 9, mtime=0)


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


def _neighbours_together(chosen: _Simplified) -> _Simplified:
    """Order vertices by neighbourhood (reverse Cuthill-McKee), and triangles by their vertices."""
    start, end = chosen.F.ravel(), np.roll(chosen.F, 1, axis=1).ravel()
    n = len(chosen.vertices)
    edges = coo_array((np.ones(2 * start.size), (np.r_[start, end], np.r_[end, start])), (n, n))
    order = reverse_cuthill_mckee(edges.tocsr(), symmetric_mode=True)
    F = np.argsort(order)[chosen.F]
    F = np.take_along_axis(F, (F.argmin(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    rows = np.lexsort(F.T[::-1])
    return _Simplified(chosen.vertices[order], F[rows], chosen.origin[rows])


def _in_box(z: Complex) -> Real:
    """Centre a map in the unit square; (n, 2)."""
    points = np.stack([z.real, z.imag], axis=1)
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    return np.asarray((points - low - size / 2) / (size.max() or 1.0) + 0.5)


def _distortions(mesh: TriangleMesh, z: Complex) -> dict[str, Real]:
    """Return each triangle's largest angle error, |mu| and area scaling, as shares of their scales.

    The scaling is relative to the whole image; half means even.
    """
    P = mesh.V[mesh.F]
    area = np.linalg.norm(np.cross(P[:, 1] - P[:, 0], P[:, 2] - P[:, 0]), axis=1) / 2
    image = np.abs(signed_areas(z, mesh.F))
    with np.errstate(divide="ignore", invalid="ignore"):
        scaling = np.log2((image / image.sum()) / (area / area.sum()))
        stretch = dilatations(z, mesh.F, mesh.V)
        mu = np.where(np.isfinite(stretch), (stretch - 1) / (stretch + 1), 1.0)
    return {
        "angle": angle_errors(mesh, z).max(axis=1) / DEGREES,
        "mu": mu / MU,
        "area": 0.5 + np.nan_to_num(scaling, neginf=-99, posinf=99) / (2 * DOUBLINGS),
    }


def _stepped(share: Real, steps: int) -> NDArray[np.int64]:
    return np.asarray((steps * share.clip(0, 1)).round().astype(np.int64))
