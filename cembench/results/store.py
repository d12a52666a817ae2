"""A run on disk: one JSON record a cell, its map beside it, and the machine it was measured on.

::

    RUN/records/<mesh>--<algorithm>--<key>.json
    RUN/maps/<mesh>--<algorithm>--<key>.npz       uv, complex128 (n,)
    RUN/meshes/<hash>.npz                         V, F and name: what the maps are maps of
    RUN/environments/<id>.json
    RUN/plan.json                                 the cells that were last asked for
    RUN/samples/<mesh>--<algorithm>--<key>/       what is known of a cell that is not finished:
        <id>.jsonl  <id>.npz                      a line for each process that has ended, the map
    RUN/machines.json                             how far a run on a cluster is
    RUN/others/<machine>/                         of a merged run: what other machines measured
    RUN/lock                                      held by the run that measures
    RUN/cembench.json                             says that the folder is a run
    RUN/scratch-<token>/                          what passes between processes, while it measures

The names of meshes and algorithms are cut and cleaned where no file can have them. Every file but
the journals is written to a draft, flushed to disk and renamed: it is whole or not there.
A cell's samples become its record when the last is there; the record is written before they are
deleted, so that whatever moment a run is killed at, each finished process is known exactly once.
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
from cembench.core.loading import damaged, files_in, is_there, read_arrays, read_bytes, read_json
from cembench.core.names import file_name
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.results import run_folder
from cembench.results.records import (
    SCHEMA_VERSION,
    Cell,
    Environment,
    Record,
    is_as_written,
    signed,
)
from cembench.results.samples import Samples, read_map


class Store:
    """The records under one folder, which is made when the first is saved."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def find(self, cell: Cell) -> Record | None:
        """Return what was recorded of this cell, if anything, under whatever name its mesh had.

        Raises
        ------
        RecordError
            The record is damaged, or was changed since: a run would go on from it, and sign it.

        """
        path = self._found(self._record_path(cell), cell)
        if path is None:
            return None
        record = read_record(path)
        if is_as_written(json.loads(read_bytes(path))) is False:
            raise RecordError(
                f"{path} was changed after it was written: its digest differs. Delete it and run "
                "again."
            )
        return record

    def rename(self, record: Record, cell: Cell, *, keep: bool) -> Record:
        """Record the same under the name that the cell's mesh has now; with `keep` also as it was.

        `cell` has the record's key: nothing but the name differs.
        """
        renamed = record.model_copy(update={"cell": cell})
        environment = self.environments().get(record.environment, {"id": record.environment})
        self.save(renamed, self.uv(record.cell), environment)
        if not keep:
            for path_of in (self._record_path, self._map_path):
                before, now = path_of(record.cell), path_of(cell)
                # Where capital letters do not count, both names may be of one file.
                if before.exists() and not (now.exists() and now.samefile(before)):
                    before.unlink()
        return renamed

    def records(self) -> list[Record]:
        """All records, by name of their files.

        Raises
        ------
        RecordError
            The folder holds no run, or a record is damaged or of another schema.

        """
        self.check_is_run()
        return self.finished()

    def check_is_run(self) -> None:
        """Raise :class:`RecordError` where the folder holds no run."""
        self.check_is_there()
        if not is_there(self.folder / "records"):
            raise RecordError(
                f"{self.folder} holds no run: there is no folder {self.folder / 'records'}. "
                "Make one with `cembench run`."
            )

    def check_is_there(self) -> None:
        """Raise :class:`RecordError` where there is no such folder."""
        if not self.folder.is_dir():
            raise RecordError(
                f"{self.folder} holds no run: there is no such folder. Make one with "
                "`cembench run`, or `cembench reproduce`."
            )

    def finished(self) -> list[Record]:
        """As :meth:`records`, but none where no cell is finished yet."""
        return [read_record(path) for path in self.record_files()]

    def record_files(self) -> list[Path]:
        """Return the files of all records, by name."""
        return files_in(self.folder / "records", "*.json")

    def save(
        self, record: Record, uv: NDArray[np.complex128] | None, environment: dict[str, Any]
    ) -> None:
        """Write the environment, the map and last the record, so that a record finds its map."""
        about = self.folder / "environments" / f"{file_name(record.environment)}.json"
        if not about.exists():
            write_text(about, json.dumps(environment, indent=2))
        if uv is not None:
            write(self._map_path(record.cell), lambda file: np.savez_compressed(file, uv=uv))
        else:
            self._map_path(record.cell).unlink(missing_ok=True)
        path = self._record_path(record.cell)
        text = signed(record)
        write(path, lambda file: file.write(text))
        for folder in (self._map_path(record.cell).parent, path.parent):
            if folder.exists():
                flush_folder(folder)
        self.forget_samples(record.cell)

    def uv(self, cell: Cell) -> NDArray[np.complex128] | None:
        """The recorded map (n,), or None where there is none."""
        path = self._found(self._map_path(cell), cell)
        return None if path is None else read_map(path)

    def save_mesh(self, mesh: TriangleMesh) -> None:
        """Keep a surface, once: with its map, every metric can be computed again."""
        path = self._mesh_path(mesh.hash)
        if not path.exists():
            name = np.array(mesh.name)
            write(path, lambda file: np.savez(file, V=mesh.V, F=mesh.F, name=name))

    def mesh(self, cell: Cell) -> TriangleMesh | None:
        """The surface that a cell was measured on, or None where it was not kept.

        Raises
        ------
        RecordError
            The file is damaged, or holds another surface.

        """
        path = self.mesh_file(cell)
        if not is_there(path):
            return None
        data = read_arrays(path, ("V", "F", "name"))
        V, F = data["V"], data["F"]
        if V.dtype != np.float64 or F.dtype.kind not in "iu" or V.shape[1:] + F.shape[1:] != (3, 3):
            why = f"V is {V.dtype} {V.shape}, F {F.dtype} {F.shape}; both have three columns"
            raise damaged(path, "a surface", why)
        if not np.isfinite(V).all() or not len(F) or F.min() < 0 or F.max() >= len(V):
            raise damaged(path, "a surface", "a coordinate or a corner is out of range")
        mesh = TriangleMesh.trusted(V, F.astype(np.int64), str(data["name"]))
        if mesh.hash != cell.mesh_hash:
            raise RecordError(f"{path} holds another surface than its name says; delete it.")
        return mesh

    def samples(self, cell: Cell, environment: str) -> Samples:
        """What was measured so far of a cell in this environment, and goes on to be."""
        journal = f"{file_name(environment)}.jsonl"
        return Samples(self.folder / "samples" / cell.label / journal)

    def rounds_done(self, cell: Cell) -> int | None:
        """How many rounds of an unfinished cell are kept? None where it was not begun."""
        journals = files_in(self.folder / "samples" / cell.label, "*.jsonl")
        return max((len(Samples(journal).rounds()) for journal in journals), default=None)

    def forget(self, cell: Cell) -> None:
        """Delete a cell's record and map, if they are here."""
        for path in (self._record_path(cell), self._map_path(cell)):
            path.unlink(missing_ok=True)

    def forget_samples(self, cell: Cell) -> None:
        """Delete what is kept of an unfinished cell."""
        shutil.rmtree(self.folder / "samples" / cell.label, ignore_errors=True)

    def save_plan(self, cells: Sequence[Cell]) -> None:
        """Keep which cells were asked for, in order."""
        text = run_folder.CELLS.dump_json(list(cells), indent=1)
        write_bytes(self.folder / run_folder.PLAN, text)

    def plan(self) -> list[Cell]:
        """The cells that were last asked for; none where no plan was kept."""
        path = self.folder / run_folder.PLAN
        return read_json(path, run_folder.CELLS, "a plan") if is_there(path) else []

    def environments(self) -> dict[str, dict[str, Any]]:
        """What is known of the machines, by id."""
        paths = files_in(self.folder / "environments", "*.json")
        return {
            path.stem: read_model(path, Environment).model_dump(exclude_unset=True)
            for path in paths
        }

    @contextmanager
    def locked(self, waiting: Callable[[], None] = lambda: None) -> Iterator[Path]:
        """Be the only one who measures into this folder; gives a folder for temporary files.

        Two runs at a time would slow each other and be wrong about both. So the second waits, after
        calling `waiting`, and then finds done what the first did. The system frees the lock of a
        run that is killed; what that left half-written is cleared away here.

        Raises
        ------
        RecordError
            A folder that is not a run and not empty: nothing is changed in it. One that cannot be
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
        """Whether somebody is measuring into this folder now; None if it is read-only for us."""
        if not is_empty_file(lock_path(self.folder)):
            return False  # opening it would empty it
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
        """A file of a cell: the one with its name, else one of the same key; None: there is none.

        A mesh may have been renamed, and names that no file can have were once kept as they are.
        """
        if path.exists():
            return path
        return min(path.parent.glob(f"*--{cell.key[:12]}{path.suffix}"), default=None)

    def record_file(self, record: Record) -> Path:
        """Return where a record lies."""
        return self._record_path(record.cell)

    def map_file(self, cell: Cell) -> Path:
        """Return where a cell's map lies, if one was kept."""
        return self._map_path(cell)

    def mesh_file(self, cell: Cell) -> Path:
        """Return where a cell's surface lies, if it was kept."""
        return self._mesh_path(cell.mesh_hash)

    def _record_path(self, cell: Cell) -> Path:
        return self.folder / "records" / f"{cell.label}.json"

    def _map_path(self, cell: Cell) -> Path:
        return self.folder / "maps" / f"{cell.label}.npz"

    def _mesh_path(self, mesh_hash: str) -> Path:
        return self.folder / "meshes" / f"{file_name(mesh_hash[:32])}.npz"


def lock_path(folder: Path) -> Path:
    """The file whose lock a run holds while it measures."""
    return folder / run_folder.LOCK


def read_record(path: Path) -> Record:
    """Return the record that a file holds; :class:`RecordError` says what is wrong with it."""
    record = read_model(path, Record)
    if record.schema_version != SCHEMA_VERSION:
        raise RecordError(
            f"{path} is of schema version {record.schema_version}; this cembench reads "
            f"{SCHEMA_VERSION}. Run again into another folder."
        )
    return record
