"""Share the drawing of a report among processes, where a block asks for it.

Without such a block everything is drawn at once, in this process.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any, TypeVar

from cembench.running.process_pool import process_pool

R = TypeVar("R")
T = TypeVar("T")


@dataclass
class _Shared:
    """The processes, and what they were given to do."""

    pool: Executor
    tasks: list[Future[Any]] = field(default_factory=list)


_SHARED: ContextVar[_Shared | None] = ContextVar("_SHARED", default=None)


@contextmanager
def shared_drawing(jobs: int) -> Iterator[None]:
    """Let :func:`each` and :func:`draw` use `jobs` processes; all is drawn at the block's end."""
    if jobs < 2:
        yield
        return
    with process_pool(jobs) as pool:
        shared = _Shared(pool)
        token = _SHARED.set(shared)
        try:
            yield
        finally:
            _SHARED.reset(token)
        for one in shared.tasks:
            one.result()


def each(function: Callable[[T], R], arguments: Iterable[T]) -> Iterator[R]:
    """Yield a function's results in order; the function may be called in several processes."""
    shared = _SHARED.get()
    return map(function, arguments) if shared is None else shared.pool.map(function, arguments)


def draw(function: Callable[..., None], *arguments: Any) -> None:
    """Call a function that writes files, now or before the block ends."""
    shared = _SHARED.get()
    if shared is None:
        function(*arguments)
    else:
        shared.tasks.append(shared.pool.submit(function, *arguments))
