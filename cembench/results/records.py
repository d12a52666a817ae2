"""The schema of everything that is written down: what was measured, and what came out.

Infinite figures (the dilatation of a collapsed triangle) are null in JSON.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from enum import StrEnum
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
from cembench.core.notices import Notice, notice_of_old

#: Changes when a record's meaning does; a record of another version is not resumed from.
SCHEMA_VERSION = 1

#: The fewest rounds whose smallest and largest figure enclose the median in 95 % of all cases: the
#: chance that all lie on one side of it is 2 / 2^6.
DEFAULT_ROUNDS = 6

#: With so many cores at work beside it, a process counts as measured on a busy machine.
BUSY_CORES = 0.25

#: Is a surface a model of the paper, a stand-in for one, or neither?
MeshOrigin = Literal["model", "stand-in", "surface"]


def _escaped(value: object) -> object:
    """Return words with escapes for what cannot be printed; what is not words as it is."""
    return printable(value) if isinstance(value, str) else value


#: Words that somebody else has chosen, as names of files; what cannot be printed is escaped.
Printable = Annotated[str, BeforeValidator(_escaped)]

#: A notice; plain texts, as records hold that are older than its kinds, become notices.
KeptNotice = Annotated[
    Notice, BeforeValidator(lambda v: notice_of_old(v) if isinstance(v, str) else v)
]

#: "not_comparable": the map is valid, and the seconds are no figure: see docs/cheating.md.
Status = Literal["ok", "failed", "timeout", "out_of_memory", "invalid", "skipped", "not_comparable"]

#: A number that a file may hold: larger ones are no counts, and no float holds them.
Count = Annotated[int, Field(ge=0, lt=2**63)]
Positive = Annotated[int, Field(ge=1, lt=2**63)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Seconds = Annotated[float, Field(ge=0, allow_inf_nan=False)]
#: A timed call: no clock shows that it took no time, and no ratio can be formed with one that did.
CallSeconds = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Whole = Annotated[int, Field(gt=-(2**63), lt=2**63)]
#: Infinity is null.
Figure = Annotated[
    Whole | Finite | None, BeforeValidator(lambda v: None if v in (inf, -inf) else v)
]
#: Part of the name of a file in the run's folder: never a way out of it.
NamePart = Annotated[str, Field(pattern=r"^[A-Za-z0-9_][A-Za-z0-9_.-]*$", max_length=128)]


class Cell(BaseModel):
    """One thing to measure; cells with equal content have equal keys and are measured once."""

    model_config = ConfigDict(frozen=True)

    algorithm: Printable
    parameters: dict[str, Any] = Field(default_factory=dict)
    #: Of the source file that declares the algorithm, and of what a plug-in imports from beside it
    #: (see :mod:`cembench.running.sources`): an edited plug-in is a new cell.
    code_hash: str
    mesh: Printable
    mesh_hash: NamePart
    solves: str = "reuse"
    backend: str = "cvxopt"
    threads: Positive = 1
    #: Rounds, each a fresh process; see docs/measuring.md. 0: as many as `precision` takes.
    repeats: Count = DEFAULT_ROUNDS
    #: How far the intervals may reach to either side of a figure, relative to it; None: the number
    #: of rounds is fixed.
    precision: Annotated[float, Field(gt=0, lt=1)] | None = None

    @model_validator(mode="after")
    def _check_rounds(self) -> Self:
        """Rounds are either fixed or until precise."""
        if (self.repeats == 0) != (self.precision is not None):
            raise ValueError("a cell has a number of rounds, or a precision")
        return self

    @model_serializer(mode="wrap")
    def _as_before(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Write a cell without a precision, and so its key, as before there were precisions."""
        content: dict[str, Any] = dump(self)
        if self.precision is None:
            content.pop("precision", None)
        return content

    @property
    def key(self) -> str:
        """Hash of the content; the mesh's name is only a label and does not count."""
        content = self.model_dump(exclude={"mesh"}) | {"schema": SCHEMA_VERSION}
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    @property
    def label(self) -> str:
        """A file name that a person can read and that no other cell has."""
        mesh, algorithm = file_name(self.mesh, 150), file_name(self.algorithm, 60)
        return f"{mesh}--{algorithm}--{self.key[:12]}"


