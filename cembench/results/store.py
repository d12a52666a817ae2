"""A run on disk: one JSON record per cell, its map, and the machine it was measured on.

::

    RUN/records/<mesh>--<algorithm>--<key>.json
    RUN/maps/<mesh>--<algorithm>--<key>.npz       uv, complex128 (n,)
    RUN/meshes/<hash>.npz                         V, F and name of each surface
    RUN/environments/<id>.json
    RUN/plan.json                                 the cells of the last request
    RUN/samples/<mesh>--<algorithm>--<key>/       the journal of an unfinished cell:
        <id>.jsonl  <id>.npz                      one line per finished process, and the map
    RUN/machines.json                             progress of a run on a cluster
    RUN/signature                                 its measurer's, if it was signed
    RUN/others/<machine>/                         records of other machines in a merged run
    RUN/lock                                      held while a run is writing
    RUN/cembench.json                             marker of the folder
    RUN/scratch-<token>/                          files exchanged between processes

Names of meshes and algorithms are shortened and cleaned for use in file names. Every file except
the journals is written to a draft, flushed to disk and renamed, so it is complete or absent. When
a cell is complete, its record is written before its samples are deleted, so each finished process
is kept exactly once, whenever a run is killed.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock, Timeout
from numpy.typing import NDArray

from cembench.core.atomic import (
    flush_folder,
    read_model,
    unwritable,
    write,
    write_bytes,
    write_text,
)
from cembench.core.errors import RecordError
from cembench.core.folders import is_empty_file
from cembench.core.loading import (
    REMEDY,
    advised,
    damaged,
    files_in,
    is_there,
    read_arrays,
    read_bytes,
    read_json,
)
from cembench.core.names import file_name
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.results import run_folder
from cembench.results.records import SCHEMA_VERSION, Cell, Environment, Record, altered, signed
from cembench.results.samples import Samples, read_map


class Store:
    """The records in one folder, which is made when the first is saved."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def find(self, cell: Cell) -> Record | None:
        """Return the record of this cell under any name of its mesh; None if there is none.

        Raises
        ------
        RecordError
            The record is damaged or was changed; a run must not resume from it.
        """
        path = self._found(self.record_file(cell), cell)
        if path is None:
            return None
        record = read_record(path)
        if how := altered(json.loads(read_bytes(path, self.folder))):
            raise RecordError(f"{path} {how}. {REMEDY}")
        return record

    def rename(self, record: Record, cell: Cell, *, keep: bool) -> Record:
        """Save the record under the mesh's current name; with `keep`, under the old one too.

        `cell` has the record's key; only the name differs.
        """
        renamed = record.model_copy(update={"cell": cell})
        environment = self.environments().get(record.environment, {"id": record.environment})
        self.save(renamed, self.uv(record.cell), environment)
        if not keep:
            for path_of in (self.record_file, self.map_file):
                before, now = path_of(record.cell), path_of(cell)
                # On a case-insensitive file system both names may be the same file.
                if before.exists() and not (now.exists() and now.samefile(before)):
                    before.unlink()
        return renamed

    def records(self) -> list[Record]:
        """Return all records, sorted by file name.

        Raises
        ------
        RecordError
            The folder holds no run, or a record is damaged or of another schema.
        """
        self.check_is_run()
        return self.finished()

    def check_is_run(self) -> None:
        """Raise :class:`RecordError` if the folder holds no run."""
        self.check_is_there()
        if not is_there(self.folder / "records"):
            raise RecordError(
                f"{self.folder} holds no run: there is no folder {self.folder / 'records'}. "
                "Make one with `cembench run`."
            )

    def check_is_there(self) -> None:
        """Raise :class:`RecordError` if there is no such folder."""
        if not self.folder.is_dir():
            raise RecordError(
                f"{self.folder} holds no run: there is no such folder. Make one with "
                "`cembench run`, or `cembench reproduce`."
            )

    def finished(self) -> list[Record]:
        """Like :meth:`records`, but empty if no cell is finished yet."""
        return [read_record(path) for path in self.record_files()]

    def record_files(self) -> list[Path]:
        """Return the files of all records, sorted by name."""
        return files_in(self.folder / "records", "*.json", self.folder)

    def save(
        self, record: Record, uv: NDArray[np.complex128] | None, environment: dict[str, Any]
    ) -> None:
        """Write the environment, the map and then the record, so a record always has its map."""
        run_folder.claim(self.folder)
        about = self.folder / "environments" / f"{file_name(record.environment)}.json"
        if not about.exists():
            write_text(about, json.dumps(environment, indent=2))
        if uv is not None:
            write(self.map_file(record.cell), lambda file: np.savez_compressed(file, uv=uv))
        else:
            self.map_file(record.cell).unlink(missing_ok=True)
        path = self.record_file(record.cell)
        text = signed(record)
        write(path, lambda file: file.write(text))
        for folder in (self.map_file(record.cell).parent, path.parent):
            if folder.exists():
                flush_folder(folder)
        self.forget_samples(record.cell)

    def uv(self, cell: Cell) -> NDArray[np.complex128] | None:
        """Return the recorded map, complex128 (n,); None if there is none."""
        path = self._found(self.map_file(cell), cell)
        return None if path is None else read_map(path, self.folder)

    def save_mesh(self, mesh: TriangleMesh) -> None:
        """Save a surface once, so that metrics can be recomputed from its maps."""
        path = self._mesh_path(mesh.hash)
        if not path.exists():
            name = np.array(mesh.name)
            write(path, lambda file: np.savez(file, V=mesh.V, F=mesh.F, name=name))

    def mesh(self, cell: Cell) -> TriangleMesh | None:
        """Return the surface of a cell; None if it was not saved.

        Raises
        ------
        RecordError
            The file is damaged, or holds a different surface.
        """
        path = self.mesh_file(cell)
        if not is_there(path):
            return None
        data = read_arrays(path, ("V", "F", "name"), self.folder)
        V, F = data["V"], data["F"]
        if V.dtype != np.float64 or F.dtype.kind not in "iu" or V.shape[1:] + F.shape[1:] != (3, 3):
            why = f"V is {V.dtype} {V.shape}, F {F.dtype} {F.shape}; both have three columns"
            raise damaged(path, "a surface", why)
        if not np.isfinite(V).all() or not len(F) or F.min() < 0 or F.max() >= len(V):
            raise damaged(path, "a surface", "a coordinate or a corner is out of range")
        mesh = TriangleMesh.trusted(V, F.astype(np.int64), str(data["name"]))
        if mesh.hash != cell.mesh_hash:
            raise RecordError(
                f"{path} does not hold the surface named in its file name; delete it."
            )
        return mesh

    def samples(self, cell: Cell, environment: str) -> Samples:
        """Return the journal of an unfinished cell in this environment."""
        journal = f"{file_name(environment)}.jsonl"
        return Samples(self.folder / "samples" / cell.label / journal)

    def rounds_done(self, cell: Cell) -> int | None:
        """Return the number of saved rounds of an unfinished cell; None if it was not begun."""
        journals = files_in(self.folder / "samples" / cell.label, "*.jsonl", self.folder)
        return max((len(Samples(journal).rounds()) for journal in journals), default=None)

    def forget(self, cell: Cell) -> None:
        """Delete a cell's record and map, if they are here."""
        for path in (self.record_file(cell), self.map_file(cell)):
            path.unlink(missing_ok=True)

    def forget_samples(self, cell: Cell) -> None:
        """Delete the journals of an unfinished cell."""
        shutil.rmtree(self.folder / "samples" / cell.label, ignore_errors=True)

    def save_plan(self, cells: Sequence[Cell]) -> None:
        """Save which cells were requested, in order."""
        text = run_folder.CELLS.dump_json(list(cells), indent=1)
        write_bytes(self.folder / run_folder.PLAN, text)

    def plan(self) -> list[Cell]:
        """Return the cells of the last request; empty if no plan was saved."""
        path = self.folder / run_folder.PLAN
        if not is_there(path):
            return []
        return read_json(path, run_folder.CELLS, "a plan", self.folder)

    def environments(self) -> dict[str, dict[str, Any]]:
        """Return the facts of the machines, by id."""
        paths = files_in(self.folder / "environments", "*.json", self.folder)
        return {
            path.stem: read_model(path, Environment, self.folder).model_dump(exclude_unset=True)
            for path in paths
        }

    @contextmanager
    def locked(self, waiting: Callable[[], None] = lambda: None) -> Iterator[Path]:
        """Hold the lock of this folder; yields a folder for temporary files.

        Two runs at the same time would slow each other and spoil both timings. So the second
        waits, after calling `waiting`, and then finds the work of the first. The system frees the
        lock of a killed run; its half-written files are removed here.

        Raises
        ------
        RecordError
            The folder is neither a run nor empty (nothing is changed in it), or it cannot be
            written to.
        """
        run_folder.check(self.folder)
        lock = self._lock()
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            try:
                lock.acquire(timeout=0)
            except Timeout:
                waiting()
                lock.acquire()
        except OSError as error:
            raise unwritable(lock_path(self.folder), error) from error
        try:
            try:
                scratch = run_folder.empty_scratch(self.folder)
            except OSError as error:
                raise unwritable(self.folder, error) from error
            try:
                yield scratch
            finally:
                shutil.rmtree(scratch, ignore_errors=True)
        finally:
            lock.release()

    def is_locked(self) -> bool | None:
        """Whether a run is writing to this folder now; None if it is read-only."""
        if not is_empty_file(lock_path(self.folder)):
            return False  # opening it for writing would empty it
        try:
            with self._lock().acquire(timeout=0):
                return False
        except Timeout:
            return True
        except OSError:
            return None

    def _lock(self) -> FileLock:
        return FileLock(lock_path(self.folder))

    def _found(self, path: Path, cell: Cell) -> Path | None:
        """Return a cell's file by its name, or by its key if the mesh was renamed; else None."""
        if is_there(path):
            return path
        pattern = f"*--{cell.key[:12]}{path.suffix}"
        return min(files_in(path.parent, pattern, self.folder), default=None)

    def record_file(self, cell: Cell) -> Path:
        """Return the path of a cell's record, if it was saved."""
        return self.folder / "records" / f"{cell.label}.json"

    def map_file(self, cell: Cell) -> Path:
        """Return the path of a cell's map, if it was saved."""
        return self.folder / "maps" / f"{cell.label}.npz"

    def mesh_file(self, cell: Cell) -> Path:
        """Return the path of a cell's surface, if it was saved."""
        return self._mesh_path(cell.mesh_hash)

    def _mesh_path(self, mesh_hash: str) -> Path:
        return self.folder / "meshes" / f"{file_name(mesh_hash[:32])}.npz"


def lock_path(folder: Path) -> Path:
    """Return the file that a run locks while it is writing."""
    return folder / run_folder.LOCK


def read_record(path: Path) -> Record:
    """Return the record in ``RUN/records/NAME``; raise :class:`RecordError` if it is not valid."""
    record = read_model(path, Record, path.parents[1])
    if record.schema_version != SCHEMA_VERSION:
        version = f"is of schema version {record.schema_version}"
        reads = f"this cembench reads {SCHEMA_VERSION}."
        raise advised(path, f"{version}; {reads}", "Run again into another folder.")
    return record
