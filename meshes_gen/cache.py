"""A cache of generated surfaces, keyed by everything that they depend on.

A reader sees a complete file or none. Two processes that make the same surface at once both
succeed, and the later one wins. A file that cannot be read (incomplete or damaged) counts as
absent.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from cembench.core import atomic
from cembench.core.errors import MeshError, RecordError
from cembench.core.names import file_name
from cembench.core.notices import Notice, NoticeKind
from cembench.core.version import version_of
from cembench.mesh.datasets import cache_directory
from cembench.mesh.triangle_mesh import TriangleMesh

#: Increase this if a generator's result changes: every cached surface is then made again.
GENERATOR_VERSION = 2

M = TypeVar("M", bound=TriangleMesh)


def content_key(name: str, parameters: Mapping[str, Any]) -> str:
    """Return the key of a surface, 32 digits.

    It depends on the generator version, the name, the parameters and the library versions.
    """
    libraries = ("numpy", "scipy", "scikit-image", "pymeshlab")
    content = {
        "generator": GENERATOR_VERSION,
        "name": name,
        "parameters": dict(parameters),
        "libraries": {package: version_of(package) for package in libraries},
    }
    text = json.dumps(content, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


def place_of(name: str, parameters: Mapping[str, Any]) -> Path:
    """Return the cache file of the surface with this name and these parameters."""
    return cache_directory() / "surfaces" / f"{file_name(name)}-{content_key(name, parameters)}.npz"


def cached(
    mesh_type: type[M], name: str, parameters: Mapping[str, Any], make: Callable[[], M]
) -> M:
    """Return the surface with this name and these parameters, from the cache or made by `make`.

    If the cache cannot be written to, the surface is not cached.
    """
    path = place_of(name, parameters)
    mesh = read(mesh_type, path)
    if mesh is None:
        mesh = make()
        with suppress(RecordError):
            write(mesh, path)
    return mesh


def read(mesh_type: type[M], path: Path) -> M | None:
    """Return the checked mesh in a file; None if there is none or it is damaged."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            V, F = data["V"], data["F"]
            digest, name = str(data["hash"]), str(data["name"])
            notices = _notices(data)
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    # The mesh passed its checks when it was written; the hash confirms that it is unchanged.
    mesh = mesh_type.trusted(V, F.astype(np.int64), name, notices)
    if mesh.hash != digest:
        return None
    mesh.V.setflags(write=False)
    mesh.F.setflags(write=False)
    return mesh


def _notices(data: Mapping[str, Any]) -> tuple[Notice, ...]:
    """Return the notices of a file; ValueError for an unknown kind or inconsistent numbers."""
    texts = [str(text) for text in data["notices"]]
    kinds = [NoticeKind(str(kind)) for kind in data["notice_kinds"]]
    return tuple(Notice(kind, text) for kind, text in zip(kinds, texts, strict=True))


def write(mesh: TriangleMesh, path: Path) -> None:
    """Write a mesh completely or not at all."""
    if mesh.n > np.iinfo(np.int32).max:
        raise MeshError(
            f"{mesh.name} has {mesh.n} vertices; the cache holds at most "
            f"{np.iinfo(np.int32).max}. Use the mesh without the cache."
        )
    arrays: dict[str, Any] = {
        "V": mesh.V,
        "F": mesh.F.astype(np.int32),
        "hash": np.array(mesh.hash),
        "name": np.array(mesh.name),
        "notices": np.array([notice.text for notice in mesh.notices], dtype=np.str_),
        "notice_kinds": np.array([notice.kind for notice in mesh.notices], dtype=np.str_),
    }
    atomic.write(path, lambda file: np.savez(file, **arrays))
