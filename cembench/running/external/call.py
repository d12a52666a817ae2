"""Call an external program: a process in a folder of its own, timed by the wall clock.

The process runs below the worker that calls it, so the worker's limits of time and memory, and what
ends it, hold for all that the program starts (:mod:`cembench.running.process`).
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter, sleep
from typing import Any

import psutil

from cembench.core.clock import Timing
from cembench.core.errors import NotThere, shortened
from cembench.core.notices import Notice, NoticeKind
from cembench.core.parameterization import Atlas, Parameterization
from cembench.core.program import UNITS
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm
from cembench.results.records import FaultKind, ProgramRun, lower_median
from cembench.running.external.exchange import largest_output, read_output, write_input
from cembench.running.external.faults import ProgramFault
from cembench.running.external.present import missing
from cembench.running.external.small_mesh import small_mesh

#: What the wall clock of a program is booked under.
PHASE = "process"
#: No file of a program grows beyond so many times the largest output that is read.
LARGEST_FILE = 8
#: The end of what a program prints that is searched, and that is kept of a fault, in bytes.
SEARCHED, KEPT = 2**22, 4000
#: Seconds that asking a program for its version may take.
VERSION_SECONDS = 20.0
#: Seconds between two looks at the memory of a program that is checked.
LOOK_EVERY = 0.005
#: How often a program is run on the small mesh at most.
STARTS = 3

_folder_of_process: list[Path] = []


def use_folder(folder: Path) -> None:
    """Have the folders of this process's programs in this one, which somebody else removes."""
    _folder_of_process[:] = [folder]


@dataclass(frozen=True)
class Ended:
    """How a process ended, after how many seconds, with the end of what it printed."""

    code: int
    seconds: float
    printed: str
    #: Largest resident bytes of it and what it started; None where nobody looked.
    peak: int | None


@dataclass
class ProgramCalls:
    """The calls of a program on one mesh, and what was found out about each."""

    algorithm: Algorithm
    mesh: TriangleMesh
    arguments: Mapping[str, Any]
    threads: int
    #: Of each call so far: the solve time that it printed, if it did.
    own: list[float | None] = field(default_factory=list)
    walls: list[float] = field(default_factory=list)
    bytes: tuple[int, int] = (0, 0)
    peak: int | None = None

    def __call__(
        self, mesh: TriangleMesh, *, watched: bool = False
    ) -> tuple[Parameterization | Atlas, Timing]:
        """Run the program once on this surface; its map, and the wall clock of its process.

        With `watched` its memory is looked at, which a timed call is spared.

        Raises
        ------
        NotThere
            The program is not on this machine.
        ProgramFault
            It crashed, or left no map.

        """
        found, ended = self._run(mesh, watched=watched)
        self.own.append(self._own_seconds(ended.printed))
        self.walls.append(ended.seconds)
        self.peak = ended.peak
        return found, Timing(total=ended.seconds, phases={PHASE: ended.seconds})

    def own_seconds(self, last: int) -> tuple[float, ...]:
        """Return the solve times that the last calls printed; empty where one printed none."""
        found = self.own[-last:]
        return tuple(one for one in found if one is not None) if None not in found else ()

    def start_seconds(self, times: int) -> float | None:
        """Return the median wall clock on a small mesh; None where the program fails on that."""
        small = small_mesh(self.mesh)
        try:
            sizes = self.bytes
            found = [self._run(small)[1].seconds for _ in range(min(times, STARTS) + 1)][1:]
            self.bytes = sizes
        except (ProgramFault, NotThere):
            return None
        return lower_median(found)

    def facts(self) -> ProgramRun:
        """Return the version, and the sizes of the files of the last call."""
        return ProgramRun(
            version=self._version(), input_bytes=self.bytes[0], output_bytes=self.bytes[1]
        )

    def notices(self, start: float | None) -> list[Notice]:
        """Return what a reader should know of the seconds of the last call."""
        told = []
        program = self.algorithm.program
        if start is None:
            told.append(
                "it failed on a small mesh, so what starting it costs is not known: its wall clock "
                "holds that too"
            )
        if program is not None and program.seconds and self.own[-1] is None:
            told.append(f"it printed no solve time that {program.seconds!r} finds")
        if self.own[-1] is not None and self.own[-1] > self.walls[-1]:
            told.append(
                f"it says that it solved for {self.own[-1]:.3g} s, but its process took "
                f"{self.walls[-1]:.3g} s in all"
            )
        return [Notice(NoticeKind.PROGRAM_SECONDS, one) for one in told]

    def _run(
        self, mesh: TriangleMesh, *, watched: bool = False
    ) -> tuple[Parameterization | Atlas, Ended]:
        program = self.algorithm.program
        assert program is not None
        lacking = missing(self.algorithm)
        if lacking:
            raise NotThere(lacking)
        with _own_folder() as folder:
            given = folder / f"mesh{program.input}"
            left = folder / program.output_name
            write_input(given, mesh)
            places = {"input": given, "output": left, "folder": folder, "threads": self.threads}
            words = program.words({**self.arguments, **places})
            before = given.stat().st_size
            ended = _ended(words, folder, LARGEST_FILE * largest_output(mesh), watched=watched)
            if ended.code:
                raise _fault(ended)
            found = read_output(left, self.algorithm, mesh)
            self.bytes = before, left.stat().st_size
        return found, ended

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


