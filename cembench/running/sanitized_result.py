"""Convert what an algorithm returned or raised to plain data of bounded size.

An algorithm may return anything. These functions return newly made arrays, numbers and texts, or a
fault that says what is wrong. Whatever the returned object does, short of ending the process or not
returning, becomes a fault.
"""

from __future__ import annotations

import hashlib
import json
import math
import operator
import traceback
from dataclasses import dataclass
from itertools import islice
from numbers import Real
from typing import Any

import numpy as np
from pydantic_core import to_json

from cembench.core.arrays import Complex
from cembench.core.clock import Timing
from cembench.core.errors import (
    AlgorithmFailed,
    CembenchError,
    NotThere,
    describe_error,
    message_of,
    shortened,
)
from cembench.core.parameterization import Atlas, Parameterization
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.results.records import Fault, FaultKind, Outcome, Status, not_ok
from cembench.running.external.exchange import ProgramFault
from cembench.running.map_promises import broken_premises

#: Maximum length of a stored traceback, in characters.
LONGEST_TRACEBACK = 20_000
#: Maximum numbers of iterations, energies and phases, and maximum bytes of extras as JSON.
MAX_ITERATIONS = 2**53
MAX_ENERGIES = 100_000
MAX_PHASES = 100
MAX_EXTRAS_BYTES = 1_000_000
#: What a result's class must leave to `object`: how attributes are looked up.
_OF_OBJECT = ("__getattribute__", "__getattr__")


@dataclass(frozen=True)
class Returned:
    """What a call returned: a plain copy of its map, or the fault in it, and the object itself."""

    uv: Complex | Fault
    #: Never read after a timed call; a checked call's iterations, energies and extras are in it.
    result: Any

    @classmethod
    def of(cls, result: Any, mesh: TriangleMesh, target: str = "disk") -> Returned:
        """Copy the map that a call on this mesh returned."""
        return cls(_copied(result, mesh, target), result)


def _copied(result: Any, mesh: TriangleMesh, target: str) -> Complex | Fault:
    """Return the values of a map as a new plain array, or a fault: wrong type or shape.

    This is done while the clock runs, and the map is read once: whatever an object computes when it
    is looked at takes part of the call's time, and later changes have no effect. The map of an
    atlas has an entry for each corner, (3 m,).
    """
    required, shape = (Atlas, (mesh.m, 3)) if target == "atlas" else (Parameterization, (mesh.n,))
    if not issubclass(type(result), required):
        article = "an" if required is Atlas else "a"
        message = f"it returned a {_type_of(result)}, not {article} {required.__name__}"
        return Fault(kind=FaultKind.NOT_A_PARAMETERIZATION, detail=message)
    own = [name for name in _OF_OBJECT if any(name in vars(c) for c in type(result).__mro__[:-1])]
    if own:
        message = (
            f"its class {_type_of(result)} defines {own[0]}; return a plain {required.__name__}"
        )
        return Fault(kind=FaultKind.NOT_A_PARAMETERIZATION, detail=message)
    try:
        uv = result.corners if required is Atlas else result.uv
    except BaseException as error:
        return Fault(
            kind=FaultKind.RAISED, detail=f"its uv cannot be read: {describe_error(error)}"
        )
    # What `__class__` says is not asked; without its type, an array has no methods of its own.
    plain = np.asarray(uv) if issubclass(type(uv), np.ndarray) else None
    if plain is None or plain.shape != shape or plain.dtype != np.complex128:
        got = _type_of(uv) if plain is None else f"{plain.dtype} {plain.shape}"
        message = f"uv is {got}; required is complex128 {shape}"
        return Fault(kind=FaultKind.WRONG_SHAPE, detail=shortened(message))
    return np.array(plain, dtype=np.complex128, order="C").ravel()


def finite(uv: Complex | Fault, target: str = "disk") -> Complex | Fault:
    """Return a copied map, or the fault that it is not finite."""
    if isinstance(uv, Fault):
        return uv
    bad = np.flatnonzero(~np.isfinite(uv))
    if not len(bad):
        return uv
    places = "corners" if target == "atlas" else "vertices"
    message = f"uv is NaN or infinite at {len(bad)} {places}, the first being {bad[0]}"
    return Fault(kind=FaultKind.NOT_FINITE, detail=message)


def hash_of(uv: Complex) -> str:
    """Return the SHA-256 of a map's bytes."""
    return hashlib.sha256(uv.tobytes()).hexdigest()


