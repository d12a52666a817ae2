"""What else does the machine do while a process is measured? From the system's own counters."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic

import psutil

from cembench.results.records import Neighbours

#: What the kernel of Linux counts of how often a core was too hot.
_THROTTLES = "devices/system/cpu/cpu[0-9]*/thermal_throttle/core_throttle_count"


@dataclass(frozen=True)
class Counters:
    """Seconds of all cores since the machine started, and how often one was too hot."""

    worked: float
    stolen: float
    #: None where the system does not tell.
    throttles: int | None
    at: float = field(default_factory=monotonic)


def counters() -> Counters:
    """Return what the system counts now."""
    times = psutil.cpu_times()
    names = ("user", "nice", "system", "irq", "softirq")
    worked = sum(float(getattr(times, name, 0.0)) for name in names)
    return Counters(worked, float(getattr(times, "steal", 0.0)), _throttles(Path("/sys")))


def neighbours(before: Counters, after: Counters, threads: int) -> Neighbours:
    """Return what took part of the machine between two readings, beside a process of ours.

    That is taken to have worked all the time on so many threads; where it waited, as much less of
    the others is seen.
    """
    seconds = max(after.at - before.at, 1e-9)
    throttled = None
    if before.throttles is not None and after.throttles is not None:
        throttled = after.throttles > before.throttles
    return Neighbours(
        other_cores=round(max(0.0, (after.worked - before.worked) / seconds - threads), 2),
        stolen_cores=round(max(0.0, (after.stolen - before.stolen) / seconds), 2),
        throttled=throttled,
    )


def _throttles(system: Path) -> int | None:
    return _sum(system.glob(_THROTTLES))


def _sum(files: Iterable[Path]) -> int | None:
    found = []
    for file in files:
        with suppress(OSError, ValueError):
            found.append(int(file.read_text()))
    return sum(found) if found else None
