"""Move maps into the unit square, where engines expect textures."""

from __future__ import annotations

import numpy as np

from cembench.core.arrays import Complex

#: Allowed distance from the unit circle of the boundary of a map onto the disk.
_ROUNDING = 1e-9


def to_unit_square(z: Complex) -> Complex:
    """Move a map into the unit square by scaling and translation; angles are preserved.

    Parameters
    ----------
    z : complex128 (n,)
        Image of each vertex.

    Returns
    -------
    complex128 (n,)
        ``(z + 1 + 1j) / 2`` if the map lies in the unit disk and reaches its circle. Any other map
        is centred and scaled until it fills the square's width or height.

    Examples
    --------
    >>> import numpy as np
    >>> to_unit_square(np.array([-1, 1j, 0.6 - 0.8j]))
    array([0. +0.5j, 0.5+1.j , 0.8+0.1j])
    """
    if abs(np.abs(z).max() - 1) <= _ROUNDING:
        moved = (z + (1 + 1j)) / 2
    else:
        low = complex(z.real.min(), z.imag.min())
        high = complex(z.real.max(), z.imag.max())
        side = max((high - low).real, (high - low).imag) or 1.0
        moved = (z - (low + high) / 2) / side + (0.5 + 0.5j)
    return np.asarray(moved.real.clip(0, 1) + 1j * moved.imag.clip(0, 1))
