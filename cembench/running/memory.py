"""How much memory does a call take at most?"""

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
    """Resident bytes of this process; None where the system does not tell."""

    #: The largest resident set, mesh and libraries included.
    peak: int | None
    #: The peak less what was resident before the call.
    increase: int | None


def memory_of_call(call: Callable[[], T]) -> tuple[T, Memory]:
    """Call once; what is the largest resident set, and by how much did the call raise it?

    On Linux the system's high-water mark is reset before the call; elsewhere the peak is that of
    the whole process, and so is the increase.
    """
    gc.collect()
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    before = resident_bytes()
    result = call()
    peak = peak_memory_bytes()
    return result, Memory(peak, None if peak is None else max(0, peak - before))


def resident_bytes() -> int:
    """The resident set of this process now."""
    import psutil

    resident: int = psutil.Process().memory_info().rss
    return resident


def peak_memory_bytes() -> int | None:
    """The largest resident set this process has had; None where the system does not tell."""
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
