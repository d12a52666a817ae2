"""The schema of records: cells, outcomes, rounds and environments.

Infinite figures (the dilatation of a collapsed triangle) are null in JSON.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from enum import StrEnum
from functools import cached_property
from math import inf
from typing import Annotated, Any, Literal, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from cembench.core.names import file_name, printable
from cembench.core.notices import Notice
from cembench.results.intervals import DEFAULT_ROUNDS as DEFAULT_ROUNDS

#: Raised when the meaning of records changes; runs do not resume from other versions.
SCHEMA_VERSION = 1

#: The algorithm that others are compared with where neither a paper nor an option names one.
REFERENCE = "cem"
#: The algorithm that others of a target are compared with, unless a run says otherwise.
USUAL_REFERENCES = {
    "disk": REFERENCE,
    "free boundary": "lscm",
    "circular holes": "koebe-cem",
    "disk with holes": "harmonic-filled",
}

#: With this many cores busy with other work, a process counts as measured on a busy machine.
BUSY_CORES = 0.25

#: Whether a surface is a model of the paper, a stand-in for one, or neither.
MeshOrigin = Literal["model", "stand-in", "surface"]


def _escaped(value: object) -> object:
    """Return a text with unprintable characters escaped; other values unchanged."""
    return printable(value) if isinstance(value, str) else value


#: Text from outside, such as file names; unprintable characters are escaped.
Printable = Annotated[str, BeforeValidator(_escaped)]

#: "not_comparable": the map is valid, but its seconds cannot be used; see docs/cheating.md.
Status = Literal["ok", "failed", "timeout", "out_of_memory", "invalid", "skipped", "not_comparable"]

#: A count in a file; larger numbers are not counts and do not fit a float.
Count = Annotated[int, Field(ge=0, lt=2**63)]
Positive = Annotated[int, Field(ge=1, lt=2**63)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Seconds = Annotated[float, Field(ge=0, allow_inf_nan=False)]
#: Seconds of a timed call; zero is refused, because no ratio can be formed with it.
CallSeconds = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Whole = Annotated[int, Field(gt=-(2**63), lt=2**63)]
#: A figure; infinity is stored as null.
Figure = Annotated[
    Whole | Finite | None, BeforeValidator(lambda v: None if v in (inf, -inf) else v)
]
#: Part of a file name in the run's folder; it cannot lead outside.
NamePart = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$", max_length=128)]


#: E_C over area of a timed map may differ by this from that of the checked one: those of a
#: randomised solver do by less, those of one that stops earlier by more.
SAME_ENERGY = 1e-6

#: Why a cell that is measured until it is precise got no more rounds: it was precise, the time was
#: used up, or it had the maximum number of rounds.
Ended = Literal["precise", "budget", "rounds"]


class Cell(BaseModel):
    """A surface, an algorithm and its settings; cells with equal content are measured once."""

    model_config = ConfigDict(frozen=True)

    algorithm: Printable
    parameters: dict[str, Any] = Field(default_factory=dict)
    #: Hash of the source file that declares the algorithm and of the files a plug-in imports from
    #: its own folder (:mod:`cembench.running.sources`); an edited plug-in is a new cell.
    code_hash: str
    mesh: Printable
    mesh_hash: NamePart
    solves: str = "reuse"
    backend: str = "cvxopt"
    threads: Positive = 1
    #: Number of rounds, each in a fresh process (docs/measuring.md). 0: as `precision` requires.
    repeats: Count = DEFAULT_ROUNDS
    #: Largest half-width of the intervals, relative to the figure; None: the number of rounds is
    #: fixed.
    precision: Annotated[float, Field(gt=0, lt=1)] | None = None

    @model_validator(mode="after")
    def _check_rounds(self) -> Self:
        """Check that either the number of rounds or a precision is set."""
        if (self.repeats == 0) != (self.precision is not None):
            raise ValueError("a cell needs either a number of rounds or a precision")
        return self

    @model_serializer(mode="wrap")
    def _as_before(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out an unset precision, so that keys of older cells do not change."""
        content: dict[str, Any] = dump(self)
        if self.precision is None:
            content.pop("precision", None)
        return content

    def __copy__(self) -> Self:
        """Return a copy without the key, which an update would change."""
        copied = super().__copy__()
        copied.__dict__.pop("key", None)
        return copied

    @cached_property
    def key(self) -> str:
        """Hash of the content; the mesh's name is only a label and is left out."""
        content = self.model_dump(exclude={"mesh"}) | {"schema": SCHEMA_VERSION}
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    @property
    def label(self) -> str:
        """Unique, readable file name of the cell."""
        mesh, algorithm = file_name(self.mesh, 150), file_name(self.algorithm, 60)
        return f"{mesh}--{algorithm}--{self.key[:12]}"


