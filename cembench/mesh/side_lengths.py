"""Side lengths of triangles."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def side_lengths(V: NDArray[np.float64], F: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the length of the side opposite to each corner.

    Parameters
    ----------
    V : float (n, 2) or (n, 3)
        Vertices.
    F : int64 (m, 3)
        Triangles.

    Returns
    -------
    float (m, 3)
        In the unit of V. Side c runs from corner c + 1 to corner c + 2 (modulo 3).

    """
    lengths: NDArray[np.float64] = np.linalg.norm(V[F[:, [2, 0, 1]]] - V[F[:, [1, 2, 0]]], axis=2)
    return lengths
