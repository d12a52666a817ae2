"""Closed planar curves from edge lengths and exterior angles."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Complex, Real
from cembench.core.errors import AlgorithmFailed


def closed_curve(lengths: Real, turns: Real) -> tuple[Complex, float]:
    """Return the closed polygon with these exterior angles and nearly these edge lengths.

    Parameters
    ----------
    lengths : float (B,)
        From each vertex to the next. They are changed as little as closes the curve, in least
        squares relative to each length (Sawhney & Crane 2017, Eq. 17).
    turns : float (B,)
        Exterior angle at each vertex in radians, counter-clockwise, with sum 2 pi.

    Returns
    -------
    z : complex (B,)
        The vertices; the first is 0, and the first edge has direction 1.
    change : float
        The largest relative change of a length.

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
            f"the boundary curve does not close: an edge would have to change by {change:.2g} of "
            "its length"
        )
    edges = lengths * (1 - share) * directions
    return np.concatenate([[0.0], np.cumsum(edges)[:-1]]), change