class FaultKind(StrEnum):
    """Reasons why a cell did not end ok."""

    #: The call did not return a :class:`~cembench.core.parameterization.Parameterization`.
    NOT_A_PARAMETERIZATION = "not_a_parameterization"
    #: `uv` is not a complex128 array with one value for each vertex.
    WRONG_SHAPE = "wrong_shape"
    NOT_FINITE = "not_finite"
    #: Iterations, energies, extras or phases have the wrong type or size.
    WRONG_REPORT = "wrong_report"
    OFF_CIRCLE = "off_circle"
    #: The boundary does not wind around the circle exactly once.
    WINDING = "winding"
    BOUNDARY_ORDER = "boundary_order"
    BOUNDARIES_CROSS = "boundaries_cross"
    HOLE_ORIENTATION = "hole_orientation"
    #: A hole is no circle, or its circle meets another one or leaves the disk.
    HOLES_NOT_CIRCULAR = "holes_not_circular"
    REVERSED = "reversed"
    FOLDED = "folded"
    #: No metrics can be computed from the map.
    NO_METRICS = "no_metrics"
    MESH_CHANGED = "mesh_changed"
    #: A timed call returned a worse map than the one that was checked.
    OTHER_MAP = "other_map"
    OTHER_ENERGY = "other_energy"
    #: A timed call returned, or used, results kept from another call.
    KEPT_RESULT = "kept_result"
    #: The calls used more cores than the cell is allowed.
    MORE_CORES = "more_cores"
    #: The process kept working between the timed calls.
    WORKS_AHEAD = "works_ahead"
    #: The process reported impossible seconds.
    IMPOSSIBLE_TIMES = "impossible_times"
    GAVE_UP = "gave_up"
    RAISED = "raised"
    OUT_OF_MEMORY = "out_of_memory"
    TIMEOUT = "timeout"
    #: The process ended without an answer: a signal, or an exit code.
    PROCESS_ENDED = "process_ended"
    #: The answer of the process cannot be read.
    UNREADABLE_ANSWER = "unreadable_answer"
    #: The unit of the cell ended the workers of a cluster that measured it.
    WORKERS_LOST = "workers_lost"
    #: A dependency is not installed on this machine.
    NOT_THERE = "not_there"
    #: An external program ended with a nonzero exit code, or by a signal.
    PROGRAM_ENDED = "program_ended"
    #: An external program did not write the expected file.
    NO_OUTPUT = "no_output"
    OUTPUT_TOO_LARGE = "output_too_large"
    UNREADABLE_OUTPUT = "unreadable_output"
    #: The file's vertices or triangles differ from those of the given surface.
    OTHER_SURFACE = "other_surface"
    #: A vertex has several UVs, but the target needs one.
    CUT_SURFACE = "cut_surface"


class Fault(BaseModel):
    """A fault: its kind for programs, its detail for people."""

    model_config = ConfigDict(frozen=True)

    kind: FaultKind
    detail: str


class MeshFacts(BaseModel):
    """Facts of a surface for tables."""

    vertices: Count
    faces: Count
    boundary_vertices: Count
    non_delaunay_share: Annotated[float, Field(ge=0, le=1)]
    notices: tuple[Notice, ...] = ()
    #: The model of a paper that the surface is or stands in for, if any.
    paper_row: str = ""
    origin: MeshOrigin = "surface"
    #: Who published it, and the object that it shows; "" where unknown, and in older records.
    source: str = ""
    family: str = ""
    #: The algorithm whose printed energy and angle errors a stand-in was fitted to, if any.
    fitted: str = ""


