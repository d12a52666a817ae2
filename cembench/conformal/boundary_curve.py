"""A closed curve in the plane from its lengths and its turns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import AlgorithmFailed

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]


def closed_curve(lengths: Real, turns: Real) -> tuple[Complex, float]:
    """Which closed polygon has edges in these directions and of nearly these lengths?

    Parameters
    ----------
    lengths : float (B,)
        From each vertex to the next. They are changed by as little as closes the curve, least
        squares relative to each length (Sawhney & Crane 2017, Eq. 17).
    turns : float (B,)
        Exterior angle at each vertex in radians, counter-clockwise, 2 pi in sum.

    Returns
    -------
    z : complex (B,)
        The vertices, the first at 0, its next one in the direction 1.
    change : float
        The largest share by which a length was changed.

    Raises
    ------
    AlgorithmFailed
        An edge would have no positive length.

    """
    directions = np.exp(1j * np.concatenate([[0.0], np.cumsum(turns[1:])]))
    T = np.stack([directions.real, directions.imag])
    weighted = T * lengths
    off = T @ lengths
    share = T.T @ np.linalg.solve(weighted @ T.T, off)
    change = float(np.abs(share).max())
    if not change < 1:
        raise AlgorithmFailed(
            f"the boundary's curve does not close: an edge would have to change by {change:.2g} of "
            "its length"
        )
    edges = lengths * (1 - share) * directions
    return np.concatenate([[0.0], np.cumsum(edges)[:-1]]), change