class FaultKind(StrEnum):
    """What kept a cell from ending ok."""

    #: The call did not return a :class:`~cembench.core.parameterization.Parameterization`.
    NOT_A_PARAMETERIZATION = "not_a_parameterization"
    #: `uv` is not a complex128 array with one value for each vertex.
    WRONG_SHAPE = "wrong_shape"
    NOT_FINITE = "not_finite"
    #: Iterations, energies, extras or phases of the wrong type or size.
    WRONG_REPORT = "wrong_report"
    OFF_CIRCLE = "off_circle"
    #: The boundary goes round the circle another number of times than once.
    WINDING = "winding"
    BOUNDARY_ORDER = "boundary_order"
    BOUNDARIES_CROSS = "boundaries_cross"
    HOLE_ORIENTATION = "hole_orientation"
    REVERSED = "reversed"
    FOLDED = "folded"
    #: No metrics can be computed from the map.
    NO_METRICS = "no_metrics"
    MESH_CHANGED = "mesh_changed"
    #: A timed call returned a map that is not as good as the one that was checked.
    OTHER_MAP = "other_map"
    OTHER_ENERGY = "other_energy"
    #: A timed call returned what was kept from another call, or depends on what was.
    KEPT_RESULT = "kept_result"
    #: The calls used more cores than the cell is allowed.
    MORE_CORES = "more_cores"
    #: Something went on working between the timed calls.
    WORKS_AHEAD = "works_ahead"
    #: The seconds that the process told cannot be.
    IMPOSSIBLE_TIMES = "impossible_times"
    GAVE_UP = "gave_up"
    RAISED = "raised"
    OUT_OF_MEMORY = "out_of_memory"
    TIMEOUT = "timeout"
    #: The process ended without an answer: a signal, or an exit code.
    PROCESS_ENDED = "process_ended"
    #: The process left an answer that cannot be read.
    UNREADABLE_ANSWER = "unreadable_answer"
    #: Its unit ended the workers of a cluster that measured it.
    WORKERS_LOST = "workers_lost"
    #: What it needs is not on this machine.
    NOT_THERE = "not_there"
    #: An external program ended with a code other than 0, or by a signal.
    PROGRAM_ENDED = "program_ended"
    #: It left no file of the name that was agreed upon.
    NO_OUTPUT = "no_output"
    OUTPUT_TOO_LARGE = "output_too_large"
    UNREADABLE_OUTPUT = "unreadable_output"
    #: The file holds other vertices or triangles than the surface that was given.
    OTHER_SURFACE = "other_surface"
    #: A vertex has several UVs where the target needs one.
    CUT_SURFACE = "cut_surface"


class Fault(BaseModel):
    """A fault: its kind for programs, its detail for people."""

    model_config = ConfigDict(frozen=True)

    kind: FaultKind
    detail: str


class MeshFacts(BaseModel):
    """What a table says of a surface beside its name."""

    vertices: Count
    faces: Count
    boundary_vertices: Count
    non_delaunay_share: Annotated[float, Field(ge=0, le=1)]
    notices: tuple[KeptNotice, ...] = ()
    #: The model of the paper's Table 1 that it is ("model") or stands for ("stand-in"), if any.
    paper_row: str = ""
    origin: MeshOrigin = "surface"


class Neighbours(BaseModel):
    """What else the machine did while a process was measured, on the average of that time."""

    #: Cores that other programs kept at work, and cores that the host of a virtual machine took.
    other_cores: Annotated[float, Field(ge=0, allow_inf_nan=False)]
    stolen_cores: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    #: Whether a core was slowed down because it was hot; None where the system does not tell.
    throttled: bool | None = None

    @property
    def busy(self) -> bool:
        """Whether that is enough to be seen in the seconds."""
        return self.other_cores + self.stolen_cores > BUSY_CORES or bool(self.throttled)


