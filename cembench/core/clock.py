"""The phases of a timed call, each exclusive of the phases nested in it.

A kernel marks its work with ``with phase("factorisation"):``. Outside a measurement that costs one
dictionary look-up. Inside :func:`measure` the seconds of all phases, with the remainder as
``"other"``, add up to the total.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from time import perf_counter
from typing import TypeVar

T = TypeVar("T")

#: Phase for time that no other phase claims.
OTHER = "other"


@dataclass
class _Ledger:
    """The seconds of each phase by a clock, and the stack of open phases.

    The clock is bound when the ledger is made, so replacing it in a module has no effect.
    """

    clock: Callable[[], float]
    seconds: dict[str, float] = field(default_factory=dict)
    stack: list[str] = field(default_factory=lambda: [OTHER])
    since: float = 0.0

    def book(self) -> None:
        """Credit the time since the last change to the phase on top of the stack."""
        now = self.clock()
        name = self.stack[-1]
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self.since
        self.since = now


_ledger: ContextVar[_Ledger | None] = ContextVar("cembench_ledger", default=None)


@dataclass(frozen=True)
class Timing:
    """Wall-clock seconds of one call: the total, and by phase (the phases add up to the total)."""

    total: float
    phases: dict[str, float]


@contextmanager
def phase(name: str) -> Iterator[None]:
    """Credit the enclosed time to the phase `name`, less what nested phases claim.

    Parameters
    ----------
    name : str
        The phase, such as "laplacian", "factorisation" or "solve".

    Yields
    ------
    None
        Control, while the time is credited.

    Examples
    --------
    >>> import time
    >>> def call():
    ...     with phase("solve"):
    ...         time.sleep(0.001)
    >>> _, timing = measure(call)
    >>> sorted(timing.phases)
    ['other', 'solve']
    """
    ledger = _ledger.get()
    if ledger is None:
        yield
        return
    ledger.book()
    ledger.stack.append(name)
    try:
        yield
    finally:
        ledger.book()
        ledger.stack.pop()


def measure(call: Callable[[], T], clock: Callable[[], float] = perf_counter) -> tuple[T, Timing]:
    """Call once; return the result and the seconds of the call, by phase."""
    ledger = _Ledger(clock)
    token = _ledger.set(ledger)
    try:
        ledger.since = clock()
        result = call()
        ledger.book()
    finally:
        _ledger.reset(token)
    phases = dict(sorted(ledger.seconds.items(), key=lambda item: -item[1]))
    return result, Timing(total=sum(phases.values()), phases=phases)
