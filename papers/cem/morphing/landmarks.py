"""Landmarks: corresponding vertices of several surfaces, such as the tip of the nose."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cembench.core.arrays import Complex
from cembench.core.errors import ParameterError
from cembench.mesh.triangle_mesh import DiskMesh

Ints = NDArray[np.int64]

#: The order of two landmarks about the first one is certain if their directions differ by this many
#: degrees from equal or opposite ones.
CLEAR_TURN = 15.0


@dataclass(frozen=True)
class Landmarks:
    """Corresponding places on several surfaces; the first goes to the centre of the disk.

    Parameters
    ----------
    names : tuple of str
        The k names.
    vertices : int64 (k, s)
        The vertex of each landmark on each of the s surfaces, counted from 0.
    """

    names: tuple[str, ...]
    vertices: Ints

    def __len__(self) -> int:
        return len(self.names)


def read_landmarks(
    path: Path, meshes: Sequence[DiskMesh], known: Sequence[Mapping[str, int]]
) -> Landmarks:
    """Read landmarks from a CSV file with rows of a name and one entry per surface.

    An entry is a vertex index, counted from 0, or the name of a landmark that the surface has. A
    first row that begins with ``name`` is a heading; empty rows and rows that begin with ``#`` are
    skipped.

    Parameters
    ----------
    path : Path
        The file.
    meshes : sequence of DiskMesh
        The surfaces, in the order of the columns.
    known : sequence of mapping
        The named landmarks of each surface; empty for a mesh file.

    Raises
    ------
    ParameterError
        The file cannot be read, a row has too few or too many entries, a surface has no landmark
        of that name, or :func:`check_landmarks` refuses them.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ParameterError(
            f"landmarks {path} cannot be read: {error}. It must be a CSV file with one row per "
            "landmark: name, vertex on the first surface, vertex on the second, ..."
        ) from None
    names: list[str] = []
    rows: list[list[int]] = []
    for number, line in enumerate(lines, start=1):
        cells = [cell.strip() for cell in next(csv.reader([line]), [])]
        if not any(cells) or line.lstrip().startswith("#"):
            continue
        if not names and cells[0].lower() == "name":
            continue
        where = f"landmarks {path}, line {number} ({cells[0]!r})"
        if len(cells) != len(meshes) + 1:
            raise ParameterError(
                f"{where}: {len(cells) - 1} vertices for {len(meshes)} surfaces; each row needs "
                "a name and one vertex for each surface."
            )
        names.append(cells[0])
        rows.append(
            [_vertex(*item, where=where) for item in zip(cells[1:], meshes, known, strict=True)]
        )
    if not names:
        raise ParameterError(
            f"landmarks {path}: the file has no rows; add at least one, or name no file."
        )
    landmarks = Landmarks(tuple(names), np.array(rows, dtype=np.int64))
    check_landmarks(landmarks, meshes)
    return landmarks


def _vertex(cell: str, mesh: DiskMesh, known: Mapping[str, int], *, where: str) -> int:
    try:
        return int(cell)
    except ValueError:
        pass
    if cell not in known:
        has = f"its landmarks are: {', '.join(known)}" if known else "it has no named landmarks"
        raise ParameterError(
            f"{where}: {cell!r} is neither a vertex index nor a landmark of {mesh.name}; {has}."
        )
    return known[cell]


def common_landmarks(meshes: Sequence[DiskMesh], known: Sequence[Mapping[str, int]]) -> Landmarks:
    """Return the named landmarks that all surfaces have, in the first one's order."""
    names = tuple(name for name in known[0] if all(name in others for others in known[1:]))
    rows = [[places[name] for places in known] for name in names]
    landmarks = Landmarks(names, np.array(rows, dtype=np.int64).reshape(len(names), len(meshes)))
    check_landmarks(landmarks, meshes)
    return landmarks


def check_landmarks(landmarks: Landmarks, meshes: Sequence[DiskMesh]) -> None:
    """Raise :class:`ParameterError` if landmarks are wrong for any map.

    That is: a name is used twice, or a vertex does not exist, is on the boundary, or has two
    landmarks.
    """
    for name in landmarks.names:
        if landmarks.names.count(name) > 1:
            raise ParameterError(f"landmark {name!r} is named twice; remove one of the rows.")
    for column, mesh in enumerate(meshes):
        on_boundary = set(mesh.boundary.tolist())
        seen: dict[int, str] = {}
        for name, vertex in zip(landmarks.names, landmarks.vertices[:, column], strict=True):
            v = int(vertex)
            where = f"landmark {name!r} on {mesh.name}: vertex {v}"
            if not 0 <= v < mesh.n:
                raise ParameterError(
                    f"{where} is out of range; allowed is 0 to {mesh.n - 1} (counted from 0)."
                )
            if v in seen:
                raise ParameterError(
                    f"{where} is also landmark {seen[v]!r}; two landmarks need two vertices."
                )
            if v in on_boundary:
                raise ParameterError(
                    f"{where} is on the boundary, whose image is fixed by the conformal map; "
                    "choose an interior vertex."
                )
            seen[v] = name


def check_order(
    names: Sequence[str], first: Complex, other: Complex, surfaces: tuple[str, str]
) -> None:
    """Raise if two landmarks have opposite orders around the first one on two surfaces.

    Parameters
    ----------
    names : sequence of str
        The landmarks' names.
    first, other : complex128 (k,)
        Their positions in the disk on two surfaces, with the first landmark at 0.
    surfaces : tuple of str
        The surfaces' names.

    Raises
    ------
    ParameterError
        The orders around the first landmark contradict each other: names were exchanged, or one
        surface is a mirror image.
    """
    turns = [np.imag(np.conj(z[:, None]) * z[None, :]) for z in (first, other)]
    sizes = [np.maximum(np.abs(z[:, None]) * np.abs(z[None, :]), 1e-300) for z in (first, other)]
    sines = [turn / size for turn, size in zip(turns, sizes, strict=True)]
    clear = np.sin(np.deg2rad(CLEAR_TURN))
    against = (np.minimum(*np.abs(sines)) > clear) & (sines[0] * sines[1] < 0)
    if against.any():
        j, k = (int(index) for index in np.argwhere(against)[0])
        way = "counter-clockwise" if sines[0][j, k] > 0 else "clockwise"
        contrary = "clockwise" if sines[0][j, k] > 0 else "counter-clockwise"
        raise ParameterError(
            f"contradictory order of landmarks: from {names[j]!r} to {names[k]!r} it goes {way} "
            f"about {names[0]!r} on {surfaces[0]}, but {contrary} on {surfaces[1]}. No map "
            "without folds can do that with the boundary fixed: swap the two if they were mixed "
            "up (left and right?), or reverse the orientation of a surface that is a mirror image."
        )
