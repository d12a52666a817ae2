"""The source files of an algorithm; an edited algorithm counts as a different one.

For a plug-in, these are the declaring file and, transitively, the files it imports from its own
folder or, for a module of a package, from its package. They are found from import statements,
including those inside functions, and from ``import_module("name")`` with a literal name. Imports
under a computed name, and data files, are not found. For cembench's own algorithms it is the
declaring file alone: the commit and the version in the environment identify the rest. For an
external program, its declaration, its executable and its script are added.
"""

from __future__ import annotations

import ast
import hashlib
import json
import sysconfig
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.machinery import all_suffixes
from importlib.metadata import distribution
from pathlib import Path

from cembench.core.errors import RegistryError
from cembench.core.loading import sha256_of
from cembench.registry import Algorithm
from cembench.running.external.installed import program_sources

#: Functions that import a module by name.
_IMPORTERS = ("import_module", "__import__")


def sources_of(algorithm: Algorithm) -> dict[str, str]:
    """Return the SHA-256 of an algorithm's files, by path relative to its folder or package.

    Raises
    ------
    RegistryError
        The declaring file does not exist or cannot be read.
    """
    more = {} if algorithm.program is None else program_sources(algorithm.program)
    file = algorithm.file
    if file is None and more:  # declared on the command line
        return dict(sorted(more.items()))
    if file is None or not file.is_file():
        raise RegistryError(
            f"algorithm {algorithm.name!r}: its source {file or algorithm.module} is not a file; "
            "declare it in a Python file, whose content identifies its records."
        )
    root, top = _root(file, algorithm.module)
    alone = algorithm.module in _own_modules() or (not top and root in _shared_folders())
    files = [file] if alone else _closure(file, root, top)
    try:
        digests = {
            path.relative_to(root).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in files
        }
    except OSError as error:
        raise RegistryError(f"algorithm {algorithm.name!r}: {error}.") from error
    return dict(sorted((more | digests).items()))


def map_sources(algorithm: Algorithm, mesh_hash: str) -> dict[str, str]:
    """Return the SHA-256 of the file with the map of a surface, if any, and of its target."""
    assert algorithm.maps is not None
    digests = {"target": hashlib.sha256(algorithm.target.encode()).hexdigest()}
    if held := algorithm.maps.files.get(mesh_hash):
        path = Path(held)
        digests[f"{path.parent.name}/{path.name}"] = sha256_of(path)
    return digests


def hash_of(sources: Mapping[str, str]) -> str:
    """Return one hash for all files: that of a single file, or of the list of hashes."""
    if len(sources) == 1:
        return next(iter(sources.values()))
    return hashlib.sha256(json.dumps(sources, sort_keys=True).encode()).hexdigest()


def code_hash(algorithm: Algorithm) -> str:
    """Return the hash of all files of an algorithm."""
    return hash_of(sources_of(algorithm))


def _root(file: Path, module: str) -> tuple[Path, str]:
    """Return the folder that imports start from, and the package to stay in, if any."""
    names, stem = module.split("."), file.name.partition(".")[0]
    place = file.parent if stem == "__init__" else file.parent / stem
    is_packaged = len(names) > 1 or stem == "__init__"
    if is_packaged and list(place.parts[-len(names) :]) == names:
        return place.parents[len(names) - 1], names[0]
    return file.parent, ""


@cache
def _own_modules() -> frozenset[str]:
    """Return the modules of cembench's own algorithms."""
    entries = distribution("cembench").entry_points.select(group="cembench.algorithms")
    return frozenset(entry.module for entry in entries)


@cache
def _shared_folders() -> frozenset[Path]:
    """Return the folders that hold all installed modules."""
    return frozenset(Path(folder) for folder in sysconfig.get_paths().values())


def _closure(file: Path, root: Path, top: str) -> list[Path]:
    """Return a file and all files that it imports, directly or not, from within the root."""
    files: dict[Path, None] = {}
    waiting = [file]
    while waiting:
        path = waiting.pop()
        if path in files:
            continue
        files[path] = None
        folder = path.parent.relative_to(root).parts
        for name in _imported(path, folder):
            if not top or name[:1] == (top,):
                waiting += _files_of(root, name)
    return list(files)


def _imported(file: Path, package: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Yield the names that a file imports; names of objects in modules are included.

    `package` is the package of the file, where relative names start.
    """
    if file.suffix != ".py":
        return
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError, RecursionError):
        return  # hashed too, although it cannot import anything
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (tuple(alias.name.split(".")) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else ()
            module = (*above, *(node.module.split(".") if node.module else ()))
            yield module
            yield from ((*module, alias.name) for alias in node.names)
        elif isinstance(node, ast.Call) and node.args:
            called = getattr(node.func, "attr", None) or getattr(node.func, "id", None)
            name = getattr(node.args[0], "value", None)
            if called in _IMPORTERS and isinstance(name, str) and name:
                above = package[: len(package) + 1 - (len(name) - len(name.lstrip(".")))]
                yield (*(above if name[0] == "." else ()), *name.lstrip(".").split("."))


def _files_of(root: Path, name: tuple[str, ...]) -> Iterator[Path]:
    """Yield the files that importing this name runs: its parent packages and the module."""
    for depth in range(1, len(name) + 1):
        place = root.joinpath(*name[:depth])
        beside = [place.with_name(place.name + suffix) for suffix in all_suffixes()]
        inside = [place / f"__init__{suffix}" for suffix in all_suffixes()]
        yield from (path for path in (*inside, *beside) if path.is_file())
