"""Surfaces of heights on a grid."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cembench.core.arrays import Mask, Points
from cembench.core.errors import MeshError
from cembench.mesh.soup import Soup


def heights_of(surface: Any) -> tuple[Points, Points, Points] | None:
    """Return heights, x and y of a labelled grid (xarray's DataArray), or None for anything else.

    Its dimensions are y and x, in this order, each with a coordinate for every row or column.
    """
    dims = getattr(surface, "dims", None)
    if dims is None or not hasattr(surface, "coords") or len(dims) != 2:
        return None
    y, x = (surface.coords.get(dim) for dim in dims)
    if x is None or y is None:
        raise MeshError(
            f"the heights have no coordinates along {' and '.join(map(str, dims))}. Write "
            "cembench.terrain(z, x, y), with the positions of the columns and the rows."
        )
    return _real("heights", surface), _real("x", x), _real("y", y)


def _real(what: str, values: ArrayLike) -> Points:
    """Return real numbers, NaN where a mask hides them."""
    if np.ma.isMaskedArray(values):
        values = np.ma.filled(np.ma.asarray(values, dtype=np.float64), np.nan)
    array = np.asarray(getattr(values, "values", values))
    if array.dtype.kind not in "fiub":
        raise MeshError(f"{what} are of type {array.dtype}; allowed are real numbers.")
    return array.astype(np.float64)


def soup_of_heights(z: ArrayLike, x: ArrayLike | None = None, y: ArrayLike | None = None) -> Soup:
    """Return a grid of heights as quadrilaterals that face up.

    Raises
    ------
    MeshError
        The shapes do not fit, or every quadrilateral has a corner that is not finite.
    """
    heights = _real("heights", z)
    if heights.ndim != 2 or min(heights.shape) < 2:
        raise MeshError(
            f"heights have shape {heights.shape}; allowed is (rows, columns), at least 2 each."
        )
    rows, columns = heights.shape
    X = _positions("x", np.arange(columns) if x is None else x, (rows, columns), 1)
    Y = _positions("y", np.arange(rows) if y is None else y, (rows, columns), 0)
    corner = np.arange(heights.size).reshape(heights.shape)
    around = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    quads = np.stack([side.ravel() for side in around], axis=1)
    V = np.stack([X.ravel(), Y.ravel(), heights.ravel()], axis=1)
    finite: Mask = np.asarray(np.isfinite(V).all(axis=1))
    quads = quads[finite[quads].all(axis=1)]
    if not len(quads):
        raise MeshError("no four neighbouring heights are finite: there is no surface.")
    a, b, c = (V[quads[:, k], :2] for k in (0, 1, 3))
    up = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    if up.sum() < 0:  # rows from north to south
        quads = quads[:, ::-1]
    used, corners = np.unique(quads, return_inverse=True)
    return Soup.from_arrays(V[used], corners, np.full(len(quads), 4), name="terrain")


def _positions(name: str, values: ArrayLike, shape: tuple[int, int], axis: int) -> Points:
    """Return the positions of all heights from one for each column or row, or one for each."""
    array = _real(name, values)
    if array.ndim == 0:
        array = array * np.arange(shape[axis])
    if array.shape == (shape[axis],):
        array = array[None, :] if axis else array[:, None]
    if array.ndim != 2 or array.shape[1 - axis] not in (1, shape[1 - axis]):
        array = array.ravel()
    if array.ndim != 2 or array.shape[axis] != shape[axis]:
        one = "column" if axis else "row"
        raise MeshError(
            f"{name} has shape {np.shape(values)}; allowed are the distance of neighbours, one "
            f"number for each of the {shape[axis]} {one}s, or an array of shape {shape}."
        )
    return np.broadcast_to(array, shape)
