"""Call an external program as a process in its own folder, timed by the wall clock.

The process is a child of the worker that calls it, so the worker's time and memory limits apply to
everything that the program starts (:mod:`cembench.running.process`).
"""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter, sleep
from typing import Any

import numpy as np
import psutil
import scipy

from cembench.core.clock import Timing
from cembench.core.errors import NotThere, shortened
from cembench.core.notices import Notice, NoticeKind
from cembench.core.parameterization import Atlas, Parameterization
from cembench.core.program import UNITS
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
from cembench.registry import Algorithm
from cembench.results.records import FaultKind, ProgramRun, lower_median
from cembench.running.external.exchange import (
    ProgramFault,
    largest_output,
    read_output,
    write_input,
)
from cembench.running.external.installed import missing
from cembench.running.process import end_of, signal_name
from cembench.running.sanitized_result import Returned

#: Phase name for the wall clock of a program.
PHASE = "process"
#: Maximum size of a program's files, as a multiple of the largest output that is read.
LARGEST_FILE = 8
#: Bytes at the end of a program's output that are searched, and that are kept for a fault.
SEARCHED, KEPT = 2**22, 4000
#: Time limit for asking a program for its version, in seconds.
VERSION_SECONDS = 20.0
#: Seconds between two looks at the memory of a checked program.
LOOK_EVERY = 0.005
#: Maximum number of runs on the small mesh, its rings of vertices, and vertices per ring.
STARTS, RINGS, AROUND = 3, 4, 9

_folder_of_process: list[Path] = []


def use_folder(folder: Path) -> None:
    """Put the folders of this process's programs into this folder, which the caller removes."""
    _folder_of_process[:] = [folder]


@dataclass(frozen=True)
class Ended:
    """The end of a process: code, seconds, and the last part of its output."""

    code: int
    seconds: float
    printed: str
    #: Peak resident bytes of the process and its children; None if not watched.
    peak: int | None


@dataclass
class ProgramCalls:
    """The calls of a program on one mesh, with their measurements."""

    algorithm: Algorithm
    mesh: TriangleMesh
    arguments: Mapping[str, Any]
    threads: int
    #: The solve time printed by each call so far, if any.
    own: list[float | None] = field(default_factory=list)
    walls: list[float] = field(default_factory=list)
    bytes: tuple[int, int] = (0, 0)
    peak: int | None = None

    def __call__(self, mesh: TriangleMesh, *, watched: bool = False) -> tuple[Returned, Timing]:
        """Run the program once on this surface; return its map and its wall-clock timing.

        With `watched` its memory is measured, which is not done in timed calls.

        Raises
        ------
        NotThere
            The program is not installed.
        ProgramFault
            The program crashed, or wrote no map.
        """
        result, ended = self._run(mesh, watched=watched)
        self.own.append(self._own_seconds(ended.printed))
        self.walls.append(ended.seconds)
        self.peak = ended.peak
        timing = Timing(total=ended.seconds, phases={PHASE: ended.seconds})
        return Returned.of(result, mesh, self.algorithm.target), timing

    def own_seconds(self, last: int) -> tuple[float, ...]:
        """Return the solve times that the last calls printed; empty if one printed none."""
        seconds = self.own[-last:]
        return tuple(one for one in seconds if one is not None) if None not in seconds else ()

    def start_seconds(self, times: int) -> float | None:
        """Return the median wall-clock seconds on a small mesh; None if the program fails on it."""
        small = small_mesh(self.mesh)
        try:
            sizes = self.bytes
            seconds = [self._run(small)[1].seconds for _ in range(min(times, STARTS) + 1)][1:]
            self.bytes = sizes
        except (ProgramFault, NotThere):
            return None
        return lower_median(seconds)

    def facts(self) -> ProgramRun:
        """Return the version, and the file sizes of the last call."""
        return ProgramRun(
            version=self._version(), input_bytes=self.bytes[0], output_bytes=self.bytes[1]
        )

    def notices(self, start: float | None) -> list[Notice]:
        """Return remarks on the seconds of the last call."""
        texts = []
        program = self.algorithm.program
        if start is None:
            texts.append(
                "it failed on a small mesh, so its start-up time is unknown and stays part of "
                "its wall-clock time"
            )
        if program is not None and program.seconds and self.own[-1] is None:
            texts.append(f"it printed no solve time that matches {program.seconds!r}")
        if self.own[-1] is not None and self.own[-1] > self.walls[-1]:
            texts.append(
                f"it reports a solve time of {self.own[-1]:.3g} s, but its process took "
                f"{self.walls[-1]:.3g} s in all"
            )
        return [Notice(NoticeKind.PROGRAM_SECONDS, one) for one in texts]

    def _run(
        self, mesh: TriangleMesh, *, watched: bool = False
    ) -> tuple[Parameterization | Atlas, Ended]:
        program = self.algorithm.program
        assert program is not None
        lacking = missing(self.algorithm)
        if lacking:
            raise NotThere(lacking)
        with own_folder() as folder:
            input_file = folder / f"mesh{program.input}"
            output_file = folder / program.output_name
            write_input(input_file, mesh)
            places = {
                "input": input_file,
                "output": output_file,
                "folder": folder,
                "threads": self.threads,
            }
            command = program.words({**self.arguments, **places})
            before = input_file.stat().st_size
            ended = _ended(command, folder, LARGEST_FILE * largest_output(mesh), watched=watched)
            if ended.code:
                raise _fault(ended)
            result = read_output(output_file, self.algorithm, mesh)
            self.bytes = before, output_file.stat().st_size
        return result, ended

    def _own_seconds(self, printed: str) -> float | None:
        program = self.algorithm.program
        if program is None or not program.seconds:
            return None
        hits = list(re.finditer(program.seconds, printed, re.MULTILINE))
        if not hits:
            return None
        hit = hits[-1]
        unit = next(iter(hit.re.groupindex), "s")
        try:
            seconds = float(hit[1]) * UNITS[unit]
        except ValueError:
            return None
        return seconds if 0 <= seconds < float("inf") else None

    def _version(self) -> str | None:
        program = self.algorithm.program
        if program is None or not program.version:
            return None
        try:
            said = subprocess.run(
                program.version,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                timeout=VERSION_SECONDS,
                check=False,
            ).stdout
        except (OSError, subprocess.TimeoutExpired):
            return None
        lines = said[:KEPT].decode(errors="replace").strip().splitlines()
        return shortened(lines[0], 200) if lines else None


