"""The schema of everything that is written down: what was measured, and what came out.

Infinite figures (the dilatation of a collapsed triangle) are null in JSON.
"""

from __future__ import annotations

import hashlib
import json
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

#: Changes when a record's meaning does; a record of another version is not resumed from.
SCHEMA_VERSION = 1

Status = Literal["ok", "failed", "timeout", "out_of_memory", "invalid", "skipped"]


class Cell(BaseModel):
    """One thing to measure; cells with equal content have equal keys and are measured once."""

    model_config = ConfigDict(frozen=True)

    algorithm: str
    parameters: dict[str, Any] = Field(default_factory=dict)
    #: SHA-256 of the source file that declares the algorithm: an edited plug-in is a new cell.
    code_hash: str
    mesh: str
    mesh_hash: str
    solves: str = "reuse"
    backend: str = "cvxopt"
    threads: int = 1
    repeats: int = 3

    @property
    def key(self) -> str:
        """Hash of the content; the mesh's name is only a label and does not count."""
        content = self.model_dump(exclude={"mesh"}) | {"schema": SCHEMA_VERSION}
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    @property
    def label(self) -> str:
        """A file name that a person can read and that no other cell has."""
        return f"{self.mesh}--{self.algorithm}--{self.key[:12]}"


class MeshFacts(BaseModel):
    """What a table says of a surface beside its name."""

    vertices: int
    faces: int
    boundary_vertices: int
    non_delaunay_share: float
    notices: tuple[str, ...] = ()


class Outcome(BaseModel):
    """What one cell's process has to tell, or what is told of it when it cannot."""

    model_config = ConfigDict(ser_json_inf_nan="null")

    status: Status
    #: Why the status is not "ok"; None otherwise.
    cause: str | None = None
    traceback: str | None = None
    #: Wall-clock seconds of each timed call, in order.
    seconds: tuple[float, ...] = ()
    #: Seconds by phase of the call with the median total; they add up to it.
    phases: dict[str, float] = Field(default_factory=dict)
    #: Figures computed by the harness (cembench.metrics); null where infinite.
    metrics: dict[str, float | int | None] = Field(default_factory=dict)
    iterations: int | None = None
    energy_history: tuple[float, ...] = ()
    extras: dict[str, Any] = Field(default_factory=dict)
    #: Largest resident set of the cell's process, mesh and libraries included.
    peak_memory_bytes: int | None = None

    @property
    def median_seconds(self) -> float | None:
        """The middle one of the timed calls: the lower of two."""
        return sorted(self.seconds)[(len(self.seconds) - 1) // 2] if self.seconds else None


class Record(BaseModel):
    """A cell, its surface, its outcome and where it was measured: one JSON file."""

    model_config = ConfigDict(ser_json_inf_nan="null")

    schema_version: int = SCHEMA_VERSION
    cell: Cell
    title: str
    target: str
    mesh: MeshFacts
    outcome: Outcome
    environment: str
    started_at: str
