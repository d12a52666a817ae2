"""The files that an algorithm is made of: an edited one is another algorithm.

Of a plug-in these are the file that declares it and, transitively, what that imports from its own
folder or, for a module of a package, from its package. They are found by reading the import
statements, also those inside functions, and ``import_module("name")`` with a literal name; what is
imported under a computed name, or read as data, is not seen. Of an algorithm that cembench brings
it is the declaring file alone: the commit and the version in the environment stand for the rest.
Of an external program these are its declaration, the started file and its script as well.
"""

from __future__ import annotations

import ast
import hashlib
import json
import sysconfig
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.machinery import all_suffixes
from importlib.metadata import entry_points
from pathlib import Path

from cembench.core.errors import RegistryError
from cembench.registry import Algorithm
from cembench.running.external.present import program_sources

#: Functions that import a module by a name in a string.
_IMPORTERS = ("import_module", "__import__")


def sources_of(algorithm: Algorithm) -> dict[str, str]:
    """Return the SHA-256 of an algorithm's files, by their paths relative to its folder or package.

    Raises
    ------
    RegistryError
        The declaring file is not there or cannot be read.

    """
    more = {} if algorithm.program is None else program_sources(algorithm.program)
    file = algorithm.file
    if file is None and more:  # a command line declares it
        return dict(sorted(more.items()))
    if file is None or not file.is_file():
        raise RegistryError(
            f"algorithm {algorithm.name!r}: its source {file or algorithm.module} is not a file; "
            "declare it in a Python file, by whose content its records are known."
        )
    root, top = _root(file, algorithm.module)
    alone = algorithm.module in _own_modules() or (not top and root in _shared_folders())
    files = [file] if alone else _closure(file, root, top)
    try:
        found = {
            path.relative_to(root).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
            for path in files
        }
    except OSError as error:
        raise RegistryError(f"algorithm {algorithm.name!r}: {error}.") from error
    return dict(sorted((more | found).items()))


def hash_of(sources: Mapping[str, str]) -> str:
    """Return one hash for all files: that of the only file, or of the list of hashes."""
    if len(sources) == 1:
        return next(iter(sources.values()))
    return hashlib.sha256(json.dumps(sources, sort_keys=True).encode()).hexdigest()


def code_hash(algorithm: Algorithm) -> str:
    """Return the hash of all files that an algorithm is made of."""
    return hash_of(sources_of(algorithm))


def _root(file: Path, module: str) -> tuple[Path, str]:
    """Return the folder that import names start from, and the one package to stay in, if any."""
    names, stem = module.split("."), file.name.partition(".")[0]
    place = file.parent if stem == "__init__" else file.parent / stem
    is_packaged = len(names) > 1 or stem == "__init__"
    if is_packaged and list(place.parts[-len(names) :]) == names:
        return place.parents[len(names) - 1], names[0]
    return file.parent, ""


@cache
def _own_modules() -> frozenset[str]:
    """Return the modules whose algorithms are part of cembench."""
    found = entry_points(group="cembench.algorithms")
    return frozenset(e.module for e in found if e.dist and e.dist.name == "cembench")


@cache
def _shared_folders() -> frozenset[Path]:
    """Return the folders where a module lies beside all others that are installed."""
    return frozenset(Path(folder) for folder in sysconfig.get_paths().values())


def _closure(file: Path, root: Path, top: str) -> list[Path]:
    """Return a file and all that it imports, directly or not, from within the root."""
    found: dict[Path, None] = {}
    waiting = [file]
    while waiting:
        path = waiting.pop()
        if path in found:
            continue
        found[path] = None
        folder = path.parent.relative_to(root).parts
        for name in _imported(path, folder):
            if not top or name[:1] == (top,):
                waiting += _files_of(root, name)
    return list(found)


def _imported(file: Path, package: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """Yield the names of modules that a file may import; those of objects in them are among them.

    `package` is the one that the file lies in, from where relative names start.
    """
    if file.suffix != ".py":
        return
    try:
        tree = ast.parse(file.read_bytes())
    except (SyntaxError, ValueError, RecursionError):
        return  # it is hashed, and cannot import anything
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
    """Yield the files that importing this name runs: the packages above it, and the module."""
    for depth in range(1, len(name) + 1):
        place = root.joinpath(*name[:depth])
        beside = [place.with_name(place.name + suffix) for suffix in all_suffixes()]
        inside = [place / f"__init__{suffix}" for suffix in all_suffixes()]
        yield from (path for path in (*inside, *beside) if path.is_file())
