"""Pack the maps of several surfaces into the unit square."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cembench.core.arrays import Complex, Real
from cembench.mesh.unit_square import to_unit_square

#: Gap between shells as a share of the atlas's side, so that their texels do not mix.
_GAP = 1 / 128
#: Smallest side of a shell, as a share of the largest.
_SMALLEST = 1 / 16


def packed(
    maps: Sequence[Complex], areas: Sequence[float], *, equal: bool = False
) -> list[Complex]:
    """Pack several maps into the unit square, one shell each.

    Shells are placed in rows, the largest first, each in its own square and undistorted. The side
    of a square is proportional to the root of its surface's area, but at least a sixteenth of the
    largest, because files come in different units. If `equal`, all squares have the same size.

    Parameters
    ----------
    maps : sequence of complex128 (n,)
        Images of the vertices of each surface.
    areas : sequence of float
        Area of each surface.
    equal : bool
        Whether every surface gets an equal part.

    Returns
    -------
    list of complex128 (n,)
        The maps in the given order, without overlap.
    """
    if len(maps) == 1:
        return [to_unit_square(maps[0])]
    sides = np.sqrt(np.asarray(areas) / np.max(areas)).clip(min=1.0 if equal else _SMALLEST)
    order = np.argsort(-sides, kind="stable")
    low, high = 0.0, 1.0  # find the largest scale at which the rows fit
    for _ in range(50):
        scale = (low + high) / 2
        fits = _rows(sides[order] * scale) is not None
        low, high = (scale, high) if fits else (low, scale)
    places = _rows(sides[order] * low) or []
    moved: list[Complex] = [np.empty(0, np.complex128)] * len(maps)
    for k, place in zip(order, places, strict=True):
        moved[k] = place + to_unit_square(maps[k]) * (sides[k] * low)
    return moved


def _rows(sides: Real) -> list[complex] | None:
    """Return the lower left corners of squares in rows; None if they do not fit."""
    places = []
    x = y = height = 0.0
    for side in sides.tolist():
        if x + side > 1:
            x, y, height = 0.0, y + height + _GAP, 0.0
        if x + side > 1 or y + side > 1:
            return None
        places.append(complex(x, y))
        x, height = x + side + _GAP, max(height, side)
    return places
