"""NumPy archives: V (n, 3) and F (m, 3), as cembench writes them, or two arrays that fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cembench.core.errors import MeshError
from cembench.mesh.array_pairs import soup_of_arrays
from cembench.mesh.soup import Soup, damaged


def read_npz(path: Path, arrays: tuple[str, str] | None = None) -> Soup:
    """Read two arrays of an archive; indices count from 0, or from 1 if no index is 0."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            names = arrays or archive.files
            missing = [name for name in names if name not in archive.files]
            if missing:
                held = ", ".join(archive.files) or "none"
                raise MeshError(f"there is no variable {missing[0]!r}; it has: {held}.")
            found = {name: archive[name] for name in names}
    except (MeshError, OSError, MemoryError):
        raise
    except Exception as error:  # the library may raise anything on damaged bytes
        raise damaged(f"it cannot be read as NPZ: {type(error).__name__}: {error}") from None
    numbers = {name: a for name, a in found.items() if a.ndim == 2 and a.dtype.kind in "fiu"}
    return soup_of_arrays(numbers, arrays, None)