def small_mesh(like: TriangleMesh) -> TriangleMesh:
    """Return a mesh on which solving costs nothing, for measuring a program's start-up time.

    It is a shallow cap of 63 triangles; for a surface with holes, of 54 triangles with a hole.
    """
    kind = HoledMesh if isinstance(like, HoledMesh) else DiskMesh
    ring, k = np.divmod(np.arange(RINGS * AROUND), AROUND)
    z = (ring + 1) / RINGS * np.exp(2j * np.pi * (k + ring / 2) / AROUND)
    if kind is DiskMesh:
        z = np.append(z, 0)
    plan = np.stack([z.real, z.imag], axis=1)
    F = scipy.spatial.Delaunay(plan).simplices.astype(np.int64)
    F = F[(F >= AROUND).any(axis=1)]  # the others fill the hole
    return kind.from_arrays(np.column_stack([plan, 0.3 * (1 - np.abs(z) ** 2)]), F, name="small")


@contextmanager
def own_folder() -> Iterator[Path]:
    """Yield a temporary folder for a program."""
    above = _folder_of_process[0] if _folder_of_process else None
    if above is not None:
        above.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix="program-", dir=above))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _ended(command: Sequence[str], folder: Path, largest_file: int, *, watched: bool) -> Ended:
    """Run a command to its end, with its output to a file, so that no pipe can block it."""
    log = folder.with_name(f"{folder.name}.log")
    try:
        with log.open("wb") as output, _files_at_most(largest_file):
            started = perf_counter()
            try:
                process = subprocess.Popen(
                    command,
                    cwd=folder,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                )
            except OSError as error:
                message = f"{command[0]} cannot be started: {error.strerror or error}"
                raise ProgramFault(FaultKind.PROGRAM_ENDED, message) from None
            peak = _watched(process) if watched else None
            code = process.wait()
            seconds = perf_counter() - started
        printed = b""
        with suppress(OSError), log.open("rb") as written:  # the program may have removed it
            printed = end_of(written, SEARCHED)
        return Ended(code, seconds, printed.decode(errors="replace"), peak)
    finally:
        with suppress(OSError):
            log.unlink()


@contextmanager
def _files_at_most(size: int) -> Iterator[None]:
    """Limit the file size of processes started in this block (not on Windows)."""
    try:
        import resource
    except ImportError:
        yield
        return
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    bound = size if hard == resource.RLIM_INFINITY else min(size, hard)
    resource.setrlimit(resource.RLIMIT_FSIZE, (bound, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def _watched(process: subprocess.Popen[bytes]) -> int | None:
    """Return the peak memory of a process and its children, watched until it ends."""
    peak = 0
    with suppress(psutil.Error):
        root = psutil.Process(process.pid)
        while process.poll() is None:
            with suppress(psutil.Error):
                tree = [root, *root.children(recursive=True)]
                peak = max(peak, sum(one.memory_info().rss for one in tree))
            sleep(LOOK_EVERY)
    return peak or None


def _fault(ended: Ended) -> ProgramFault:
    """Return the fault of a process that did not end with code 0."""
    said = ended.printed[-KEPT:].strip()
    last = f": {shortened(said.splitlines()[-1], 500)}" if said else ""
    if ended.code > 0:
        message = f"the program ended with code {ended.code}{last}"
        return ProgramFault(FaultKind.GAVE_UP, message, said=said)
    number = -ended.code
    if sys.platform != "win32" and number == signal.SIGXFSZ:
        message = "the program was ended because a file that it wrote grew too large"
        return ProgramFault(FaultKind.OUTPUT_TOO_LARGE, message, said=said)
    message = f"the program was ended by signal {signal_name(number)}{last}"
    return ProgramFault(FaultKind.PROGRAM_ENDED, message, said=said)
