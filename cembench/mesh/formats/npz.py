"""NumPy archives: V (n, 3) and F (m, 3), as cembench writes them, or two arrays that fit.

UVs are the array `uv`, and `F_uv`, as cembench writes them, or `fuv` at corners.
"""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np

from cembench.core.errors import MeshError
from cembench.core.loading import TooLargeError, arrays_of, declared_array
from cembench.mesh.formats.arrays import COPIES, UV_ARRAYS, soup_of_arrays, soup_of_uv
from cembench.mesh.soup import Soup, columns, damaged


def read(path: Path, arrays: tuple[str, str] | None = None, *, uv: bool = False) -> Soup:
    """Read two arrays of an archive, or with `uv` those of UVs.

    Indices of vertices count from 0, or from 1 if no index is 0; those of UVs from 0.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            held = [n.removesuffix(".npy") for n in archive.namelist() if n.endswith(".npy")]
            chosen = [n for n in held if n in (UV_ARRAYS if uv else arrays or held)]
            declared = {name: declared_array(archive, name) for name in chosen}
            if not uv:
                chosen = [
                    name
                    for name, (shape, dtype) in declared.items()
                    if len(shape) == 2 and dtype.kind in "fiu"
                ]
            read = arrays_of(archive, chosen, COPIES)
    except (MeshError, OSError, MemoryError, TooLargeError):
        raise
    except Exception:  # the library may raise anything on damaged bytes
        raise damaged("it cannot be read as NPZ") from None
    return soup_of_uv(read, held, 0) if uv else soup_of_arrays(read, arrays, None, held)


def write(surface: Soup) -> bytes:
    """Return an archive of `V`, `F`, `uv` (k, 2) and, with seams, `F_uv` (m, 3), unrounded."""
    arrays = {"V": surface.V, "F": surface.triangles}
    if surface.uv is not None:
        arrays["uv"] = columns(surface.uv)
    if surface.has_seams:
        arrays["F_uv"] = surface.uv_triangles
    buffer = io.BytesIO()
    # numpy.savez_compressed takes several times as long for a slightly smaller file.
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, array in arrays.items():
            member = io.BytesIO()
            np.lib.format.write_array(member, np.asarray(array), allow_pickle=False)
            undated = zipfile.ZipInfo(f"{name}.npy")
            archive.writestr(undated, member.getbuffer(), zipfile.ZIP_DEFLATED, compresslevel=1)
    return buffer.getvalue()