@contextmanager
def _own_folder() -> Iterator[Path]:
    """Make a folder for one call, gone afterwards with all that is in it."""
    above = _folder_of_process[0] if _folder_of_process else None
    if above is not None:
        above.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix="program-", dir=above))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _ended(words: Sequence[str], folder: Path, largest_file: int, *, watched: bool) -> Ended:
    """Run a command to its end; what it prints goes to a file, so that nothing waits for a pipe."""
    log = folder.with_name(f"{folder.name}.log")
    try:
        with log.open("wb") as output, _files_at_most(largest_file):
            started = perf_counter()
            try:
                process = subprocess.Popen(
                    words,
                    cwd=folder,
                    stdin=subprocess.DEVNULL,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                )
            except OSError as error:
                told = f"{words[0]} cannot be started: {error.strerror or error}"
                raise ProgramFault(FaultKind.PROGRAM_ENDED, told) from None
            peak = _watched(process) if watched else None
            code = process.wait()
            seconds = perf_counter() - started
        return Ended(code, seconds, _end_of(log), peak)
    finally:
        with suppress(OSError):
            log.unlink()


def _end_of(log: Path) -> str:
    with suppress(OSError), log.open("rb") as file:
        file.seek(max(0, log.stat().st_size - SEARCHED))
        return file.read().decode(errors="replace")
    return ""


@contextmanager
def _files_at_most(size: int) -> Iterator[None]:
    """Let no file of a process that is started now grow beyond this size (not on Windows)."""
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
    """Look at the memory of a process and all that it starts until it ends: the largest sum."""
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
    """Return what is wrong with a process that ended otherwise than with code 0."""
    import signal

    said = ended.printed[-KEPT:].strip()
    last = f": {shortened(said.splitlines()[-1], 500)}" if said else ""
    if ended.code > 0:
        told = f"the program ended with code {ended.code}{last}"
        return ProgramFault(FaultKind.GAVE_UP, told, said=said)
    number = -ended.code
    if sys.platform != "win32" and number == signal.SIGXFSZ:
        told = "the program was ended because a file that it wrote grew too large"
        return ProgramFault(FaultKind.OUTPUT_TOO_LARGE, told, said=said)
    known = {int(one): one.name for one in signal.Signals}
    told = f"the program was ended by signal {known.get(number, number)}{last}"
    return ProgramFault(FaultKind.PROGRAM_ENDED, told, said=said)
