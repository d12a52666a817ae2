"""How good given UVs are: islands, overlaps, stretch, and the worst places.

The figures of an atlas (:mod:`cembench.conformal.atlas`) say how conformal the UVs are; those here
say what else matters to a texture. UVs are in units of the texture's side: the unit square is one
picture, and [u, u + 1] x [v, v + 1] the tile 1001 + u + 10 v.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from cembench.conformal.atlas import AtlasFigures, CutMap
from cembench.conformal.metrics import METRICS, MapFigures, Metric
from cembench.conformal.planar import layered_areas, signed_areas
from cembench.conformal.texel_density import undersampled_share
from cembench.core.arrays import Complex, Indices, Real

#: Number of worst places, and their least distance as a share of the surface's diagonal.
PLACES, APART = 3, 0.05
#: Quantiles of the singular values that are told.
QUANTILES = (0.01, 0.5, 0.99)
#: How far UVs may reach beyond a tile, which is rounding.
EDGE = 1e-6


@dataclass(frozen=True)
class Place:
    """A triangle where UVs are far from conformal.

    Parameters
    ----------
    triangle : int
        Its number, counted from 0.
    island : int
        That of its island.
    position : tuple of 3 floats
        Its centre on the surface.
    dilatation : float
        Ratio of its largest to its smallest stretch; infinite if it has collapsed.
    angle_error_deg : float
        The largest change of its angles, in degrees.
    """

    triangle: int
    island: int
    position: tuple[float, ...]
    dilatation: float
    angle_error_deg: float


class UvFigures(AtlasFigures):
    """Intermediate results for the metrics of given UVs, each computed once."""

    def total(self, values: Real) -> Real:
        """Return the sums of the values of triangles (m,) over each island."""
        return np.asarray(np.bincount(self.cut.island, values, self.cut.islands), np.float64)

    @cached_property
    def stretches(self) -> Real:
        """Singular values of each triangle, the larger first, (m, 2), at equal total area."""
        F, uv, areas = self.mesh.F, self.uv, self.areas
        sides = np.abs(uv[np.roll(F, -1, axis=1)] - uv[np.roll(F, 1, axis=1)]) ** 2
        images = np.abs(self.image_areas)
        scale = areas.sum() / images.sum()
        squares = scale * (self.half_cotangents * sides).sum(axis=1) / areas
        product = scale * images / areas
        total, difference = (np.sqrt(np.maximum(squares + k * product, 0)) for k in (2, -2))
        return np.stack([total + difference, total - difference], axis=1) / 2

    @cached_property
    def symmetric_dirichlet(self) -> float:
        """Mean of s1^2 + s2^2 + 1 / s1^2 + 1 / s2^2; infinite with a folded triangle."""
        if self.folds.any():
            return float("inf")
        density = (self.stretches**2 + self.stretches**-2.0).sum(axis=1)
        return float(self.areas @ density / self.areas.sum())

    def stretch(self, column: int, share: float) -> float:
        """Return the singular value that this share of the surface does not exceed."""
        order = np.argsort(self.stretches[:, column])
        below = np.cumsum(self.areas[order]) / self.areas.sum()
        at = min(int(np.searchsorted(below, share)), len(order) - 1)
        return float(self.stretches[order[at], column])

    @cached_property
    def whole(self) -> float:
        """Area of the image, folds and layers counted."""
        return float(np.abs(self.image_areas).sum())

    @cached_property
    def layers(self) -> tuple[Real, float, float]:
        """Area that each island has over itself, of all layers, and above the lowest one.

        NaN where outlines cross too often to tell.
        """
        starts, ends, first = _outlines(self.cut)
        pieces = zip(np.split(starts, first), np.split(ends, first), strict=True)
        inside = np.array([layered_areas(*sides)[1] for sides in pieces])
        return inside, *layered_areas(starts, ends)

    @cached_property
    def tiles(self) -> Complex:
        """The lower left corner of each island's tile, (islands,)."""
        middle = self.cut.given[self.mesh.F].mean(axis=1)
        count = np.bincount(self.cut.island, minlength=self.cut.islands)
        u, v = (np.floor(self.total(part) / count) for part in (middle.real, middle.imag))
        return np.asarray(u + 1j * v)

    @cached_property
    def beyond(self) -> int:
        """Number of islands that reach beyond their tile."""
        away = self.cut.given[self.mesh.F] - self.tiles[self.cut.island, None] - (0.5 + 0.5j)
        far = np.maximum(np.abs(away.real), np.abs(away.imag)).max(axis=1) > 0.5 + EDGE
        return int((self.total(far.astype(np.float64)) > 0).sum())


def _uv(figures: MapFigures) -> UvFigures:
    assert isinstance(figures, UvFigures)
    return figures


def _stretch(column: int, share: float) -> Metric:
    name, most = ("largest", "smallest")[column], f"{100 * share:.0f}%"
    return Metric(
        f"{name}_stretch_{most}", f"{name} stretch, {most}", "", "", ".3g", ".4g",
        f"what the {name} singular value does not exceed on {most} of the surface",
        lambda f: _uv(f).stretch(column, share), better=None,
    )  # fmt: skip


