"""The progress of a run on a cluster, stored in its folder for `cembench status`."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, Field, TypeAdapter

from cembench.core.atomic import write_model
from cembench.core.loading import is_there, read_json
from cembench.results.records import Count, Printable
from cembench.results.run_folder import MACHINES

Seconds = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class MachineState(BaseModel):
    """A worker, the number of units it measured, and its current activity."""

    machine: Printable
    units: Count = 0
    lost: bool = False
    #: The surface that it measures, and the last process that it reported.
    at: Printable = ""


class ClusterState(BaseModel):
    """The progress; a unit is a surface under one policy."""

    units: Count
    done: Count = 0
    machines: list[MachineState] = []
    #: None before the first unit is done.
    seconds_left: Seconds | None = None
    written_at: str = ""


def save_state(folder: Path, state: ClusterState) -> None:
    """Save the progress of a run."""
    state.written_at = datetime.now(UTC).isoformat(timespec="seconds")
    write_model(folder / MACHINES, state)


def read_state(folder: Path) -> ClusterState | None:
    """Return the last saved progress of a run; None for a run without a cluster."""
    path = folder / MACHINES
    if not is_there(path):
        return None
    return read_json(path, TypeAdapter(ClusterState), "a state", folder)
