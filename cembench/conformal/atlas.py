"""Atlases: maps of surfaces cut into islands, with UVs at corners; islands, seams and metrics.

Two triangles are joined at an edge if the images of both its ends are exactly the same in both;
otherwise the edge is a seam. An island is a connected set of joined triangles. Moving, rotating and
scaling an island preserves its angles, so energies are divided by the area of the image before they
are compared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cembench.conformal.metrics import METRICS, MapFigures, Metric, computed
from cembench.conformal.planar import folded_triangles, signed_areas
from cembench.core.arrays import Complex, Indices, Mask
from cembench.mesh.topology import linked
from cembench.mesh.triangle_mesh import TriangleMesh

#: Metrics that do not apply to an atlas, whose outline is not meant to be round.
_NOT_OF_AN_ATLAS = ("boundary_circularity", "common_gauge_energy", "overlap_share")


@dataclass(frozen=True, eq=False)
class CutMap:
    """A surface cut along the seams of an atlas.

    Parameters
    ----------
    surface : TriangleMesh
        The same triangles, with one vertex for each image of a vertex.
    uv : complex128 (k,)
        The image of each vertex.
    island : int64 (m,)
        The island of each triangle, counted from 0.
    seams : int64 (s, 2)
        The edges of the uncut surface that are seams, by its vertices.
    seam_length : float
        Total length of the seams, in the units of the surface.
    turned : bool (islands,)
        The islands that were mirrored. In `uv` they are mirrored back, to distinguish them from
        folds and to keep the sign of angles.
    given : complex128 (k,)
        The images as they were given.
    """

    surface: TriangleMesh
    uv: Complex
    island: Indices
    seams: Indices
    seam_length: float
    turned: Mask
    given: Complex

    @property
    def islands(self) -> int:
        """Number of islands."""
        return int(self.island.max()) + 1

    @property
    def mirrored(self) -> int:
        """Number of islands that were mirrored."""
        return int(self.turned.sum())


def laid_out(mesh: TriangleMesh, corners: Complex) -> tuple[TriangleMesh, Complex]:
    """Return a surface cut along the seams of an atlas, and its map, for pictures.

    Islands that are mirrored are mirrored back, together, so that none covers another.
    """
    cut = cut_map(mesh, corners)
    return cut.surface, cut.uv


def cut_map(mesh: TriangleMesh, corners: Complex) -> CutMap:
    """Cut a surface where the images of its corners (m, 3) differ."""
    F = mesh.F
    keys = np.stack([F.ravel().astype(np.float64), corners.real.ravel(), corners.imag.ravel()])
    unique, index = np.unique(keys, axis=1, return_inverse=True)
    G = index.reshape(F.shape).astype(np.int64)
    surface = TriangleMesh.trusted(mesh.V[unique[0].astype(np.int64)], G, mesh.name)
    island, seams = _islands_and_seams(F, G)
    length = float(np.linalg.norm(mesh.V[seams[:, 0]] - mesh.V[seams[:, 1]], axis=1).sum())
    given = unique[1] + 1j * unique[2]
    areas = np.bincount(island, np.nan_to_num(signed_areas(given, G)))
    turned = areas < 0
    of_turned = np.unique(G[turned[island]])
    uv = given.copy()
    uv[of_turned] = uv[of_turned].conj()
    return CutMap(surface, uv, island, seams, length, turned, given)


def _islands_and_seams(F: Indices, G: Indices) -> tuple[Indices, Indices]:
    """Return each triangle's island, and the edges between triangles that are not joined."""
    m = len(F)
    ends = [np.concatenate([A, np.roll(A, -1, axis=1)]) for A in (F, G)]
    on_surface, in_plane = (
        np.sort(np.stack([e[:m].ravel(), e[m:].ravel()], axis=1), axis=1) for e in ends
    )
    triangle = np.repeat(np.arange(m), 3)
    order = np.lexsort((on_surface[:, 1], on_surface[:, 0]))
    edges = on_surface[order]
    twins = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
    one, other = order[twins], order[twins + 1]
    together = (in_plane[one] == in_plane[other]).all(axis=1)
    _, island = linked(triangle[one[together]], triangle[other[together]], m)
    return island, edges[twins[~together]]


class AtlasFigures(MapFigures):
    """Intermediate results for the metrics of an atlas, each computed once."""

    def __init__(self, cut: CutMap) -> None:
        super().__init__(cut.surface, cut.uv)
        self.cut = cut

    @cached_property
    def area(self) -> float:
        """A: the sum of the signed areas of all triangles, with mirrored islands mirrored back."""
        return float(signed_areas(self.uv, self.mesh.F).sum())

    @cached_property
    def folds(self) -> Indices:
        """Number of folded or collapsed triangles of each island."""
        folded = folded_triangles(self.uv, self.mesh.F)
        return np.bincount(self.cut.island[folded], minlength=self.cut.islands).astype(np.int64)


def _atlas(figures: MapFigures) -> AtlasFigures:
    assert isinstance(figures, AtlasFigures)
    return figures


#: The metrics that only an atlas has.
ATLAS_METRICS: tuple[Metric, ...] = (
    Metric(
        "islands", "islands", "islands", "", ".0f", ".0f",
        "connected parts of the image",
        lambda f: _atlas(f).cut.islands, better=None,
    ),
    Metric(
        "mirrored_islands", "mirrored islands", "mirrored", "", ".0f", ".0f",
        "islands whose orientation is opposite to that of the surface",
        lambda f: _atlas(f).cut.mirrored,
    ),
    Metric(
        "seam_length", "seam length", "seams", "in units of the surface", ".3g", ".6g",
        "total length of the surface's edges along which it is cut",
        lambda f: _atlas(f).cut.seam_length,
    ),
    Metric(
        "folds_of_worst_island", "folds of the worst island", "worst", "", ".0f", ".0f",
        "number of folded triangles in the island that has the most",
        lambda f: int(_atlas(f).folds.max()),
    ),
)  # fmt: skip


def atlas_metrics(mesh: TriangleMesh, corners: Complex) -> dict[str, float | int]:
    """Return all metrics of an atlas, by their keys in records."""
    return metrics_of(AtlasFigures(cut_map(mesh, corners)))


def metrics_of(figures: AtlasFigures, more: Sequence[Metric] = ()) -> dict[str, float | int]:
    """Return the same of a surface that was cut before, and `more` of it."""
    chosen = [metric for metric in METRICS if metric.name not in _NOT_OF_AN_ATLAS]
    return computed((*chosen, *ATLAS_METRICS, *more), figures)
