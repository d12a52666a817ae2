"""Options that several commands share, each with its range.

Values outside a range are refused before anything is read. The upper bounds are far above what any
machine can do; they keep sums, clocks and system limits from overflowing.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Annotated

import typer

from cembench.core.errors import ParameterError
from cembench.results.looks import LOOKS
from cembench.results.profiles import Profile

#: A process needs more than a hundred MiB to load the libraries.
LEAST_MEMORY, MOST_MEMORY = 2**28, 2**50
LONGEST = 10_000_000.0
MOST_FACES = 1_000_000_000


def finite(value: float | None) -> float | None:
    """Raise on NaN, which passes any comparison with a bound."""
    if value is not None and math.isnan(value):
        raise typer.BadParameter("nan is not allowed; write a number within the range.")
    return value


Plugins = Annotated[
    list[str],
    typer.Option("--plugin", help="FILE.py or module:name with more algorithms. Repeatable."),
]
Parameters = Annotated[
    list[str],
    typer.Option(
        "-p",
        "--parameter",
        metavar="NAME=VALUE",
        help="Set a parameter of the algorithm. Repeatable.",
    ),
]
Threads = Annotated[int, typer.Option(min=1, max=1024, help="Threads of the numerical libraries.")]
Timeout = Annotated[
    float,
    typer.Option(min=0.1, max=LONGEST, callback=finite, help="Time limit of a call, in seconds."),
]
Memory = Annotated[
    str | None,
    typer.Option(
        metavar="SIZE",
        help="Memory limit per process, e.g. 4GiB; at least 256MiB (default: 90 % of free memory).",
    ),
]
#: Each surface has its own, narrower bounds.
Faces = Annotated[
    int | None,
    typer.Option(min=1, max=MOST_FACES, help="Number of triangles of generated surfaces."),
]
Repeats = Annotated[
    int,
    typer.Option(
        "--rounds",
        "--repeats",
        min=1,
        max=10_000,
        help="Number of rounds; fewer than 6 give no interval.",
    ),
]
FixedRounds = Annotated[
    int | None,
    typer.Option(
        "--rounds",
        "--repeats",
        min=1,
        max=10_000,
        help="Fixed number of rounds, instead of --precision; fewer than 6 give no interval.",
    ),
]
Precision = Annotated[
    str | None,
    typer.Option(
        metavar="SHARE",
        help="Measure until the half-width of the 95 % intervals is at most this share, e.g. 5% "
        "or 0.05 (default: 5%).",
    ),
]
MostRounds = Annotated[
    int,
    typer.Option(
        "--max-rounds",
        min=LOOKS[1],
        max=LOOKS[-1],
        help="Maximum number of rounds with --precision.",
    ),
]
Budget = Annotated[
    str | None,
    typer.Option(
        metavar="TIME",
        help="Time of the run, e.g. 30m. While it lasts cells get rounds, the cheapest their first "
        "7 before others; each has one (default: that of the profile, else 30m).",
    ),
]


class Pairing(StrEnum):
    """Whether algorithms that are compared also share a process in each round."""

    auto = "auto"
    separate = "separate"
    process = "process"


PairingOption = Annotated[
    Pairing,
    typer.Option(
        help="Besides a process for each cell, a round may have one that the algorithms of a "
        "surface share, where processes differ more than calls (process). auto: where this "
        "machine's scatter promises narrower ratios in the same time."
    ),
]
RepeatBusy = Annotated[
    int,
    typer.Option(
        min=0,
        max=10,
        help="Repeat a process up to N times if the machine was busy with other work.",
    ),
]
Fresh = Annotated[bool, typer.Option("--fresh", help="Measure again what is already recorded.")]
Jobs = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=256,
        help="Number of checks run in parallel; timed rounds always run alone (default: 1; with "
        "--set, the number of cores).",
    ),
]
Seed = Annotated[
    int, typer.Option(min=0, max=2**63 - 1, help="Seed of the random order within a round.")
]
Repair = Annotated[
    bool, typer.Option("--repair", help="Repair the mesh files first, like `cembench repair`.")
]
Weld = Annotated[
    float | None,
    typer.Option(
        metavar="TOLERANCE",
        min=0.0,
        max=1e60,
        callback=finite,
        help="Weld vertices up to this distance apart, in the file's units; 0: equal ones only, "
        "which is the default but for the seams of a disk.",
    ),
]
FillHoles = Annotated[
    int,
    typer.Option(
        metavar="N",
        min=0,
        max=MOST_FACES,
        help="Fill holes of at most N edges; the longest boundary loop stays open.",
    ),
]
Verify = Annotated[
    bool,
    typer.Option("--verify", help="Recompute the figures of all maps, not just of a sample."),
]


_UNITS = {"s": 1.0, "m": 60.0, "h": 3600.0}


def precision_share(given: str) -> float:
    """Return the share that ``--precision`` names.

    Raises
    ------
    ParameterError
        The text is not a share, or is outside the range.

    """
    text = given.strip()
    try:
        number = float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    except ValueError:
        number = math.nan
    if not 0.001 <= number <= 0.5:
        raise ParameterError(
            f"--precision {given!r} is not allowed; write a share from 0.1% to 50%, e.g. 5% or "
            "0.05."
        )
    return number


def budget_seconds(given: str | None, profile: Profile | None) -> float:
    """Return the seconds that ``--budget`` names, or the profile's budget if it is not given.

    Raises
    ------
    ParameterError
        The text is not a time, or is outside the range.

    """
    if given is None:
        from cembench.results.papers import usual_paper
        from cembench.running.options import USUAL_BUDGET

        budgets = usual_paper().profiles.budgets
        return budgets.get(profile, USUAL_BUDGET) if profile else USUAL_BUDGET
    text = given.strip().lower()
    try:
        seconds = float(text[:-1]) * _UNITS[text[-1:]]
    except (ValueError, KeyError):
        seconds = math.nan
    if not 0 <= seconds <= LONGEST:
        raise ParameterError(
            f"--budget {given!r} is not a time; write a number with a unit, e.g. 90s, 30m or 2h."
        )
    return seconds


def settings_of_rounds(rounds: int | None, precision: str | None) -> tuple[int, float | None]:
    """Return the number of rounds and the precision of a cell; by default a precision of 5 %.

    Raises
    ------
    ParameterError
        Both are given, or the precision is not allowed.

    """
    from cembench.results.looks import USUAL_PRECISION

    if rounds is not None and precision is not None:
        raise ParameterError(
            "--rounds fixes the number of rounds, and --precision chooses it: give only one of "
            "them."
        )
    if rounds is not None:
        return rounds, None
    return 0, USUAL_PRECISION if precision is None else precision_share(precision)


def memory_bytes(given: str | None) -> int:
    """Return the bytes that ``--memory`` names, or 90 % of the free memory if it is not given.

    Raises
    ------
    ParameterError
        The text is not a size, or is outside the range.

    """
    import psutil
    from pydantic import ByteSize, TypeAdapter, ValidationError

    if given is None:
        return int(0.9 * psutil.virtual_memory().available)
    try:
        size: int = TypeAdapter(ByteSize).validate_python(given)
    except (ValidationError, OverflowError):
        raise ParameterError(
            f"--memory {given!r} is not a size; write a number with a unit, e.g. 4GiB or 500MB."
        ) from None
    if not LEAST_MEMORY <= size <= MOST_MEMORY:
        raise ParameterError(
            f"--memory {given!r} is {size:,} bytes; allowed: 256MiB (a process needs more than "
            "half of that to load the libraries) to 1024TiB."
        )
    return size


class Solves(StrEnum):
    """Reuse a factorisation while its matrix is unchanged, or factor at every solve."""

    reuse = "reuse"
    backslash = "backslash"


class Backend(StrEnum):
    """The libraries that factor matrices, and for CHOLMOD how its rows are ordered."""

    cvxopt = "cvxopt"
    cvxopt_metis = "cvxopt-metis"
    superlu = "superlu"
    pardiso = "pardiso"


SolvesOption = Annotated[
    Solves, typer.Option(help="Reuse factorisations, or factor at every solve.")
]
BackendOption = Annotated[
    Backend,
    typer.Option(help="The library that factors matrices. cvxopt-metis suits large meshes."),
]


def installed_backend(backend: Backend) -> str:
    """Return the name of the chosen library; raise if it is not installed."""
    from cembench.linear_algebra.cholesky import linear_algebra

    with linear_algebra(backend=backend.value):
        return backend.value
