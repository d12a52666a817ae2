"""Names of arrays, for annotations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]
#: Coordinates, a row for each vertex.
Points = NDArray[np.float64]
Indices = NDArray[np.int64]
#: Vertices of a boundary loop, in order.
Loop = Indices
Mask = NDArray[np.bool_]
#: Rows of pixels, with channels.
Picture = NDArray[np.uint8]