class Round(BaseModel):
    """The timed calls of one process: a round has one such process for every cell."""

    #: Which invocation measured it; only rounds of one sitting were measured side by side.
    sitting: str = ""
    started_at: str = ""
    #: Wall-clock seconds of each timed call after the warm-up, in order.
    calls: Annotated[tuple[CallSeconds, ...], Field(min_length=1)]
    #: Wall-clock seconds of the reference kernel, measured once a round beside all of its cells.
    kernel_seconds: CallSeconds | None = None
    #: None in records older than this field.
    neighbours: Neighbours | None = None
    #: Seconds by phase of the call that is the round's figure; they add up to it.
    phases: dict[str, Seconds] = Field(default_factory=dict)
    #: CPU seconds of the process and of all it started, of the call whose seconds are the figure;
    #: None where the system does not tell, and in records older than this field.
    cpu_seconds: Seconds | None = None
    #: Wall-clock seconds of the process's first call, which warms up; None where that is timed.
    cold_seconds: CallSeconds | None = None
    #: What the motions of the surface are made from, one for each call
    #: (:mod:`cembench.running.motion`); empty in records older than this field.
    motions: str = ""
    #: Whether a call gave the same map as another process's call on the same moved surface, to
    #: rounding; None where nothing was compared.
    repeated: bool | None = None
    #: Of older records: SHA-256 of the last call's map, and of each timed call whether its map has
    #: the same bits as the checked one.
    uv_hash: str | None = None
    same_bits: tuple[bool, ...] = ()
    #: Of an external program, whose `calls` are the wall clock of its process: that of the same
    #: program on a small mesh, None where it failed on that; and the solve time that it printed in
    #: each call, empty where it prints none.
    start_seconds: CallSeconds | None = None
    own_seconds: tuple[Seconds, ...] = ()

    @property
    def seconds(self) -> float:
        """The round's figure: the median of its calls."""
        return lower_median(self.calls)

    @property
    def solve_seconds(self) -> float | None:
        """The figure without what an external program's process costs besides; else the figure.

        That is what the program printed; or else the wall clock less that of a small mesh, which
        still holds the reading and writing of the large one. None where the difference is none.
        """
        if self.own_seconds:
            return lower_median(self.own_seconds) or None
        left = self.seconds - (self.start_seconds or 0.0)
        return left if left > 0 else None


class Boundary(BaseModel):
    """The circle fitted to a boundary's image; null where the image determines none."""

    model_config = ConfigDict(frozen=True, ser_json_inf_nan="null")

    #: The smallest vertex of the loop, and how many it has.
    vertex: int
    vertices: int
    #: Centre, real and imaginary part.
    centre: tuple[float, float]
    radius: float | None
    #: The largest distance from the circle, relative to its radius.
    circularity: float | None


class External(BaseModel):
    """Code that is not cembench's, as a record names it."""

    model_config = ConfigDict(frozen=True)

    #: A program's seconds are the wall clock of a process, a library's are those of a call.
    kind: Literal["program", "library"]
    #: The command with its places in braces, or the library's name.
    name: Printable


class ProgramRun(BaseModel):
    """What a call of an external program, or of a library, was besides its map."""

    #: None where it is not known.
    version: Printable | None = None
    #: Bytes of the mesh file and of the file with the UVs; 0 for a library.
    input_bytes: Count = 0
    output_bytes: Count = 0


class LinearAlgebraWork(BaseModel):
    """What the checked call asked of linear algebra: :class:`cembench.linear_algebra.work.Work`.

    Only what goes through cembench's linear algebra is counted.
    """

    model_config = ConfigDict(frozen=True)

    symbolic: Count
    numeric: Count
    #: Real columns; half a solve counts half.
    right_hand_sides: Annotated[float, Field(ge=0, allow_inf_nan=False)]
    #: Of the largest sparse matrix and of the largest factor; 0: not known.
    order: Count = 0
    entries: Count = 0
    dense: Count = 0
    dense_order: Count = 0


