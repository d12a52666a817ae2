"""Read a file by a library, in a process of its own whose memory and time are bounded.

A small file can declare, or unpack to, more than memory holds. Our own readers compare sizes first;
libraries do not, and those in C++ end the process when memory runs out. That process is not ours.
On some damaged files a library never ends.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from cembench.core.atomic import write, write_text
from cembench.core.errors import MeshError, RecordError
from cembench.core.extras import Extra, require
from cembench.core.loading import free_memory, read_arrays
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.soup import Soup, damaged

Reader = Callable[..., Soup]

_SOUP, _ERROR, _UV = "soup.npz", "error.txt", ("uv", "uv_index")
#: Exit code of a process in which a reader ran out of memory.
_NO_MEMORY = 12
#: Seconds that a library has for any file, and more for each megabyte: a hundred times the usual.
_SECONDS, _SECONDS_PER_MB = 120.0, 10.0


def isolated(reader: Reader, extra: Extra, module: str, other: str = "") -> Reader:
    """Return a reader that calls this one in another process; its library is of an extra.

    With `uv=True` it reads texture coordinates, too; other options are the reader's.

    The reader raises :class:`MissingExtra` where neither it nor the other library is installed.
    """

    def read(path: Path, **options: Any) -> Soup:
        if not other or find_spec(other) is None:
            require(extra, f"reading {path.suffix} files", module)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            reads = [reader.__module__, reader.__name__, str(path.absolute()), name]
            command = [sys.executable, "-P", "-m", __name__, *reads, json.dumps(options)]
            nowhere: Any = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
            most = _SECONDS + _SECONDS_PER_MB * path.stat().st_size / 1e6
            try:
                ended = subprocess.run(command, check=False, timeout=most, **nowhere)
            except subprocess.TimeoutExpired:
                raise damaged(
                    f"{module} did not finish reading it in {most:.0f} seconds, many times what a "
                    "file of this size takes, and was stopped"
                ) from None
            if (folder / _ERROR).exists():
                raise MeshError((folder / _ERROR).read_text(encoding="utf-8"))
            if ended.returncode == 0:
                return _soup(folder / _SOUP, uv=options.get("uv", False))
        if ended.returncode == _NO_MEMORY:
            raise MemoryError
        how = f"code {ended.returncode}"
        with suppress(ValueError):
            how = signal.Signals(-ended.returncode).name
        raise damaged(
            f"the process that read it through {module} ended with {how}: what the file declares "
            f"may be more than memory can hold ({free_memory():,} bytes are free)"
        )

    return read


def _soup(file: Path, *, uv: bool) -> Soup:
    try:
        arrays: dict[str, Any] = read_arrays(
            file, ("V", "corners", "sizes", "notices", *(_UV if uv else ()))
        )
    except RecordError as error:
        raise MeshError(str(error)) from error
    pairs = json.loads(str(arrays.pop("notices")))
    notices = tuple(Notice(NoticeKind(kind), text) for kind, text in pairs)
    return Soup(**arrays, notices=notices)


def _main(module: str, reader: str, path: str, folder: str, options: str) -> int:
    """Call a reader, and write its surface or the words of its error to a folder."""
    read: Reader = getattr(import_module(module), reader)
    _bound_memory()
    try:
        soup = read(Path(path), **json.loads(options))
        notices = np.array(json.dumps([(notice.kind, notice.text) for notice in soup.notices]))
        fields = {"V": soup.V, "corners": soup.corners, "sizes": soup.sizes, "notices": notices}
        if json.loads(options).get("uv"):
            none = np.empty(0, dtype=np.complex128)
            fields["uv"] = none if soup.uv is None else soup.uv
            fields["uv_index"] = soup.corners if soup.uv_index is None else soup.uv_index
        write(Path(folder) / _SOUP, lambda file: np.savez(file, allow_pickle=False, **fields))
    except MeshError as error:
        write_text(Path(folder) / _ERROR, str(error))
    except MemoryError:
        return _NO_MEMORY
    return 0


def _bound_memory() -> None:
    """Let this process reserve what is free now and no more, where the system can bound that."""
    with suppress(ImportError, ValueError, OSError):  # Windows, or a lower limit is in force
        import resource

        most = int(psutil.Process().memory_info().vms) + free_memory()
        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (most, hard))


if __name__ == "__main__":
    sys.exit(_main(*sys.argv[1:]))
