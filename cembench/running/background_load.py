"""Load of the machine by other work during a measurement, from the system's counters."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic

import psutil

from cembench.results.records import Neighbours

#: Counters of the Linux kernel for thermal throttling of a core.
_THROTTLES = "devices/system/cpu/cpu[0-9]*/thermal_throttle/core_throttle_count"


@dataclass(frozen=True)
class Counters:
    """Seconds of all cores since the machine started, and throttling events."""

    worked: float
    stolen: float
    #: None if the system does not report it.
    throttles: int | None
    at: float = field(default_factory=monotonic)


def counters() -> Counters:
    """Return the current counters of the system."""
    times = psutil.cpu_times()
    names = ("user", "nice", "system", "irq", "softirq")
    worked = sum(float(getattr(times, name, 0.0)) for name in names)
    return Counters(worked, float(getattr(times, "steal", 0.0)), _throttles(Path("/sys")))


def neighbours(before: Counters, after: Counters, threads: int) -> Neighbours:
    """Return the load by other work between two readings.

    Our process is assumed to have used all its `threads` the whole time; if it waited, the load of
    others is underestimated by as much.
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
    counts = []
    for file in files:
        with suppress(OSError, ValueError):
            counts.append(int(file.read_text(encoding="utf-8")))
    return sum(counts) if counts else None
