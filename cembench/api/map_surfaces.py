"""Map the surfaces of files one by one, and write each as soon as it is mapped."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.api.components import Shells, read_shells
from cembench.api.map_outputs import (
    Extras,
    draw_map,
    draw_shells,
    picture_files,
    write_extras,
)
from cembench.api.write_maps import (
    FileOptions,
    write_atlas,
    write_corner_map,
    write_map,
    write_shells,
)
from cembench.core.errors import AlgorithmFailed
from cembench.core.notices import Notice
from cembench.core.reporter import SILENT, Reporter
from cembench.mesh import datasets
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm, Registry
from cembench.results.records import Record
from cembench.running.here import map_here, may_run_here
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, Task, paper_role_of, plan_cells
from cembench.running.surfaces import SurfaceFile

Complex = NDArray[np.complex128]
#: Notices, each with the file it is about.
Told = tuple[tuple[Path, Notice], ...]


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
    told: Told = ()
    #: What the bounds of the surface's modulus say of the map, if that was asked for.
    certificate: str = ""

    @property
    def ok(self) -> bool:
        """Whether the map is valid."""
        return self.record.outcome.status == "ok"


def local_files(
    meshes: Sequence[Path], registry: Registry, reporter: Reporter = SILENT
) -> list[Path]:
    """Return the file of each path or name of a public surface, which is fetched if necessary."""
    known = [path for path in meshes if not path.exists() and str(path) in registry.datasets]
    fetched = {}
    for path in known:
        dataset = registry.dataset(str(path))
        with reporter.downloads([dataset]) as progress:
            datasets.fetch(dataset, progress=progress(dataset))
        fetched[path] = datasets.surface_file(dataset)
    return [fetched.get(path, path) for path in meshes]


def jobs_of(
    source: Path,
    registry: Registry,
    candidates: Sequence[Algorithm],
    parameters: Mapping[str, Any],
    settings: MeasurementSettings,
    plugins: Sequence[str],
    *,
    repair: bool,
    cut: bool,
) -> tuple[Shells, tuple[Job, ...]]:
    """Return the surfaces of a file, and a job for each with the first algorithm that takes it."""
    shells = read_shells(source, candidates, mend=repair, cut=cut)
    jobs = []
    for surface in shells.parts:
        mesh = surface.mesh
        taken = next(a for a in candidates if isinstance(mesh, a.mesh_type))
        role = {mesh.name: paper_role_of(registry, mesh)}
        (task,) = plan_cells([taken], [mesh], parameters, settings, plugins, role)
        jobs.append(Job(surface, task))
    return shells, tuple(jobs)


def with_pictures(files: Sequence[FileJobs], *, overwrite: bool) -> list[FileJobs]:
    """Return the files with a path for a picture of each, beside its output.

    Raises
    ------
    ParameterError
        Two pictures would have the same path.
    RenderError
        A file that is not one of our pictures would be overwritten.

    """
    sources = [file.shells.path for file in files]
    chosen = [file.jobs[0].task.algorithm for file in files]
    pictures = picture_files(sources, chosen, [file.output for file in files])
    if not overwrite:
        from cembench.drawing.replaceable_pictures import check_replaceable

        for picture in pictures:
            check_replaceable(picture)
    return [replace(file, picture=p) for file, p in zip(files, pictures, strict=True)]


@dataclass
class Maps:
    """The maps of files, each made and written when it is asked for.

    A file of several surfaces and its picture are written after the last one, unless a map is
    missing; so is `output`, if all files go to one.

    Attributes
    ----------
    done : list of Mapped
        The surfaces mapped so far.
    missing : list of Path
        Files that were not written because a map is missing.

    """

    files: Sequence[FileJobs]
    options: Options
    file_options: FileOptions
    extras: Extras
    output: Path | None = None
    reporter: Reporter = SILENT
    keep_invalid: bool = False
    certificate: bool = False
    #: Whether each surface is mapped in a process of its own, which keeps the limits.
    apart: bool = True
    done: list[Mapped] = field(default_factory=list)
    missing: list[Path] = field(default_factory=list)

    def __len__(self) -> int:
        return sum(len(file.jobs) for file in self.files)

    def __iter__(self) -> Iterator[Mapped]:
        for file in self.files:
            own: list[Mapped] = []
            for job in file.jobs:
                mapped = self._mapped(file, job)
                own.append(mapped)
                if len(own) == len(file.jobs) > 1:
                    mapped = replace(mapped, told=self._write_shells(file, own))
                self.done.append(mapped)
                yield mapped
        if self.output is not None:
            self._write_together(self.output)

    def writes(self, mapped: Mapped) -> bool:
        """Whether a map is written."""
        return mapped.uv is not None and (mapped.ok or self.keep_invalid)

    def _maps(self, mapped: Sequence[Mapped], output: Path | None) -> list[Complex]:
        """Return the maps that are written to one file; none if one is missing."""
        if all(map(self.writes, mapped)):
            return [one.uv for one in mapped if one.uv is not None]
        if output is not None:
            self.missing.append(output)
        return []

    def _write_together(self, output: Path) -> None:
        if maps := self._maps(self.done, output):
            surfaces = [mapped.surface for mapped in self.done]
            for notice in write_atlas(output, surfaces, maps, self.file_options):
                self.reporter.note(f"{output}: {notice}")

    def _write_shells(self, file: FileJobs, own: Sequence[Mapped]) -> Told:
        told: tuple[Notice, ...] = ()
        maps = self._maps(own, file.output)
        if maps and file.output is not None:
            told = write_shells(file.output, file.shells, maps, self.file_options)
        if maps and file.picture is not None:
            with self.reporter.busy("drawing"):
                draw_shells(file.shells, maps, file.picture, equal=self.file_options.equal)
        return tuple((file.output or file.shells.path, notice) for notice in told)

    def _mapped(self, file: FileJobs, job: Job) -> Mapped:
        mesh, algorithm = job.surface.mesh, job.task.algorithm
        with self.reporter.busy(f"{algorithm.title} on {mesh.name}, {mesh.m:,} triangles"):
            if self.apart or not may_run_here(job.task):
                from cembench.running.local import map_once

                record, uv = map_once(job.task, self.options)
            else:
                record, uv = map_here(job.task)
        proof = _certificate(mesh, uv, record) if self.certificate and uv is not None else ""
        mapped = Mapped(job.surface, record, uv, {}, certificate=proof)
        if uv is None or not self.writes(mapped):
            return mapped
        is_atlas = algorithm.target == "atlas"
        written: dict[str, str] = {}
        told: list[tuple[Path, Notice]] = []
        alone = len(file.jobs) == 1
        if file.output is not None:
            written["output"] = str(file.output)
            if alone:
                write: Any = write_corner_map if is_atlas else write_map
                notices = write(file.output, job.surface, uv, self.file_options)
                told += [(file.output, notice) for notice in notices]
        if self.extras.files:
            with self.reporter.busy("writing"):
                notices = write_extras(self.extras, mesh, uv, record)
            told += [(self.extras.remeshed or job.surface.path, notice) for notice in notices]
            written |= {what: str(path) for what, path in self.extras.named.items()}
        if file.picture is not None and not is_atlas:
            written["preview"] = str(file.picture)
            if alone:
                with self.reporter.busy("drawing"):
                    draw_map(mesh, uv, file.picture, record)
        return replace(mapped, written=written, told=tuple(told))


def _certificate(mesh: TriangleMesh, uv: Complex, record: Record) -> str:
    """Return what the bounds of the surface's modulus say of a map."""
    from cembench.conformal.certificate import certificate_of

    try:
        found = certificate_of(mesh, uv, record.target)
    except AlgorithmFailed as error:
        return f"none: {error}"
    return "only for maps to the disk" if found is None else found.words(uv[found.corners])