#: The metrics that only given UVs have; the last one takes the unit square as the texture.
UV_METRICS: tuple[Metric, ...] = (
    Metric(
        "symmetric_dirichlet", "symmetric Dirichlet energy", "", "(4 for an isometry)", ".3f",
        ".4f", "mean over the surface of s1^2 + s2^2 + 1 / s1^2 + 1 / s2^2, s its stretches at "
        "equal total area (Smith and Schaefer 2015)",
        lambda f: _uv(f).symmetric_dirichlet,
    ),
    *(_stretch(column, share) for column in (0, 1) for share in QUANTILES),
    Metric(
        "overlap_inside_islands", "overlap inside islands", "", "of the image", ".1e", ".2g",
        "share of the image by which islands lie over themselves",
        lambda f: float(_uv(f).layers[0].sum() / _uv(f).whole),
    ),
    Metric(
        "overlap_between_islands", "overlap between islands", "", "of the image", ".1e", ".2g",
        "share of the image by which islands lie over others",
        lambda f: float(
            np.maximum(_uv(f).layers[2] - _uv(f).layers[0].sum(), 0.0) / _uv(f).whole
        ),
    ),
    Metric(
        "tiles", "tiles", "", "", ".0f", ".0f", "unit squares that hold an island (UDIM)",
        lambda f: len(np.unique(_uv(f).tiles)), better=None,
    ),
    Metric(
        "covered_share", "covered", "", "of the tiles", ".3g", ".3g",
        "share of the tiles that is covered",
        lambda f: (_uv(f).layers[1] - _uv(f).layers[2]) / len(np.unique(_uv(f).tiles)),
        better=None,
    ),
    Metric(
        "islands_beyond_their_tile", "islands beyond their tile", "", "", ".0f", ".0f",
        "islands of which a part lies outside the tile of their centre",
        lambda f: _uv(f).beyond,
    ),
    replace(
        next(metric for metric in METRICS if metric.name == "undersampled_share"),
        compute=lambda f: undersampled_share(f.areas, f.image_areas, 1.0),
    ),
)  # fmt: skip


def by_island(figures: UvFigures) -> list[dict[str, Any]]:
    """Return the figures of each island, in the order of their numbers."""
    cut, total = figures.cut, figures.total
    images, areas = total(np.abs(figures.image_areas)), total(figures.areas)
    triangles = np.bincount(cut.island, minlength=cut.islands)
    tiles = np.stack([figures.tiles.real, figures.tiles.imag], axis=1).astype(int).tolist()
    each = {
        "triangles": triangles,
        "surface_share": areas / areas.sum(),
        "image_share": images / figures.whole,
        "angle_error_mean_deg": total(figures.angle_errors.mean(axis=1)) / triangles,
        "flipped_triangles": figures.folds,
        "texel_density": np.sqrt(images / areas / (figures.whole / areas.sum())),
        "overlap": figures.layers[0] / images,
        "mirrored": cut.turned,
        "tile": [1001 + u + 10 * v if 0 <= u < 10 and v >= 0 else None for u, v in tiles],
    }
    columns = [np.asarray(values).tolist() for values in each.values()]
    return [dict(zip(each, row, strict=True)) for row in zip(*columns, strict=True)]


def _outlines(cut: CutMap) -> tuple[Complex, Complex, Indices]:
    """Return the sides that bound islands, from where to where, the islands to their left.

    Of an island, triangles that keep their orientation and those that do not are apart: where it is
    folded, it lies over itself. The sides are sorted by island; the third array has where each but
    the first one begins.
    """
    F, n = cut.surface.F, cut.surface.n
    back = signed_areas(cut.given, F) < 0
    F = np.where(back[:, None], F[:, ::-1], F)
    tail, head = F.ravel(), np.roll(F, -1, axis=1).ravel()
    piece, side = np.repeat(2 * cut.island + back, 3), np.minimum(tail, head) * n + abs(tail - head)
    order = np.lexsort((side, piece))
    piece, side = piece[order], side[order]
    first = np.append(True, (piece[1:] != piece[:-1]) | (side[1:] != side[:-1]))
    first = np.flatnonzero(first)
    # What is left of sides that are gone along both ways.
    left = np.add.reduceat(np.where(tail < head, 1, -1)[order], first)
    kept = np.repeat(first, np.abs(left))
    low, away = np.divmod(side[kept], n)
    ends = cut.given[np.stack([low, low + away])]
    ends = np.where(np.repeat(left, np.abs(left)) > 0, ends, ends[::-1])
    long = ends[0] != ends[1]
    owner = piece[kept][long] // 2
    return *ends[:, long], np.searchsorted(owner, np.arange(1, cut.islands))


def worst_places(figures: AtlasFigures) -> tuple[Place, ...]:
    """Return the triangles of the largest dilatation, apart from each other on the surface."""
    mesh = figures.mesh
    centres = mesh.V[mesh.F].mean(axis=1)
    least = APART * float(np.linalg.norm(np.ptp(mesh.V, axis=0)))
    places: list[int] = []
    left = np.argsort(-figures.dilatations, kind="stable")
    while len(left) and len(places) < PLACES:
        places.append(int(left[0]))
        left = left[np.linalg.norm(centres[left] - centres[left[0]], axis=1) > least]
    errors = figures.angle_errors.max(axis=1)
    columns = (figures.cut.island, centres, figures.dilatations, errors)
    rows = zip(places, *(column[places].tolist() for column in columns), strict=True)
    return tuple(Place(k, island, tuple(at), *worst) for k, island, at, *worst in rows)
