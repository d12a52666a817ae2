"""One mutated file: read it with the package, and let an independent reader judge."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from tests.campaign.mutations import mutate
from tests.campaign.project import CembenchError
from tests.campaign.reading import READERS, Content, Damaged
from tests.campaign.seed_files import FAMILIES, seed_file
from tests.campaign.verdict import Verdict

#: The share of files that stay legal: these must be read.
LEGAL = 0.08


class Mesh(Protocol):
    """What a reader of the package returns."""

    @property
    def V(self) -> Any:
        """Vertices (n, 3)."""

    @property
    def F(self) -> Any:
        """Triangles (m, 3)."""


Read = Callable[[Path], Mesh]


@dataclass(frozen=True)
class FileCase:
    """A file to read."""

    data: bytes
    suffix: str
    family: str
    mutations: tuple[str, ...]


def file_case(seed: int, number: int) -> FileCase:
    """Make the file of this number; the formats take turns."""
    rng = random.Random(f"{seed} file {number}")
    family = list(FAMILIES)[number % len(FAMILIES)]
    made = seed_file(family, rng)
    if rng.random() < LEGAL:
        return FileCase(made.data, made.suffix, family, ())
    data, mutations = mutate(made.data, rng)
    if data == made.data:
        mutations = ()
    return FileCase(data, made.suffix, family, mutations)


def judge_file(path: Path, read: Read, *, legal: bool) -> Verdict:
    """Read a file and compare with what its specification says that it holds.

    A file may be refused with a message unless it is `legal`. A mesh must be the file's.
    """
    try:
        mesh = read(path)
    except CembenchError as error:
        if not str(error).strip():
            return Verdict("refused", "no message", type(error).__name__)
        if legal:
            return Verdict("refused", "legal file refused", str(error))
        return Verdict("refused")
    except Exception as error:
        return Verdict("traceback", "traceback", f"{type(error).__name__}: {error}")
    return Verdict("mesh", *differences(mesh, path))


def differences(mesh: Mesh, path: Path) -> tuple[str | None, str]:
    """Return the kind of fault of a mesh that is not the file's, and what differs."""
    try:
        content = READERS[path.suffix](path.read_bytes())
    except Damaged as damage:
        return "silent loss", f"read as {len(mesh.V)} vertices; the file is damaged: {damage}"
    if any(n.kind == "isolated_left_out" for n in getattr(mesh, "notices", ())):
        content = content.used()
    allowed = _numbers_of_vertices(content, path.suffix)
    if len(mesh.V) not in allowed or len(mesh.F) != content.triangles:
        return "silent loss", (
            f"{len(mesh.V)} vertices and {len(mesh.F)} triangles; the file holds "
            f"{' or '.join(map(str, sorted(allowed)))} and {content.triangles}"
        )
    if not _same_triangles(mesh, content):
        return "other triangles", "the triangles are not the file's"
    return None, ""


def _numbers_of_vertices(content: Content, suffix: str) -> set[int]:
    """Return how many vertices there may be: a reader of STL may join them in single precision."""
    if suffix != ".stl":
        return {len(content.points)}
    return {len(content.points), len({_single(point) for point in content.points})}


def _single(point: Sequence[float]) -> tuple[float, ...]:
    """Return the point in the precision that every format has; minus zero is zero."""
    with np.errstate(over="ignore"):
        rounded: list[float] = (np.asarray(point, np.float64).astype(np.float32) + 0).tolist()
    return tuple(rounded)


def _same_triangles(mesh: Mesh, content: Content) -> bool:
    """Compare corners by place, as sets; polygons may be cut into triangles in any way."""
    read = [_single(point) for point in np.asarray(mesh.V).tolist()]
    there = [_single(point) for point in content.points]
    if any(len(polygon) > 3 for polygon in content.polygons):
        return sorted(read) == sorted(there)
    return _places(read, np.asarray(mesh.F).tolist()) == _places(there, content.polygons)


def _places(
    points: list[tuple[float, ...]], faces: Iterable[Sequence[int]]
) -> list[list[tuple[float, ...]]]:
    return sorted(sorted(points[k] for k in face) for face in faces)
