"""Map the surfaces of files one by one, and write each as soon as it is mapped."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.core.notices import Notice
from cembench.registry import Algorithm, Registry
from cembench.results.records import Record
from cembench.running.local import map_once
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, Task, paper_role_of, plan_cells
from cembench.running.surfaces import SurfaceFile
from cembench.workflows.map_extras import Extras, write_extras
from cembench.workflows.map_files import (
    FileOptions,
    write_atlas,
    write_corner_map,
    write_map,
    write_shells,
)
from cembench.workflows.map_places import draw_map, draw_shells
from cembench.workflows.shells import Shells

Complex = NDArray[np.complex128]
#: Shows a text during some work.
Busy = Callable[[str], AbstractContextManager[object]]


@dataclass(frozen=True)
class Job:
    """A surface and the measurement that maps it."""

    surface: SurfaceFile
    task: Task


@dataclass(frozen=True)
class FileJobs:
    """The surfaces of one file and their outputs.

    Parameters
    ----------
    shells : Shells
        The surfaces.
    jobs : tuple of Job
        One job per surface.
    output : Path, optional
        File for the surfaces with their maps.
    picture : Path, optional
        File for a picture of them.

    """

    shells: Shells
    jobs: tuple[Job, ...]
    output: Path | None = None
    picture: Path | None = None


@dataclass(frozen=True)
class Mapped:
    """A mapped surface, and the files written."""

    surface: SurfaceFile
    record: Record
    uv: Complex | None
    #: Kinds of outputs written, with their files.
    written: Mapping[str, str]
    #: Notices about the written files.
    told: tuple[tuple[Path, Notice], ...] = ()

    @property
    def ok(self) -> bool:
        """Whether the map is valid."""
        return self.record.outcome.status == "ok"


def jobs_of(
    shells: Shells,
    registry: Registry,
    candidates: Sequence[Algorithm],
    parameters: Mapping[str, str],
    how: MeasurementSettings,
    plugins: Sequence[str],
) -> tuple[Job, ...]:
    """Return a job for each surface, with the first algorithm that takes it."""
    found = []
    for surface in shells.parts:
        mesh = surface.mesh
        taken = next(a for a in candidates if isinstance(mesh, a.mesh_type))
        standing = {mesh.name: paper_role_of(registry, mesh)}
        tasks = plan_cells([taken], [mesh], dict(parameters), how, list(plugins), standing)
        found.append(Job(surface, tasks[0]))
    return tuple(found)


def map_surfaces(
    files: Sequence[FileJobs],
    options: Options,
    file_options: FileOptions,
    extras: Extras,
    busy: Busy,
    *,
    keep_invalid: bool = False,
) -> Iterator[Mapped]:
    """Map the surfaces one by one, write their outputs, and yield each when it is done.

    A file of several surfaces and its picture are written after the last one, unless a map is
    missing; see :func:`incomplete`.

    Raises
    ------
    MeshError, ParameterError, RenderError
        A file cannot be written.

    """
    for file in files:
        maps: list[Complex] = []
        for k, job in enumerate(file.jobs):
            found = _mapped(
                file, job, options, file_options, extras, busy, keep_invalid=keep_invalid
            )
            if found.uv is not None and (found.ok or keep_invalid):
                maps.append(found.uv)
            is_last = k == len(file.jobs) - 1
            if k and is_last and len(maps) == len(file.jobs):
                told = _write_shells(file, maps, file_options, busy)
                found = Mapped(found.surface, found.record, found.uv, found.written, told)
            yield found


def incomplete(
    files: Sequence[FileJobs], found: Sequence[Mapped], *, keep_invalid: bool = False
) -> list[Path]:
    """Return the files that were not written because a map is missing."""
    missing, start = [], 0
    for file in files:
        own = found[start : start + len(file.jobs)]
        start += len(file.jobs)
        lacks = any(m.uv is None or not (m.ok or keep_invalid) for m in own)
        if len(own) > 1 and file.output is not None and lacks:
            missing.append(file.output)
    return missing


def write_together(
    output: Path, found: Sequence[Mapped], file_options: FileOptions
) -> tuple[Notice, ...]:
    """Write all surfaces to one file; all must have a map."""
    maps = [mapped.uv for mapped in found if mapped.uv is not None]
    return write_atlas(output, [mapped.surface for mapped in found], maps, file_options)


def _mapped(
    file: FileJobs,
    job: Job,
    options: Options,
    file_options: FileOptions,
    extras: Extras,
    busy: Busy,
    *,
    keep_invalid: bool,
) -> Mapped:
    mesh, title = job.surface.mesh, job.task.algorithm.title
    with busy(f"{title} on {mesh.name}, {mesh.m:,} triangles"):
        record, uv = map_once(job.task, options)
    if uv is None or not (record.outcome.status == "ok" or keep_invalid):
        return Mapped(job.surface, record, uv, {})
    is_atlas = job.task.algorithm.target == "atlas"
    written: dict[str, str] = {}
    told: list[tuple[Path, Notice]] = []
    alone = len(file.jobs) == 1
    if file.output is not None:
        written["output"] = str(file.output)
        if alone:
            write: Any = write_corner_map if is_atlas else write_map
            notices = write(file.output, job.surface, uv, file_options)
            told += [(file.output, notice) for notice in notices]
    if extras.files:
        with busy("writing"):
            notices = write_extras(extras, mesh, uv, record)
        told += [(extras.remeshed or job.surface.path, notice) for notice in notices]
        written |= {what: str(path) for what, path in extras.named.items()}
    if file.picture is not None and not is_atlas:
        written["preview"] = str(file.picture)
        if alone:
            with busy("drawing"):
                draw_map(mesh, uv, file.picture, record)
    return Mapped(job.surface, record, uv, written, tuple(told))


def _write_shells(
    file: FileJobs, maps: Sequence[Complex], file_options: FileOptions, busy: Busy
) -> tuple[tuple[Path, Notice], ...]:
    told: tuple[Notice, ...] = ()
    if file.output is not None:
        told = write_shells(file.output, file.shells, maps, file_options)
    if file.picture is not None:
        with busy("drawing"):
            draw_shells(file.shells, maps, file.picture)
    return tuple((file.output or file.shells.path, notice) for notice in told)
