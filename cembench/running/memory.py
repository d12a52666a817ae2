"""Peak memory of a call."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Memory:
    """Resident bytes of this process; None if the system does not report them."""

    #: Peak resident memory, including the mesh and the libraries as far as they were used.
    peak: int | None
    #: The peak less the resident memory before the call, and less the pages of files that came in
    #: during it: libraries' code that a call is the first to use is not its own memory.
    increase: int | None


def memory_of_call(call: Callable[[], T]) -> tuple[T, Memory]:
    """Call once; return the result, and the peak memory with its increase during the call.

    On Linux the high-water mark is reset before the call; elsewhere, peak and increase are those of
    the whole process.
    """
    gc.collect()
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")
    before, files = resident_bytes(), _linux_status("RssFile") or 0
    result = call()
    peak = peak_memory_bytes()
    came_in = max(0, (_linux_status("RssFile") or 0) - files)
    return result, Memory(peak, None if peak is None else max(0, peak - before - came_in))


def resident_bytes() -> int:
    """Return the current resident memory of this process."""
    import psutil

    return psutil.Process().memory_info().rss


def peak_memory_bytes() -> int | None:
    """Return the peak resident memory of this process; None if the system does not report it."""
    peak = _linux_status("VmHWM")
    if peak is not None:
        return peak
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = int(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return peak if sys.platform == "darwin" else peak * 1024


def _linux_status(field: str) -> int | None:
    """Return a figure of this process in bytes, from Linux; None elsewhere."""
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith(f"{field}:"):
                return int(line.split()[1]) * 1024
    return None
