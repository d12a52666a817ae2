"""The options that several verbs share, each with its range.

What is outside a range is refused before anything is read: the upper bounds are far above what any
machine can do, and keep sums, clocks and the system's own limits from overflowing.
"""

from __future__ import annotations

import math
import os
from enum import StrEnum
from typing import Annotated

import typer

from cembench.core.errors import ParameterError
from cembench.results.looks import LOOKS, USUAL_PRECISION
from cembench.results.paper.profiles import Profile

#: A process that has loaded the libraries holds more than a hundred MiB before any call.
LEAST_MEMORY, MOST_MEMORY = 2**28, 2**50
LONGEST = 10_000_000.0
MOST_FACES = 1_000_000_000


def finite(value: float) -> float:
    """Refuse NaN, which is neither below nor above a bound."""
    if math.isnan(value):
        raise typer.BadParameter("nan is not a number; write one within the range.")
    return value


Plugins = Annotated[
    list[str],
    typer.Option("--plugin", help="FILE.py or module:name with more algorithms. Repeatable."),
]
Parameters = Annotated[
    list[str],
    typer.Option("-p", "--parameter", metavar="NAME=VALUE", help="Set a parameter. Repeatable."),
]
Threads = Annotated[int, typer.Option(min=1, max=1024, help="Threads of the numerical libraries.")]
Timeout = Annotated[
    float,
    typer.Option(min=0.1, max=LONGEST, callback=finite, help="Seconds that a call may take."),
]
Memory = Annotated[
    str | None,
    typer.Option(
        metavar="SIZE",
        help="Memory limit of a process, from 256MiB on, as 4GiB; default: 90 % of what is free.",
    ),
]
#: Each surface has bounds of its own within these.
Faces = Annotated[
    int | None, typer.Option(min=1, max=MOST_FACES, help="Triangles of generated surfaces.")
]
Repeats = Annotated[
    int,
    typer.Option(
        "--rounds", "--repeats", min=1, max=10_000, help="Rounds; fewer than 6 give no interval."
    ),
]
FixedRounds = Annotated[
    int | None,
    typer.Option(
        "--rounds",
        "--repeats",
        min=1,
        max=10_000,
        help="A fixed number of rounds, instead of --precision; fewer than 6 give no interval.",
    ),
]
Precision = Annotated[
    str | None,
    typer.Option(
        metavar="SHARE",
        help="Measure until 95 % intervals reach so far to either side, as 5% (the default), "
        "or 0.05.",
    ),
]
MostRounds = Annotated[
    int,
    typer.Option("--max-rounds", min=LOOKS[1], max=LOOKS[-1], help="At most, with --precision."),
]
Budget = Annotated[
    str | None,
    typer.Option(
        metavar="TIME",
        help="After that, as 30m, only the first 7 rounds are finished; default: 150s for `quick`, "
        "1h for `standard`, 4h for `paper`, else 30m.",
    ),
]
RepeatBusy = Annotated[
    int,
    typer.Option(
        min=0,
        max=10,
        help="Run a process again, up to so often, beside which the machine was busy.",
    ),
]
Jobs = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=256,
        help="Checks that run side by side; timed rounds never do. Default: 1, and for --set as "
        "many as there are cores.",
    ),
]
Seed = Annotated[
    int, typer.Option(min=0, max=2**63 - 1, help="Seed of the random order within a round.")
]
Repair = Annotated[
    bool, typer.Option("--repair", help="Mend the mesh files first, as `cembench repair` does.")
]
Weld = Annotated[
    float,
    typer.Option(
        metavar="TOLERANCE",
        min=0.0,
        max=1e60,
        callback=finite,
        help="Weld vertices at most this far apart, in the file's units; 0: equal ones.",
    ),
]
FillHoles = Annotated[
    int,
    typer.Option(
        metavar="N",
        min=0,
        max=MOST_FACES,
        help="Fill holes of at most N edges; the longest loop stays.",
    ),
]
Verify = Annotated[
    bool,
    typer.Option("--verify", help="Recompute the figures of all maps, not only of a sample."),
]


