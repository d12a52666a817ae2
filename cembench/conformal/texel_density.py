"""How evenly a texture of one square picture lies on a surface, in texels per length.

The texel density of a triangle is the root of its image's area over its own, in any scale. The UVs
are those that :func:`cembench.mesh.unit_square.to_unit_square` makes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from cembench.core.arrays import Complex, Real

#: Share of the surface at either end that the ratio of densities leaves out.
TAIL = 0.01
#: Side of the picture in pixels, and the share of the surface that should get at least one.
SIDE, PIECE = 1024, 1e-4
#: Above this ratio of densities, or above this share of the surface without its texel, one chart
#: does not serve the surface.
UNEVEN, LACKING = 100.0, 0.05


def texel_density_ratio(areas: Real, images: Real) -> float:
    """Return the largest texel density over the smallest, without a hundredth at either end.

    Parameters
    ----------
    areas : float (m,)
        Areas of the triangles of the surface, which the hundredths are of.
    images : float (m,)
        Areas of their images; the sign does not matter.

    Returns
    -------
    float
        At least 1; infinite if more than a hundredth of the surface has collapsed.

    Examples
    --------
    >>> import numpy as np
    >>> texel_density_ratio(np.array([1.0, 1.0]), np.array([1.0, 9.0]))
    3.0
    """
    held = areas > 0
    areas, squared = areas[held], np.abs(images[held]) / areas[held]
    order = np.argsort(squared)
    below = np.cumsum(areas[order])
    low, high = np.searchsorted(below, [TAIL * below[-1], (1 - TAIL) * below[-1]])
    least, most = squared[order[[low, min(high, len(order) - 1)]]]
    return float(np.sqrt(most / least)) if least > 0 else float("inf")


def undersampled_share(areas: Real, images: Real, extent: float) -> float:
    """Return the share of the surface where a ten-thousandth of it gets less than one texel.

    Parameters
    ----------
    areas : float (m,)
        Areas of the triangles of the surface.
    images : float (m,)
        Areas of their images.
    extent : float
        Side of the square that the picture covers, in the units of the map.

    Returns
    -------
    float
        From 0 to 1, for a picture of :data:`SIDE` x :data:`SIDE` pixels.
    """
    if not extent:  # the map has collapsed to a point
        return 1.0
    whole = areas.sum()
    texels = np.abs(images) * (SIDE / extent) ** 2
    return float(areas[texels * PIECE * whole < areas].sum() / whole)


def extent_of(uv: Complex) -> float:
    """Return the side of the square that is the unit square of the UVs, in the map's units."""
    if abs(np.abs(uv).max() - 1) <= 1e-9:
        return 2.0
    return float(max(np.ptp(uv.real), np.ptp(uv.imag)))


def texture_words(metrics: Mapping[str, float | int | None]) -> str:
    """Return a line on the metrics of a map that matter to a texture; empty without them.

    Examples
    --------
    >>> texture_words({"texel_density_ratio": 2.26, "undersampled_share": 0.0})
    'texel density varies 2.3 : 1'
    """
    if "texel_density_ratio" not in metrics:
        return ""
    ratio, share = metrics["texel_density_ratio"], metrics["undersampled_share"] or 0.0
    words = (
        "texel density has no bound"
        if ratio is None
        else f"texel density varies {density_words(ratio)}"
    )
    if not share:
        return words
    part = f"{100 * share:.0f} %" if share >= 0.01 else "under 1 %"
    lacking = f"{part} of the surface gets less than 1 texel"
    return f"{words}; at {SIDE:,} px, {lacking}"


#: Large numbers as people write them.
_NAMED = ((1e12, "trillion"), (1e9, "billion"), (1e6, "million"))


def density_words(ratio: float) -> str:
    """Return a ratio of densities as people write it.

    >>> density_words(2.26), density_words(1538.2), density_words(3.47e8)
    ('2.3 : 1', '1,538 : 1', '347 million : 1')
    """
    if ratio >= 1e15:
        return "unbounded"
    size, name = next(((size, f" {name}") for size, name in _NAMED if ratio >= size), (1.0, ""))
    return f"{ratio / size:{',.0f' if ratio >= 10 * size else '.2g'}}{name} : 1"


def needs_islands(metrics: Mapping[str, float | int | None]) -> bool:
    """Whether the texel density varies so much that one chart does not serve the surface."""
    if "texel_density_ratio" not in metrics:
        return False
    ratio, share = metrics["texel_density_ratio"], metrics["undersampled_share"]
    return ratio is None or ratio > UNEVEN or (share or 0.0) > LACKING


#: What to do where :func:`needs_islands`.
ISLANDS = (
    "not usable as a texture in one piece: cut it into islands, with the algorithm xatlas (pip "
    "install 'cembench[xatlas]') or in a modelling program (in Blender: Smart UV Project)"
)