def report_of(result: Parameterization | Atlas) -> tuple[dict[str, Any], list[Fault]]:
    """Return iterations, energies and extras by the names of :class:`Outcome`, and the faults.

    Faulty values are left out.
    """
    report: dict[str, Any] = {}
    wrong = []
    of_map = (("iterations", _iterations), ("energy_history", _energies))
    for name, read in (*(() if isinstance(result, Atlas) else of_map), ("extras", _extras)):
        try:
            report[name] = read(getattr(result, name))
        except BaseException as error:
            message = str(error) if isinstance(error, _WrongReportError) else describe_error(error)
            wrong.append(Fault(kind=FaultKind.WRONG_REPORT, detail=f"{name} {message}"))
    return report, wrong


def phases_fault(timing: Timing) -> Fault | None:
    """Return the fault in the seconds and phases of a call, or None."""
    names, seconds = list(timing.phases), [timing.total, *timing.phases.values()]
    message = ""
    if len(names) > MAX_PHASES:
        message = f"it reports {len(names)} phases; allowed are at most {MAX_PHASES}"
    elif not all(
        isinstance(name, str) and len(name) <= 100 and shortened(name) == name for name in names
    ):
        message = "a phase's name is not a text of at most 100 characters"
    elif not all(math.isfinite(s) and s >= 0 for s in seconds):
        message = "the seconds of a phase are negative or not finite"
    return Fault(kind=FaultKind.WRONG_REPORT, detail=message) if message else None


def outcome_of_error(error: BaseException, mesh: TriangleMesh) -> Outcome:
    """Return the outcome of a call on this mesh that raised this error."""
    if isinstance(error, NotThere):
        return not_ok("skipped", Fault(kind=FaultKind.NOT_THERE, detail=message_of(error)))
    if isinstance(error, ProgramFault):
        fault = Fault(kind=error.kind, detail=shortened(message_of(error)))
        more = {"gave_up": error.gave_up, "traceback": error.said or None}
        return not_ok(error.status, fault, **more)
    if isinstance(error, AlgorithmFailed):
        said = shortened("; ".join([message_of(error), *broken_premises(mesh)]))
        return not_ok("failed", Fault(kind=FaultKind.GAVE_UP, detail=said), gave_up=True)
    if isinstance(error, CembenchError):
        said = shortened(message_of(error))
        return not_ok("failed", Fault(kind=FaultKind.RAISED, detail=said))
    status: Status = "failed"
    fault = Fault(kind=FaultKind.RAISED, detail=describe_error(error))
    if isinstance(error, MemoryError):
        status = "out_of_memory"
        said = shortened(message_of(error) or "not enough memory")
        fault = Fault(kind=FaultKind.OUT_OF_MEMORY, detail=said)
    return not_ok(status, fault, traceback=_traceback_of(error))


class _WrongReportError(Exception):
    """An error about a value; its message follows the name of the value."""


def _iterations(value: Any) -> int:
    try:
        count = operator.index(value)
    except TypeError:
        raise _WrongReportError(f"is {_shown(value)}; required is an integer") from None
    if not 0 <= count <= MAX_ITERATIONS:
        raise _WrongReportError(f"is {_shown(value)}; allowed is 0 to 2^53")
    return count


def _energies(values: Any) -> tuple[float, ...]:
    energies = list(islice(values, MAX_ENERGIES + 1))
    if len(energies) > MAX_ENERGIES:
        raise _WrongReportError(f"holds more than {MAX_ENERGIES:,} energies")
    for k, energy in enumerate(energies):
        if not isinstance(energy, Real) or not math.isfinite(energy):
            raise _WrongReportError(
                f"holds {_shown(energy)} at position {k}; required are finite numbers"
            )
    return tuple(map(float, energies))


def _extras(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise _WrongReportError(f"is a {_type_of(value)}; required is a dict")
    if not all(isinstance(name, str) for name in value):
        raise _WrongReportError("has names that are not strings")
    try:
        text = to_json(value, inf_nan_mode="null")
    except Exception as error:
        raise _WrongReportError(f"cannot be written as JSON: {describe_error(error)}") from None
    if len(text) > MAX_EXTRAS_BYTES:
        raise _WrongReportError(f"takes {len(text):,} bytes; allowed are {MAX_EXTRAS_BYTES:,}")
    return json.loads(text)


def _type_of(value: Any) -> str:
    return shortened(str(type(value).__name__), 100)


def _shown(value: Any) -> str:
    """Return a value of a plain type as text, and any other by its type."""
    return shortened(repr(value), 100) if type(value) in (float, str) else f"a {_type_of(value)}"


def _traceback_of(error: BaseException) -> str:
    try:
        text = "".join(traceback.format_exception(error))
    except BaseException as another:
        text = f"{describe_error(error)} (no traceback: {_type_of(another)})"
    return shortened(text, LONGEST_TRACEBACK)