class Neighbours(BaseModel):
    """Average load of the machine by other work while a process was measured."""

    #: Cores used by other programs, and cores taken by the host of a virtual machine.
    other_cores: Annotated[float, Field(ge=0, allow_inf_nan=False)]
    stolen_cores: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    #: Whether a core was throttled because of heat; None if the system does not report it.
    throttled: bool | None = None

    @property
    def busy(self) -> bool:
        """Whether the load is high enough to affect the seconds."""
        return self.other_cores + self.stolen_cores > BUSY_CORES or bool(self.throttled)


class Round(BaseModel):
    """The timed calls of one process; a round has one process per cell."""

    #: Id of the invocation; only rounds of the same sitting were measured side by side.
    sitting: str = ""
    started_at: str = ""
    #: Wall-clock seconds of each timed call after the warm-up, in order.
    calls: Annotated[tuple[CallSeconds, ...], Field(min_length=1)]
    #: Wall-clock seconds of the reference kernel, measured once per round with all its cells.
    kernel_seconds: CallSeconds | None = None
    neighbours: Neighbours | None = None
    #: Seconds by phase of the median call; they add up to the round's figure.
    phases: dict[str, Seconds] = Field(default_factory=dict)
    #: CPU seconds of the process and its children for the median call; None if the system does not
    #: report them.
    cpu_seconds: Seconds | None = None
    #: Wall-clock seconds of the warm-up call; None if the first call is timed.
    cold_seconds: CallSeconds | None = None
    #: Wall-clock seconds of each timed call in a process shared with the cells that this one is
    #: compared with; empty without one.
    together: tuple[CallSeconds, ...] = ()
    #: The motion of the surface for each call, untimed ones too, by which it can be made again
    #: (:mod:`cembench.running.rigid_motion`).
    motions: str = ""
    #: Whether a call agreed to rounding with another process's call on the same moved surface;
    #: None if nothing was compared.
    repeated: bool | None = None
    #: Whether two fresh processes mapped the same moved surface in ways that differ by more than a
    #: turn, a scale and a shift.
    differs: bool = False
    #: The median of E_C over the area of the timed maps; None if it was not compared.
    energy: Finite | None = None
    #: For an external program, whose `calls` are the wall clock of its process: its seconds on a
    #: small mesh (None if it failed there), and the solve time it printed in each call (empty if
    #: it prints none).
    start_seconds: CallSeconds | None = None
    own_seconds: tuple[Seconds, ...] = ()

    @property
    def seconds(self) -> float:
        """The round's figure: the median of its calls."""
        return lower_median(self.calls)

    @property
    def busy(self) -> bool:
        """Whether other work may have affected the seconds."""
        return self.neighbours is not None and self.neighbours.busy

    @property
    def together_seconds(self) -> float | None:
        """The median of the calls in the shared process; None without one."""
        return lower_median(self.together) if self.together else None

    @property
    def solve_seconds(self) -> float | None:
        """The solve time of an external program; for other algorithms, the figure itself.

        It is the time that the program printed, or else its wall clock less that on a small mesh
        (which still includes reading and writing the large mesh). None if the difference is not
        positive.
        """
        if self.own_seconds:
            return lower_median(self.own_seconds) or None
        return self.measured_seconds

    @property
    def measured_seconds(self) -> float | None:
        """The solve time of an external program by our clock alone: its wall clock less its start.

        For other algorithms, the figure itself; None if the difference is not positive.
        """
        left = self.seconds - (self.start_seconds or 0.0)
        return left if left > 0 else None


class Boundary(BaseModel):
    """The circle fitted to a boundary's image; null if the image determines none."""

    model_config = ConfigDict(frozen=True, ser_json_inf_nan="null")

    #: The smallest vertex index of the loop, and its number of vertices.
    vertex: int
    vertices: int
    #: Centre, real and imaginary part.
    centre: tuple[float, float]
    radius: float | None
    #: The largest distance from the circle, relative to its radius.
    circularity: float | None


