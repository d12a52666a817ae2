"""Settings that several functions of the API share: their ranges, and the texts they may be.

The command line reads the signatures that use them, so this module imports nothing large. The upper
bounds are far above what any machine can do; they keep sums, clocks and system limits from
overflowing.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from cembench.core.arguments import Range
from cembench.core.errors import ParameterError
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    from cembench.registry import Registry

#: A process needs more than a hundred MiB to load the libraries.
MIN_MEMORY, MAX_MEMORY = 2**28, 2**50
LONGEST = 10_000_000.0
MAX_FACES = 1_000_000_000

AnyPath: TypeAlias = str | os.PathLike[str]
Placement: TypeAlias = Literal["unit", "square", "world", "disk"]
#: Targets whose outer boundary is the unit circle, so that the map can be put on a square.
ON_THE_CIRCLE = ("disk", "circular holes", "disk with holes")
Solves: TypeAlias = Literal["reuse", "backslash"]
Backend: TypeAlias = Literal["cvxopt", "cvxopt-metis", "superlu", "pardiso"]
Threads: TypeAlias = Annotated[int, Range(1, 1024)]
Timeout: TypeAlias = Annotated[float, Range(0.1, LONGEST)]
#: Each surface has its own, narrower bounds.
Faces: TypeAlias = Annotated[int, Range(1, MAX_FACES)]
Rounds: TypeAlias = Annotated[int, Range(1, 10_000)]
Seed: TypeAlias = Annotated[int, Range(0, 2**63 - 1)]

#: What a map is for: the plane for textures, the disk for comparisons and registration.
MapTarget: TypeAlias = Literal["plane", "disk", "circular holes"]
#: The recommended algorithms by target; the first that takes the surface is used.
RECOMMENDED: Mapping[MapTarget, tuple[str, ...]] = {
    "plane": ("plane", "plane-holes"),
    "disk": ("direct-cem", "direct-cem-holes"),
    "circular holes": ("direct-cem-holes",),
}
#: Names that stand for one algorithm on disks and another on surfaces with holes.
_SEVERAL = {"best": ("best", "best-holes"), "plane": RECOMMENDED["plane"]}

_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0}


def precision_share(precision: float | str) -> float:
    """Return the share that a precision names: 0.05, "0.05" or "5%".

    Raises
    ------
    ParameterError
        It is not a share, or is outside the range.
    """
    text = str(precision).strip()
    try:
        number = float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    except ValueError:
        number = math.nan
    if not 0.001 <= number <= 0.5:
        raise ParameterError(
            f"precision={precision!r} is not allowed; write a share from 0.1% to 50%, e.g. 5% or "
            "0.05."
        )
    return number


def budget_seconds(budget: float | str | None) -> float | None:
    """Return the seconds that a budget names: 90, "90s", "30m" or "2h"; None for no limit.

    Raises
    ------
    ParameterError
        It is not a time, or is outside the range.
    """
    if budget is None:
        return None
    seconds = math.nan
    try:
        if isinstance(budget, str):
            text = budget.strip().lower()
            seconds = float(text[:-1]) * _UNITS[text[-1:]]
        else:
            seconds = float(budget)
    except (ValueError, KeyError):
        pass
    if not 0 <= seconds <= LONGEST:
        raise ParameterError(
            f"budget={budget!r} is not a time; write a number with a unit, e.g. 90s, 30m or 2h."
        )
    return seconds


def bytes_of(memory_bytes: int | str | None) -> int:
    """Return the bytes that a memory limit names, such as "4GiB"; None is 90 % of the free memory.

    Raises
    ------
    ParameterError
        It is not a size, or is outside the range.
    """
    import psutil
    from pydantic import ByteSize, TypeAdapter, ValidationError

    if memory_bytes is None:
        return int(0.9 * psutil.virtual_memory().available)
    setting = f"memory_bytes={memory_bytes!r}"
    try:
        size: int = TypeAdapter(ByteSize).validate_python(memory_bytes)
    except (ValidationError, OverflowError):
        raise ParameterError(
            f"{setting} is not a size; write a number with a unit, e.g. 4GiB or 500MB."
        ) from None
    if not MIN_MEMORY <= size <= MAX_MEMORY:
        raise ParameterError(
            f"{setting} is {size:,} bytes; allowed: 256MiB (a process needs more than half of that "
            "to load the libraries) to 1024TiB."
        )
    return size


def installed_backend(backend: str | None) -> str:
    """Return the name of a library that factors matrices; raise if it is not installed."""
    from cembench.linear_algebra.backends import default_backend
    from cembench.linear_algebra.cholesky import linear_algebra

    name = backend or default_backend()
    with linear_algebra(backend=name):
        return name


def registry_with(plugins: Sequence[str], reporter: Reporter = SILENT) -> Registry:
    """Load the registry with these plug-ins, each first in a process with a time limit."""
    from cembench.registry import load_registry

    if not plugins:
        return load_registry()
    from cembench.running.plugins import load_with_plugins

    with reporter.busy(f"importing {', '.join(plugins)}"):
        return load_with_plugins(plugins)


def algorithms_named(name: str | None, target: MapTarget | None) -> tuple[str, ...]:
    """Return the algorithms that a name or a target stands for; the first that takes a surface
    maps it.

    Raises
    ------
    ParameterError
        Both are given, or the target is unknown.
    """
    if target is not None and target not in RECOMMENDED:
        allowed = ", ".join(map(repr, RECOMMENDED))
        raise ParameterError(f"target={target!r} is unknown; allowed: {allowed}.")
    if name is not None and target is not None:
        raise ParameterError(
            f"algorithm={name!r} and target={target!r} exclude each other: an algorithm has one "
            "target. Give only one of them."
        )
    return RECOMMENDED[target or "plane"] if name is None else _SEVERAL.get(name, (name,))
