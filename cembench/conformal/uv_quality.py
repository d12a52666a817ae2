"""How good given UVs are: islands, overlaps, stretch, and the worst places.

The figures of an atlas (:mod:`cembench.conformal.atlas`) say how conformal the UVs are; those here
say what else matters to a texture. UVs are in units of the texture's side: the unit square is one
picture, and [u, u + 1] x [v, v + 1] the tile 1001 + u + 10 v.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cembench.conformal.atlas import AtlasFigures, CutMap
from cembench.conformal.planar import layered_areas
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
    position : tuple of float
        Its centre on the surface.
    dilatation : float
        Ratio of its largest to its smallest stretch; infinite if it has collapsed.
    angle_error_deg : float
        The largest change of its angles, in degrees.

    """

    triangle: int
    island: int
    position: tuple[float, float, float]
    dilatation: float
    angle_error_deg: float


def singular_values(figures: AtlasFigures) -> Real:
    """Return the stretches of each triangle, the larger first, (m, 2), at equal total area."""
    F, uv, areas = figures.mesh.F, figures.uv, figures.areas
    sides = np.abs(uv[np.roll(F, -1, axis=1)] - uv[np.roll(F, 1, axis=1)]) ** 2
    images = np.abs(figures.image_areas)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = areas.sum() / images.sum()
        squares = scale * (figures.half_cotangents * sides).sum(axis=1) / areas
        product = scale * images / areas
    total, difference = (np.sqrt(np.maximum(squares + k * product, 0)) for k in (2, -2))
    return np.stack([total + difference, total - difference], axis=1) / 2


def stretch_metrics(figures: AtlasFigures) -> dict[str, float]:
    """Return the symmetric Dirichlet energy and quantiles of the singular values, by area.

    The energy is the mean over the surface of ``s1^2 + s2^2 + 1 / s1^2 + 1 / s2^2`` at equal total
    area: 4 for an isometry, infinite with a folded or collapsed triangle (Smith and Schaefer 2015).
    """
    stretch, weights = singular_values(figures), figures.areas / figures.areas.sum()
    with np.errstate(divide="ignore", over="ignore"):
        density = (stretch**2 + stretch**-2.0).sum(axis=1)
    energy = float("inf") if figures.folds.any() else float(weights @ density)
    found = {"symmetric_dirichlet": energy}
    for name, values in (("largest", stretch[:, 0]), ("smallest", stretch[:, 1])):
        order = np.argsort(values)
        at = np.searchsorted(np.cumsum(weights[order]), QUANTILES)
        for share, k in zip(QUANTILES, np.minimum(at, len(order) - 1), strict=True):
            found[f"{name}_stretch_{round(100 * share)}%"] = float(values[order[k]])
    return found


def layout_metrics(figures: AtlasFigures) -> tuple[dict[str, float], list[dict[str, Any]]]:
    """Return overlaps, tiles and coverage of a layout, and the figures of each island.

    An overlap is a share of the image's area, NaN where outlines cross too often to tell.
    """
    cut = figures.cut
    F, island, count = cut.surface.F, cut.island, cut.islands

    def total(values: Real) -> Real:
        return np.asarray(np.bincount(island, values, count), dtype=np.float64)

    images, areas = total(np.abs(figures.image_areas)), total(figures.areas)
    triangles = np.bincount(island, minlength=count)
    starts, ends, first = _outlines(cut)
    pieces = zip(np.split(starts, first), np.split(ends, first), strict=True)
    inside = np.array([layered_areas(*sides)[1] for sides in pieces])
    covered, over = layered_areas(starts, ends)
    corners = cut.given[F]
    middle = total(corners.real.mean(axis=1)) + 1j * total(corners.imag.mean(axis=1))
    tile = np.floor(middle.real / triangles) + 1j * np.floor(middle.imag / triangles)
    away = corners - tile[island, None] - (0.5 + 0.5j)
    beyond = np.maximum(np.abs(away.real), np.abs(away.imag)).max(axis=1) > 0.5 + EDGE
    density = np.sqrt(images / areas)
    whole = images.sum()
    metrics: dict[str, float] = {
        "overlap_inside_islands": float(inside.sum() / whole),
        "overlap_between_islands": float(max(over - inside.sum(), 0.0) / whole),
        "tiles": len(np.unique(tile)),
        "covered_share": float((covered - over) / len(np.unique(tile))),
        "islands_beyond_their_tile": int((total(beyond) > 0).sum()),
        "undersampled_share": undersampled_share(figures.areas, figures.image_areas, 1.0),
    }
    each = {
        "triangles": triangles,
        "surface_share": areas / areas.sum(),
        "image_share": images / whole,
        "angle_error_mean_deg": total(figures.angle_errors.mean(axis=1)) / triangles,
        "flipped_triangles": figures.folds,
        "texel_density": density / np.sqrt(whole / areas.sum()),
        "overlap": inside / images,
        "mirrored": cut.turned,
        "tile": (1001 + tile.real + 10 * tile.imag).astype(np.int64),
    }
    rows = [
        dict(zip(each, row, strict=True)) for row in zip(*map(_plain, each.values()), strict=True)
    ]
    return metrics, rows


def _plain(values: Any) -> list[Any]:
    return list(np.asarray(values).tolist())


def _outlines(cut: CutMap) -> tuple[Complex, Complex, Indices]:
    """Return the sides that bound islands, from where to where, the islands to their left.

    They are sorted by island; the third array has where each but the first one begins.
    """
    F, n = cut.surface.F, cut.surface.n
    tail, head = F.ravel(), np.roll(F, -1, axis=1).ravel()
    bound = np.flatnonzero(~np.isin(tail * n + head, head * n + tail))
    bound = bound[np.argsort(cut.island[bound // 3], kind="stable")]
    owner = cut.island[bound // 3]
    sides = np.stack([tail[bound], head[bound]], axis=1)
    sides = np.where(cut.turned[owner, None], sides[:, ::-1], sides)
    return *cut.given[sides.T], np.searchsorted(owner, np.arange(1, cut.islands))


def worst_places(figures: AtlasFigures) -> tuple[Place, ...]:
    """Return the triangles of the largest dilatation, apart from each other on the surface."""
    mesh = figures.mesh
    centres = mesh.V[mesh.F].mean(axis=1)
    least = APART * float(np.linalg.norm(np.ptp(mesh.V, axis=0)))
    places: list[int] = []
    left = np.ones(mesh.m, dtype=bool)
    for k in np.argsort(-figures.dilatations, kind="stable"):
        if left[k]:
            places.append(int(k))
            left &= np.linalg.norm(centres - centres[k], axis=1) > least
        if len(places) == PLACES or not left.any():
            break
    return tuple(
        Place(
            k,
            int(figures.cut.island[k]),
            (float(centres[k, 0]), float(centres[k, 1]), float(centres[k, 2])),
            float(figures.dilatations[k]),
            float(figures.angle_errors[k].max()),
        )
        for k in places
    )