class External(BaseModel):
    """Identity of external code in a record."""

    model_config = ConfigDict(frozen=True)

    #: The seconds of a program are the wall clock of a process, those of a library of a call; maps
    #: that were read from files have none.
    kind: Literal["program", "library", "maps"]
    #: The command with its placeholders in braces, the library's name, or the folder of the maps.
    name: Printable


class ProgramRun(BaseModel):
    """Facts of a call of an external program or library, besides its map."""

    #: None if unknown.
    version: Printable | None = None
    #: Bytes of the mesh file and of the file with the UVs; 0 for a library.
    input_bytes: Count = 0
    output_bytes: Count = 0


class LinearAlgebraWork(BaseModel):
    """Linear algebra in the checked call; see :class:`cembench.linear_algebra.work.Work`.

    Only what goes through cembench's linear algebra is counted.
    """

    model_config = ConfigDict(frozen=True)

    symbolic: Count
    numeric: Count
    #: Real columns solved; a forward or backward solve alone counts as half.
    right_hand_sides: Annotated[float, Field(ge=0, allow_inf_nan=False)]
    #: Order of the largest sparse matrix, and nonzeros of the largest factor; 0: unknown.
    order: Count = 0
    entries: Count = 0
    dense: Count = 0
    dense_order: Count = 0


class Outcome(BaseModel):
    """The result of measuring one cell."""

    model_config = ConfigDict(ser_json_inf_nan="null")

    status: Status
    #: Why the status is not "ok"; None otherwise.
    cause: str | None = None
    #: The same as data; empty if the status is "ok".
    faults: tuple[Fault, ...] = ()
    #: The algorithm raised AlgorithmFailed.
    gave_up: bool = False
    traceback: str | None = None
    #: The rounds in order; empty if no call was timed.
    rounds: tuple[Round, ...] = ()
    #: None for a fixed number of rounds.
    ended: Ended | None = None
    #: Figures computed by the harness (cembench.conformal.metrics); null if infinite.
    metrics: dict[str, Figure] = Field(default_factory=dict)
    #: For surfaces with holes: the fitted circles of the boundaries, the outer one first.
    boundaries: tuple[Boundary, ...] = ()
    iterations: Count | None = None
    energy_history: tuple[float, ...] = ()
    extras: dict[str, Any] = Field(default_factory=dict)
    uv_hash: str | None = None
    #: Peak resident memory up to the end of one call, including mesh and libraries.
    peak_memory_bytes: Count | None = None
    #: The same, less the resident memory before the call.
    memory_increase_bytes: Whole | None = None
    #: Notices for the user about the measurement.
    notes: tuple[Notice, ...] = ()
    #: For an external program or library.
    program: ProgramRun | None = None
    #: None for an external program.
    work: LinearAlgebraWork | None = None

    @property
    def relative_energy(self) -> float | None:
        """E_C over the image's area; None if one of them is unknown."""
        return relative_energy(self.metrics)

    @property
    def worse_when_timed(self) -> float:
        """How many times that of the checked map the E_C of the timed maps is, at least 1."""
        timed = [r.energy for r in self.rounds if r.energy is not None]
        checked = self.relative_energy
        if not timed or checked is None or lower_median(timed) <= checked + SAME_ENERGY:
            return 1.0
        return lower_median(timed) / max(checked, SAME_ENERGY)

    @property
    def folded_before_repair(self) -> int | None:
        """Folded triangles of the method's own map, before any repair; None if it counts none."""
        folded = self.extras.get("folded_before_repair")
        return folded if type(folded) is int else None

    @property
    def solve_seconds(self) -> float | None:
        """The median over the rounds of :attr:`Round.solve_seconds`; None if a round has none."""
        return _median_of_all([r.solve_seconds for r in self.rounds])

    @property
    def start_seconds(self) -> float | None:
        """The median over the rounds of an external program's seconds on a small mesh."""
        known = [r.start_seconds for r in self.rounds if r.start_seconds is not None]
        return lower_median(known) if known else None

    @property
    def own_seconds(self) -> float | None:
        """The median over the rounds of the solve time that an external program printed."""
        known = [lower_median(r.own_seconds) for r in self.rounds if r.own_seconds]
        return lower_median(known) if known else None

    @property
    def seconds(self) -> tuple[float, ...]:
        """The figure of each round, in order."""
        return tuple(r.seconds for r in self.rounds)

    @property
    def median_seconds(self) -> float | None:
        """The cell's figure: the median over its rounds."""
        return _median_of_all(self.seconds)

    @property
    def cpu_seconds(self) -> float | None:
        """The median over the rounds of the CPU seconds; None if a round has none."""
        return _median_of_all([r.cpu_seconds for r in self.rounds])

    @property
    def phases(self) -> dict[str, float]:
        """Seconds by phase; they add up to :attr:`median_seconds`."""
        figure = self.median_seconds
        return next((r.phases for r in self.rounds if r.seconds == figure), {})


