"""Find the vertices and triangles, or the UVs, among a file's arrays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.core.arrays import Complex
from cembench.core.errors import MeshError
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.soup import Soup, complex_of, damaged

#: So many times the memory of a file's arrays is needed to find and check a surface among them.
COPIES = 4
#: Usual names of vertices and triangles, tried before any guess.
USUAL = (("v", "f"), ("V", "F"))
#: Names of arrays of UVs, and of their indices at corners.
_UV_NAMES, _INDEX_NAMES = ("uv", "UV"), ("fuv", "FUV", "ftc", "FTC", "F_uv")
UV_ARRAYS = (*_UV_NAMES, *_INDEX_NAMES)
#: Two arrays fit if the indices span one of these ranges exactly: 1 to n, or 0 to n - 1.
_COUNTED_FROM = (1, 0)


def soup_of_arrays(
    found: Mapping[str, NDArray[Any]],
    asked: tuple[str, str] | None,
    counted_from: int | None,
    names: Sequence[str],
) -> Soup:
    """Build a surface from the requested arrays, else from usual names, else from two that fit.

    Two arrays fit if one is (n, 3) or (n, 2) and the other is (m, 3) with whole numbers that
    include the first and the last vertex. Two-dimensional vertices are used only if no others fit,
    and get z = 0.

    Parameters
    ----------
    found : mapping of str to array
        The two-dimensional arrays of numbers.
    asked : tuple of two str, optional
        The names of vertices and triangles.
    counted_from : int or None
        Index of the file's first vertex, 1 in MATLAB; None to find out.
    names : sequence of str
        The names of all variables of the file.

    Raises
    ------
    MeshError
        No pair fits, or several do; the message lists the arrays.
    """
    pair = asked or next((pair for pair in USUAL if set(pair) <= set(found)), None)
    notices: tuple[Notice, ...] = ()
    if pair is None:
        pairs = [(v, f) for v in found for f in found if v != f and _fits(found[v], found[f])]
        pairs = [pair for pair in pairs if found[pair[0]].shape[1] == 3] or pairs
        if len(pairs) != 1:
            fitting = "; ".join(f"{v} and {f}" for v, f in pairs)
            why = f"several pairs fit: {fitting}" if pairs else "no two of them fit"
            raise MeshError(
                f"no variables 'v' and 'f', and {why}. It has: {_listed(found)}. Needed are the "
                'vertices (n, 3) and the triangles (m, 3); name them, as in arrays=("v2", "f2") of '
                "cembench.read_mesh."
            )
        pair = pairs[0]
        text = f"the arrays {pair[0]!r} and {pair[1]!r} were used as vertices and triangles"
        notices = (Notice(NoticeKind.ARRAYS_GUESSED, text),)
    for name in pair:
        if name not in found and name in names:
            raise MeshError(f"variable {name!r} must be real numbers of shape (rows, 3).")
        if name not in found:
            held = ", ".join(names) or "none"
            raise MeshError(f"there is no variable {name!r}; it has: {held}. Name two of these.")
    v, f = found[pair[0]], found[pair[1]]
    if v.shape[1] not in (2, 3) or f.shape[1] != 3:
        raise MeshError(
            f"{pair[0]!r} must be of shape (n, 3) and {pair[1]!r} of shape (m, 3); they are "
            f"{v.shape} and {f.shape}."
        )
    if v.shape[1] == 2:
        v = np.column_stack([v, np.zeros(len(v))])
    first = counted_from if counted_from is not None else int(f.size > 0 and f.min() == 1)
    if not _whole(f) or (f < first).any():
        raise MeshError(
            f"variable {pair[1]!r} must hold whole numbers from {first} on, the triangles' corners."
        )
    return Soup.from_arrays(v, f, np.full(len(f), 3), counted_from=first, notices=notices)


def soup_of_uv(arrays: Mapping[str, NDArray[Any]], names: Iterable[str], counted_from: int) -> Soup:
    """Build UVs without a surface from ``uv``, (k, 2) or complex (k,), and ``fuv`` (m, 3).

    Those of corners may be in one array, (m, 3, 2) or complex (m, 3).

    Raises
    ------
    MeshError
        There is no array ``uv``, or it has another shape; the message lists the `names`.
    """
    uv = next((arrays[name] for name in _UV_NAMES if name in arrays), None)
    index = next((arrays[name] for name in _INDEX_NAMES if name in arrays), np.empty((0, 3)))
    if uv is None:
        present = ", ".join(names) or "none"
        raise damaged(f"it holds no array uv (k, 2); its arrays are: {present}")
    if uv.ndim == (2 if uv.dtype.kind == "c" else 3) and uv.shape[1] == 3:
        uv = uv.reshape(-1, *uv.shape[2:])
        index = np.arange(len(uv)) + counted_from
    whole = np.asarray(index, dtype=np.int64).reshape(-1, 3) - counted_from
    nothing = np.empty(0, dtype=np.int64)
    return Soup(
        np.empty((0, 3)), nothing, np.full(len(whole), 3), uv=_complex(uv), uv_index=whole.ravel()
    )


def _complex(uv: NDArray[Any]) -> Complex:
    """Return UVs (k, 2) or complex (k,) as complex numbers."""
    if uv.dtype.kind == "c":
        return np.ascontiguousarray(uv.ravel(), dtype=np.complex128)
    if uv.ndim != 2 or uv.shape[1] not in (2, 3) or uv.dtype.kind not in "fiu":
        raise damaged(
            f"uv is {uv.dtype} {uv.shape}; required is real (k, 2) or complex (k,), "
            "or of corners (m, 3, 2) or complex (m, 3)"
        )
    return complex_of(uv[:, :2])


def _fits(v: NDArray[Any], f: NDArray[Any]) -> bool:
    """Whether two arrays can be the vertices and the triangles of a surface."""
    if v.shape[1] not in (2, 3) or f.shape[1] != 3 or not len(f) or not _whole(f):
        return False
    return any(f.min() == first and f.max() == len(v) - 1 + first for first in _COUNTED_FROM)


def _whole(f: NDArray[Any]) -> bool:
    """Whether all numbers are whole and exact in float64."""
    return bool((np.abs(f.astype(np.float64)) < 2**53).all() and (np.round(f) == f).all())


def _listed(found: Mapping[str, NDArray[Any]]) -> str:
    """Return the names and shapes of arrays for a message."""
    return ", ".join(f"{name} {array.shape}" for name, array in found.items()) or "none"
