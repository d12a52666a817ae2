"""MATLAB files of versions 5 to 7.2: v (n, 3) and f (m, 3) counted from 1, or two arrays that fit.

UVs are the array `uv`, and `fuv` at corners, counted from 1. scipy's reader crashes the process on
some damaged files, so it is called in another one.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from cembench.core.errors import MeshError
from cembench.mesh.formats.arrays import UV_ARRAYS, soup_of_arrays, soup_of_uv
from cembench.mesh.soup import Soup, damaged, reading_as

_HEADER_BYTES = 128


def read(path: Path, arrays: tuple[str, str] | None = None, *, uv: bool = False) -> Soup:
    """Read the vertices and triangles of a MATLAB file: v and f, the named two, or two that fit.

    With `uv` only UVs are read.
    """
    from scipy.io import loadmat, whosmat
    from scipy.io.matlab import matfile_version

    wanted = UV_ARRAYS if uv else arrays or ("v", "f")
    with reading_as("MAT"), warnings.catch_warnings(action="error"):
        version, _ = matfile_version(path, appendmat=False)
        shapes = {n: s for n, s, _ in whosmat(path, appendmat=False)} if version == 1 else {}
        others = [name for name, shape in shapes.items() if shape[1:] in ((2,), (3,))]
        chosen = wanted if uv or arrays or set(wanted) <= set(shapes) else (*wanted, *others)
        found = loadmat(path, appendmat=False, variable_names=chosen) if shapes else {}
    if any(min(shapes[name], default=0) < 0 for name in found if name in shapes):
        raise damaged("it cannot be read as MAT: a variable has a negative number of rows")
    if version != 1:
        raise MeshError(
            f"MATLAB files of version {'7.3' if version else '4'} are not supported. In MATLAB, "
            "save it with save(..., '-v7')."
        )
    _check_end(path)
    numbers = {
        name: array
        for name, array in found.items()
        if isinstance(array, np.ndarray) and array.dtype.kind in ("fiuc" if uv else "fiu")
    }
    if uv:
        return soup_of_uv(numbers, shapes, 1)
    for name in set(wanted) & set(shapes):
        if name not in numbers or shapes[name][1:] not in ((2,), (3,)):
            raise MeshError(
                f"variable {name!r} must be real numbers of shape (rows, 3); it has shape "
                f"{shapes[name]} and is {'numeric' if name in numbers else 'not real numbers'}."
            )
    return soup_of_arrays(numbers, arrays, 1, list(shapes))


def _check_end(path: Path) -> None:
    """Raise if the file ends within a variable, which scipy notices only in one that it reads."""
    content, at = path.read_bytes(), _HEADER_BYTES
    order = "<" if content[at - 2 : at] == b"IM" else ">"
    while at + 8 <= len(content):
        at += 8 + int(np.frombuffer(content, f"{order}u4", 1, at + 4)[0])
    if at != len(content):
        raise damaged("it cannot be read as MAT: it was cut short")