#: Seconds after which no cell goes on that has had its first look.
USUAL_BUDGETS = {Profile.quick: 150.0, Profile.standard: 3600.0, Profile.paper: 4 * 3600.0}
_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0}


def precision_share(given: str) -> float:
    """Return the share that ``--precision`` names.

    Raises
    ------
    ParameterError
        It is not a share, or outside the range.

    """
    text = given.strip()
    try:
        number = float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    except ValueError:
        number = math.nan
    if not 0.001 <= number <= 0.5:
        raise ParameterError(
            f"--precision {given!r} is not allowed; write a share from 0.1% to 50%, as 5% or 0.05."
        )
    return number


def budget_seconds(given: str | None, profile: Profile | None) -> float:
    """Return the seconds that ``--budget`` names; those of the profile where it is not given.

    Raises
    ------
    ParameterError
        It is not a time, or outside the range.

    """
    from cembench.running.local import USUAL_BUDGET

    if given is None:
        return USUAL_BUDGET if profile is None else USUAL_BUDGETS[profile]
    text = given.strip().lower()
    try:
        seconds = float(text[:-1]) * _UNITS[text[-1:]]
    except (ValueError, KeyError):
        seconds = math.nan
    if not 0 <= seconds <= LONGEST:
        raise ParameterError(
            f"--budget {given!r} is not a time; write a number with a unit, as 90s, 30m or 2h."
        )
    return seconds


def settings_of_rounds(rounds: int | None, precision: str | None) -> tuple[int, float | None]:
    """Return the number of rounds and the precision of a cell: one of both, 5 % by default.

    Raises
    ------
    ParameterError
        Both are given, or the precision is not allowed.

    """
    if rounds is not None and precision is not None:
        raise ParameterError(
            "--rounds fixes the number of rounds, and --precision goes on until a figure is "
            "precise: give one of both."
        )
    if rounds is not None:
        return rounds, None
    return 0, USUAL_PRECISION if precision is None else precision_share(precision)


def usual_jobs() -> int:
    """Return how many checks run side by side where nothing is timed: one a core."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def memory_bytes(given: str | None) -> int:
    """Return the bytes that ``--memory`` names; 90 % of what is free where it is not given.

    Raises
    ------
    ParameterError
        It is not a size, or outside the range.

    """
    import psutil
    from pydantic import ByteSize, TypeAdapter, ValidationError

    if given is None:
        return int(0.9 * psutil.virtual_memory().available)
    try:
        size: int = TypeAdapter(ByteSize).validate_python(given)
    except (ValidationError, OverflowError):
        raise ParameterError(
            f"--memory {given!r} is not a size; write a number with a unit, as 4GiB or 500MB."
        ) from None
    if not LEAST_MEMORY <= size <= MOST_MEMORY:
        raise ParameterError(
            f"--memory {given!r} is {size:,} bytes; allowed: 256MiB (a process needs more than "
            "half of that to load the libraries) to 1024TiB."
        )
    return size


class Solves(StrEnum):
    """Keep a factor while its matrix stands, or factor at every solve like MATLAB's backslash."""

    reuse = "reuse"
    backslash = "backslash"


class Backend(StrEnum):
    """The library that factors."""

    cvxopt = "cvxopt"
    superlu = "superlu"
    pardiso = "pardiso"


SolvesOption = Annotated[Solves, typer.Option(help="Keep factors, or factor at every solve.")]
BackendOption = Annotated[Backend, typer.Option(help="The library that factors matrices.")]


def installed_backend(backend: Backend) -> str:
    """Return the name of a library that factors; it must be installed."""
    from cembench.linear_algebra.cholesky import linear_algebra

    with linear_algebra(backend=backend.value):
        return backend.value
