"""Map the surfaces of files one by one, and write each as soon as it is mapped."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from cembench.api.parameterize import Result
from cembench.api.save_map import world_scale
from cembench.conformal.atlas import laid_out
from cembench.core.arrays import Complex
from cembench.core.errors import AlgorithmFailed, ParameterError
from cembench.core.notices import Notice
from cembench.core.reporter import SILENT, Reporter
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.results.records import Record
from cembench.running.in_this_process import map_here, may_run_here, overlay_here
from cembench.running.options import Options
from cembench.running.plan import Task
from cembench.running.surfaces import SurfaceFile

from .components import Shells
from .writing import FileOptions, draw_maps, write_extras, write_shells, write_together

#: Notices, each with the file it is about.
Notices = tuple[tuple[Path, Notice], ...]


@dataclass(frozen=True)
class FileJobs:
    """The surfaces of one file and their outputs.

    Parameters
    ----------
    shells : Shells
        The surfaces.
    tasks : tuple of Task
        The measurement that maps each.
    output : Path, optional
        File for the surfaces with their maps.
    picture : Path, optional
        File for a picture of them.
    """

    shells: Shells
    tasks: tuple[Task, ...]
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
    notices: Notices = ()
    #: What the bounds of the surface's modulus say of the map, if that was asked for.
    certificate: str = ""
    #: What the refined mesh is that the map is on, if that was asked for.
    overlay: str = ""
    #: The factor from the map to the surface's own units, where these are written.
    uv_scale: float | None = None

    @property
    def ok(self) -> bool:
        """Whether the map is valid."""
        return self.record.outcome.status == "ok"


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
    output: Path | None = None
    reporter: Reporter = SILENT
    keep_invalid: bool = False
    certificate: bool = False
    #: Whether each map is on the algorithm's refinement of the surface, which is then written.
    overlay: bool = False
    #: Whether each surface is mapped in a process of its own, which keeps the limits.
    own_process: bool = True
    done: list[Mapped] = field(default_factory=list)
    missing: list[Path] = field(default_factory=list)

    def __len__(self) -> int:
        return sum(len(file.tasks) for file in self.files)

    def __iter__(self) -> Iterator[Mapped]:
        for file in self.files:
            own: list[Mapped] = []
            for surface, task in zip(file.shells.parts, file.tasks, strict=True):
                mapped = self._mapped(file, surface, task)
                own.append(mapped)
                if len(own) == len(file.tasks):
                    mapped = replace(mapped, notices=(*mapped.notices, *self._write(file, own)))
                self.done.append(mapped)
                yield mapped
        if self.output is not None and (maps := self._maps(self.done, self.output)):
            surfaces = [mapped.surface for mapped in self.done]
            for notice in write_together(self.output, surfaces, maps, self.file_options):
                self.reporter.note(f"{self.output}: {notice}")

    def writes(self, mapped: Mapped) -> bool:
        """Whether a map is written."""
        return mapped.uv is not None and (mapped.ok or self.keep_invalid)

    def _maps(self, mapped: Sequence[Mapped], output: Path | None) -> list[Complex]:
        """Return the maps that are written to one file; none if one is missing."""
        if all(map(self.writes, mapped)):
            return [one.uv for one in mapped if one.uv is not None]
        if output is not None and len(mapped) > 1:
            self.missing.append(output)
        return []

    def _write(self, file: FileJobs, own: Sequence[Mapped]) -> Notices:
        notices: tuple[Notice, ...] = ()
        maps, options, record = self._maps(own, file.output), self.file_options, own[0].record
        surfaces = [mapped.surface for mapped in own]
        if maps and file.output is not None and self.overlay:
            notices = write_together(file.output, surfaces, maps, options)
        elif maps and file.output is not None:
            is_atlas = record.target == "atlas"
            notices = write_shells(file.output, file.shells, maps, options, atlas=is_atlas)
        if maps and file.picture is not None:
            with self.reporter.busy("drawing"):
                draw_maps(surfaces, maps, file.picture, record, options)
        return tuple((file.output or file.shells.path, notice) for notice in notices)

    def _mapped(self, file: FileJobs, surface: SurfaceFile, task: Task) -> Mapped:
        mesh, algorithm, words = surface.mesh, task.algorithm, ""
        with self.reporter.busy(f"{algorithm.title} on {mesh.name}, {mesh.m:,} triangles"):
            if self.overlay:
                record, mesh, uv = overlay_here(task)
                surface, words = replace(surface, mesh=mesh), _overlay(mesh, surface.mesh)
            elif self.own_process or not may_run_here(task):
                from cembench.running.local import map_once

                record, uv = map_once(task, self.options)
            else:
                record, uv = map_here(task)
        mapped = Mapped(surface, record, uv, {}, overlay=words)
        if uv is None:
            return mapped
        result = Result(mesh, algorithm, uv, record.outcome)
        if self.certificate:
            mapped = replace(mapped, certificate=_certificate(result))
        if not self.writes(mapped):
            return mapped
        noticed: Notices = ()
        extras = self.file_options.extras
        files = {"output": file.output, **extras, "preview": file.picture}
        if extras:
            with self.reporter.busy("writing"):
                if record.target == "atlas":
                    mesh, uv = laid_out(mesh, uv)
                    result = Result(mesh, algorithm, uv, record.outcome)
                notices = write_extras(self.file_options, result)
            noticed = tuple((extras.get("remeshed", surface.path), one) for one in notices)
        written = {kind: str(path) for kind, path in files.items() if path is not None}
        scale = None
        if record.target != "atlas" and (self.file_options.place == "world" or "flat" in extras):
            scale = world_scale(uv, mesh, mesh.F)
        return replace(mapped, written=written, notices=noticed, uv_scale=scale)


def _overlay(fine: TriangleMesh, coarse: TriangleMesh) -> str:
    """Return what a refined mesh is."""
    return (
        f"{fine.m:,} triangles, the {coarse.m:,} of {coarse.name} cut along the edges of the "
        "flipped triangulation; the map and the files written are of this refined mesh"
    )


def _certificate(result: Result) -> str:
    """Return what the bounds of the surface's modulus say of a map."""
    try:
        proof = result.certificate()
        return proof.words(result.z[proof.corners])
    except ParameterError:
        return "only for maps to the disk, with circular holes or without"
    except AlgorithmFailed as error:
        return f"none: {error}"