def relative_energy(figures: Mapping[str, Any]) -> float | None:
    """Return E_C over the image's area, by the names of metrics; None if one of them is unknown."""
    energy, area = (figures.get(name) for name in ("conformal_energy", "image_area"))
    return None if energy is None or not area else energy / area


def not_ok(status: Status, *faults: Fault, **more: Any) -> Outcome:
    """Return the outcome of a cell with these faults; their details become the cause."""
    cause = "; ".join(fault.detail for fault in faults)
    return Outcome(status=status, cause=cause, faults=faults, **more)


def lower_median(values: Sequence[float]) -> float:
    """Return the middle value, or the lower of two: a measured one, so its phases are known."""
    return sorted(values)[(len(values) - 1) // 2]


def _median_of_all(values: Sequence[float | None]) -> float | None:
    """Return the middle value; None if one is missing, or all."""
    known = [value for value in values if value is not None]
    return lower_median(known) if known and len(known) == len(values) else None


class Record(BaseModel):
    """A cell, its surface, its outcome and where it was measured: one JSON file."""

    model_config = ConfigDict(ser_json_inf_nan="null")

    schema_version: int = SCHEMA_VERSION
    cell: Cell
    title: str
    target: str
    mesh: MeshFacts
    outcome: Outcome
    environment: NamePart
    started_at: str
    #: SHA-256 of the files behind `cell.code_hash`, by their paths relative to the folder or
    #: package of the file that declares the algorithm.
    sources: dict[str, str] = Field(default_factory=dict)
    #: The external code, if the algorithm is not cembench's or a plug-in's.
    external: External | None = None

    @property
    def is_program(self) -> bool:
        """Whether the seconds are the wall clock of an external program's process."""
        return self.external is not None and self.external.kind == "program"

    @property
    def is_given(self) -> bool:
        """Whether its map was read from a file, so that it has no seconds."""
        return self.external is not None and self.external.kind == "maps"


class Environment(BaseModel):
    """The facts of a machine that reports use; all are optional, and files may hold others."""

    model_config = ConfigDict(extra="allow")

    #: What the machine is called.
    machine: Printable | None = None
    cpu: str | None = None
    cores: Count | None = None
    memory_bytes: Count | None = None
    libraries: dict[str, str | None] = Field(default_factory=dict)
    git: dict[str, Any] | None = None


def signed(record: Record) -> bytes:
    """Return a record as JSON, with the digest of its content."""
    content = json.loads(record.model_dump_json())
    text = json.dumps(content | {"digest": digest(content)}, indent=2, ensure_ascii=False)
    return text.encode()


def altered(content: Mapping[str, Any]) -> str:
    """Return what shows that a record's JSON is not as it was written; "" if nothing does."""
    if "digest" not in content:
        return "has no digest, which each record is written with"
    as_written = content["digest"] == digest(content)
    return "" if as_written else "was changed after it was written: its digest differs"


def digest(content: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a record's content without its "digest".

    It is computed from the JSON, not the model, so that a later schema with more fields does not
    change it.
    """
    rest = {name: value for name, value in content.items() if name != "digest"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()
