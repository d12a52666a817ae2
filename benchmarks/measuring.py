"""What studies share: surfaces by name, calls in turns, fresh processes, progress, pictures."""

from __future__ import annotations

import gc
import json
import subprocess
import sys
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from importlib import import_module
from math import log
from statistics import linear_regression, median
from typing import TYPE_CHECKING, Any, TypeVar

from cembench.running.environment import for_measuring

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from cembench.core.clock import Timing

T = TypeVar("T")


def read_surface(name: str) -> Any:
    """Read ``FILE``, or ``FILE@SPLITS`` with every triangle split into four SPLITS times.

    A number is a spherical cap with that number of triangles.
    """
    import igl
    import numpy as np
    from cembench.surfaces.spherical_cap import spherical_cap

    from cembench.mesh.files import read_mesh
    from cembench.mesh.triangle_mesh import DiskMesh

    if name.isdigit():
        return spherical_cap(int(name))
    path, _, splits = name.partition("@")
    mesh = read_mesh(path)
    V, F = mesh.V, mesh.F
    for _ in range(int(splits or 0)):
        V, F = igl.upsample(V, F)
    return DiskMesh.trusted(V, F.astype(np.int64)) if splits else mesh


def in_fresh_process(
    function: Callable[..., Any], *arguments: Any, without: Collection[str] = ()
) -> Any:
    """Return what a study's function returns in a process of its own; all of it is JSON.

    The environment is that of timed processes, `without` some of its variables.
    """
    arguments_of_process = [function.__module__, function.__qualname__, json.dumps(arguments)]
    environment = {k: v for k, v in for_measuring(1).items() if k not in without}
    command = [sys.executable, "-m", "benchmarks.measuring", *arguments_of_process]
    run = subprocess.run(command, capture_output=True, encoding="utf-8", env=environment)
    if run.returncode:
        raise SystemExit(run.stderr)
    return json.loads(run.stdout)


def in_turns(
    calls: Mapping[str, Callable[[], object]],
    rounds: int,
    *,
    clock: Callable[[], float] = time.perf_counter,
    warm_up: int = 1,
    at_least: float = 0,
    at_most: int = 0,
) -> dict[str, list[Timing]]:
    """Time every call once a round, after rounds to warm up.

    Rounds continue until `at_least` seconds have passed, but at most `at_most` are added.
    """
    from cembench.core.clock import measure

    timings: dict[str, list[Timing]] = {name: [] for name in calls}
    until, done = time.monotonic() + at_least, -warm_up
    while done < rounds or (done < at_most and time.monotonic() < until):
        for name, call in calls.items():
            gc.collect()
            timing = measure(call, clock)[1]
            if done >= 0:
                timings[name].append(timing)
        done += 1
    return timings


def medians(timings: Mapping[str, list[Timing]], over: str) -> dict[str, dict[str, float]]:
    """Return median seconds, and medians of the ratios within a round to those of one call."""
    seconds = {name: [one.total for one in many] for name, many in timings.items()}
    return {
        "seconds": {name: median(many) for name, many in seconds.items()},
        "ratios": {
            name: median(a / b for a, b in zip(many, seconds[over], strict=True))
            for name, many in seconds.items()
        },
    }


def exponent(rows: list[dict[str, Any]], name: str, size: str = "faces") -> float:
    """Return the slope of log seconds against log size over the rows."""
    x, y = ([log(one[size]) for one in rows], [log(one["seconds"][name]) for one in rows])
    return linear_regression(x, y).slope


def progress(items: Collection[T], of: str = "") -> Iterator[T]:
    """Yield the items, and report on standard error which of them are done."""
    began = time.monotonic()
    for number, item in enumerate(items, 1):
        yield item
        label = str(item) if len(str(item)) < 60 else ""
        minutes = (time.monotonic() - began) / 60
        print(f"{of} {number} of {len(items)} {label}: {minutes:.1f} min", file=sys.stderr)


def png(figure: Figure, dpi: int) -> bytes:
    """Return a picture as PNG; the same figure gives the same bytes."""
    from io import BytesIO

    file = BytesIO()
    figure.savefig(file, format="png", dpi=dpi, metadata={"Software": ""})
    return file.getvalue()


if __name__ == "__main__":
    module, function, arguments = sys.argv[1:]
    print(json.dumps(getattr(import_module(module), function)(*json.loads(arguments))))
