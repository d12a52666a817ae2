"""External programs and libraries: whether they are installed, and their files."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import shutil
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path

from cembench.core.loading import sha256_of
from cembench.core.program import Library, Program
from cembench.core.version import version_of
from cembench.registry import Algorithm
from cembench.results.records import External


def external_of(algorithm: Algorithm) -> External | None:
    """Return the identity of external code for records; None for cembench's own."""
    if algorithm.program is not None:
        return External(kind="program", name=str(algorithm.program))
    if algorithm.library is not None:
        return External(kind="library", name=algorithm.library.package)
    if algorithm.maps is not None:
        return External(kind="maps", name=algorithm.maps.folder)
    return None


def missing(algorithm: Algorithm) -> str | None:
    """Return which dependency of an algorithm is missing and how to install it, or None."""
    program, library = algorithm.program, algorithm.library
    if program is not None and executable(program) is None:
        name = program.command[0]
        remedy = program.remedy or "Install it, add its folder to PATH, or give its full path"
        folder = algorithm.file.parent.absolute() if algorithm.file else Path.cwd()
        place = f"in {folder}" if _is_relative(name) else "on this machine"
        return f"there is no program {name!r} {place}. {remedy}"
    if library is not None and importlib.util.find_spec(library.module) is None:
        return (
            f"the library {library.package} is not installed; run `pip install {library.package}`"
        )
    return None


def executable(program: Program) -> Path | None:
    """Return the executable file of a program's command."""
    name = program.command[0]
    path = None if _is_relative(name) else shutil.which(name)
    return None if path is None else Path(path)


def _is_relative(name: str) -> bool:
    """Whether a program is named by a relative path: no file was there when it was declared."""
    return Path(name).name != name and not Path(name).is_absolute()


def library_version(library: Library) -> str | None:
    """Return the installed version of a library; None if it is unknown."""
    return version_of(library.package)


@lru_cache(maxsize=64)
def _digest(path: Path, size: int, changed: int) -> str:
    """Return a file's SHA-256, cached because programs may have hundreds of megabytes."""
    return sha256_of(path)


def program_sources(program: Program) -> dict[str, str]:
    """Return the SHA-256 of a program's declaration and of the files in its command.

    These are the executable and, for an interpreter, its script. Files that they load are not
    included.
    """
    declared = json.dumps(asdict(program), sort_keys=True).encode()
    digests = {"declaration": hashlib.sha256(declared).hexdigest()}
    named = [executable(program), *(Path(word) for word in program.command[1:])]
    for path in named:
        try:
            if path is not None and path.is_absolute() and path.is_file():
                about = path.stat()
                digests[path.name] = _digest(path, about.st_size, about.st_mtime_ns)
        except OSError:  # it may be executable but not readable
            continue
    return digests
