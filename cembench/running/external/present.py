"""Is what an algorithm needs on this machine, and what files is it made of?"""

from __future__ import annotations

import hashlib
import importlib.util
import json
import shutil
from dataclasses import asdict
from functools import lru_cache
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as version_of
from pathlib import Path

from cembench.core.program import Library, Program
from cembench.registry import Algorithm
from cembench.results.records import External


def external_of(algorithm: Algorithm) -> External | None:
    """Return whose code an algorithm is, as a record names it; None for cembench's own."""
    if algorithm.program is not None:
        return External(kind="program", name=str(algorithm.program))
    if algorithm.library is not None:
        return External(kind="library", name=algorithm.library.package)
    return None


def missing(algorithm: Algorithm) -> str | None:
    """Return what an algorithm needs that is not there, and what brings it; None if all is."""
    program, library = algorithm.program, algorithm.library
    if program is not None and executable(program) is None:
        remedy = program.remedy or "Install it, put its folder into PATH, or name it with its path"
        return f"there is no program {program.command[0]!r} on this machine. {remedy}"
    if library is not None and importlib.util.find_spec(library.module) is None:
        return (
            f"the library {library.package} is not installed; `pip install {library.package}` "
            "brings it"
        )
    return None


def executable(program: Program) -> Path | None:
    """Return the file that a program's command starts."""
    found = shutil.which(program.command[0])
    return None if found is None else Path(found)


def library_version(library: Library) -> str | None:
    """Return the installed version of a library; None where it does not tell."""
    try:
        return version_of(library.package)
    except PackageNotFoundError:
        return None


@lru_cache(maxsize=64)
def _digest(path: Path, size: int, changed: int) -> str:
    """Return a file's SHA-256; a program of hundreds of megabytes is read once."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def program_sources(program: Program) -> dict[str, str]:
    """Return the SHA-256 of a program's declaration and of the files that its command names.

    These are the started file and, for an interpreter, its script. What they load besides is not
    seen.
    """
    declared = json.dumps(asdict(program), sort_keys=True).encode()
    found = {"declaration": hashlib.sha256(declared).hexdigest()}
    named = [executable(program), *(Path(word) for word in program.command[1:])]
    for path in named:
        try:
            if path is not None and path.is_absolute() and path.is_file():
                about = path.stat()
                found[path.name] = _digest(path, about.st_size, about.st_mtime_ns)
        except OSError:  # it may be executable and not readable
            continue
    return found
