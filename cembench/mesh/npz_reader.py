"""NumPy archives: V (n, 3) and F (m, 3), as cembench writes them, or two arrays that fit."""

from __future__ import annotations

import zipfile
from pathlib import Path

from cembench.core.errors import MeshError
from cembench.core.loading import TooLargeError, arrays_of, declared_array
from cembench.mesh.array_pairs import COPIES, soup_of_arrays
from cembench.mesh.soup import Soup, damaged


def read_npz(path: Path, arrays: tuple[str, str] | None = None) -> Soup:
    """Read two arrays of an archive; indices count from 0, or from 1 if no index is 0."""
    try:
        with zipfile.ZipFile(path) as archive:
            held = [n.removesuffix(".npy") for n in archive.namelist() if n.endswith(".npy")]
            missing = [name for name in arrays or () if name not in held]
            if missing:
                told = ", ".join(held) or "none"
                raise MeshError(f"there is no variable {missing[0]!r}; it has: {told}.")
            declared = {name: declared_array(archive, name) for name in arrays or held}
            numbers = [
                name
                for name, (shape, dtype) in declared.items()
                if len(shape) == 2 and dtype.kind in "fiu"
            ]
            found = arrays_of(archive, numbers, COPIES)
    except (MeshError, OSError, MemoryError, TooLargeError):
        raise
    except Exception as error:  # the library may raise anything on damaged bytes
        raise damaged(f"it cannot be read as NPZ: {type(error).__name__}: {error}") from None
    return soup_of_arrays(found, arrays, None)