class Outcome(BaseModel):
    """What one cell's processes have to tell, or what is told of one that cannot."""

    model_config = ConfigDict(ser_json_inf_nan="null")

    status: Status
    #: Why the status is not "ok"; None otherwise.
    cause: str | None = None
    #: The same as data; empty where the status is "ok", and in records older than this field.
    faults: tuple[Fault, ...] = ()
    #: The algorithm itself said that it found no map (AlgorithmFailed).
    gave_up: bool = False
    traceback: str | None = None
    #: In order; empty where no call was timed.
    rounds: tuple[Round, ...] = ()
    #: Figures computed by the harness (cembench.conformal.metrics); null where infinite.
    metrics: dict[str, Figure] = Field(default_factory=dict)
    #: Of a surface with holes: the circles of its boundaries, the outer one first.
    boundaries: tuple[Boundary, ...] = ()
    iterations: Count | None = None
    energy_history: tuple[float, ...] = ()
    extras: dict[str, Any] = Field(default_factory=dict)
    uv_hash: str | None = None
    #: Largest resident set up to the end of one call, mesh and libraries included.
    peak_memory_bytes: Count | None = None
    #: The same, less the resident set before the call.
    memory_increase_bytes: Whole | None = None
    #: What the user should know of the measurement.
    notes: tuple[KeptNotice, ...] = ()
    #: Of an external program or a library.
    program: ProgramRun | None = None
    #: None for an external program, and in records older than this field.
    work: LinearAlgebraWork | None = None

    @property
    def relative_energy(self) -> float | None:
        """E_C over the image's area; None where one of them is not known."""
        energy, area = (self.metrics.get(name) for name in ("conformal_energy", "image_area"))
        return None if energy is None or not area else energy / area

    @property
    def solve_seconds(self) -> float | None:
        """The median over the rounds of :attr:`Round.solve_seconds`; None where one has none."""
        found = [r.solve_seconds for r in self.rounds]
        known = [seconds for seconds in found if seconds is not None]
        return lower_median(known) if known and len(known) == len(found) else None

    @property
    def start_seconds(self) -> float | None:
        """The median over the rounds of an external program's wall clock on a small mesh."""
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
        return lower_median(self.seconds) if self.rounds else None

    @property
    def cpu_seconds(self) -> float | None:
        """The median over the rounds of the CPU seconds; None where one has none."""
        known = [r.cpu_seconds for r in self.rounds if r.cpu_seconds is not None]
        return lower_median(known) if known and len(known) == len(self.rounds) else None

    @property
    def phases(self) -> dict[str, float]:
        """Seconds by phase; they add up to :attr:`median_seconds`."""
        figure = self.median_seconds
        return next((r.phases for r in self.rounds if r.seconds == figure), {})


def not_ok(status: Status, *faults: Fault, **more: Any) -> Outcome:
    """Return the outcome of a cell with these faults; the cause is made of their details."""
    cause = "; ".join(fault.detail for fault in faults)
    return Outcome(status=status, cause=cause, faults=faults, **more)


def lower_median(values: Sequence[float]) -> float:
    """The middle value, the lower of two: one that was measured, so that its phases are known."""
    return sorted(values)[(len(values) - 1) // 2]


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
    #: SHA-256 of the files that `cell.code_hash` is made of, by their paths relative to the folder
    #: or package of the file that declares the algorithm; empty in records older than this field.
    sources: dict[str, str] = Field(default_factory=dict)
    #: Whose code it is, where it is not cembench's or a plug-in's; None in older records.
    external: External | None = None

    @property
    def is_program(self) -> bool:
        """Whether the seconds are the wall clock of an external program's process."""
        return self.external is not None and self.external.kind == "program"


class Environment(BaseModel):
    """What a report uses of the facts about a machine; there may be others, and none need be."""

    model_config = ConfigDict(extra="allow")

    #: What the machine is called; None in records older than this field.
    machine: Printable | None = None
    cpu: str | None = None
    cores: Count | None = None
    memory_bytes: Count | None = None
    libraries: dict[str, str | None] = Field(default_factory=dict)
    git: dict[str, Any] | None = None


def signed(record: Record) -> bytes:
    """Return a record as JSON that also holds the digest of the rest of itself."""
    content = json.loads(record.model_dump_json())
    text = json.dumps(content | {"digest": digest(content)}, indent=2, ensure_ascii=False)
    return text.encode()


def is_as_written(content: Mapping[str, Any]) -> bool | None:
    """Whether a record's JSON still has its digest; None for one that never had any."""
    return content["digest"] == digest(content) if "digest" in content else None


def digest(content: Mapping[str, Any]) -> str:
    """Return the SHA-256 of a record's content, a "digest" in it left out.

    It is taken of the JSON, not of the model: a later schema with more fields finds it unchanged.
    """
    rest = {name: value for name, value in content.items() if name != "digest"}
    return hashlib.sha256(json.dumps(rest, sort_keys=True).encode()).hexdigest()
