"""Description of the machine, the libraries and the limits of a measurement."""

from __future__ import annotations

import hashlib
import json
import os
import platform
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cembench.core.names import printable
from cembench.core.version import installed_version, version_of

#: Variables that set the number of threads; set them before numerical libraries are loaded.
THREAD_VARIABLES = (
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "IGL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)
#: That of OpenBLAS: one thread, since its sums depend on the number, and so would maps.
SUMS_VARIABLE = "OPENBLAS_NUM_THREADS"
#: Settings of glibc's allocator, which it reads when a process starts; others ignore them.
ALLOCATOR_VARIABLE = "GLIBC_TUNABLES"
#: Memory comes in huge pages where Linux offers them on request, and what is freed stays with the
#: process for its next call. Otherwise a call pays for its memory again, or not, by the addresses
#: that a process happens to have: some are slower by a fifth from the first call to the last.
ALLOCATOR = {
    "glibc.malloc.hugetlb": "1",
    "glibc.malloc.mmap_max": "0",
    "glibc.malloc.trim_threshold": str(2**40),
}
_OFFERED = Path("/sys/kernel/mm/transparent_hugepage/enabled")
#: Names the machine in records; set it where the system's name changes, as in containers.
MACHINE_VARIABLE = "CEMBENCH_MACHINE"
_LIBRARIES = ("numpy", "scipy", "cvxopt", "libigl", "pymetis", "pypardiso", "pydantic")
#: Variables that plug-ins changed when they were imported, with their values before (None: unset).
_CHANGED: dict[str, str | None] = {}


@contextmanager
def importing() -> Iterator[None]:
    """Import plug-ins here: what they change in the environment, no measuring process gets."""
    before = dict(os.environ)
    try:
        yield
    finally:
        for name in before.keys() | os.environ.keys():
            if os.environ.get(name) != before.get(name):
                _CHANGED.setdefault(name, before.get(name))


def for_measuring(threads: int) -> dict[str, str]:
    """Return the environment of processes whose calls are timed.

    Numerical libraries use `threads` threads, OpenBLAS one, and memory is handled as
    :data:`ALLOCATOR` says, unless the user's own settings of the allocator say otherwise. A process
    that imports a plug-in itself has the variables that this sets, but no other one has.

    Examples
    --------
    >>> for_measuring(1)["OMP_NUM_THREADS"]
    '1'
    """
    given = {name: value for name, value in (os.environ | _CHANGED).items() if value is not None}
    own = [one for one in given.get(ALLOCATOR_VARIABLE, "").split(":") if one]
    named = {one.partition("=")[0] for one in own}
    ours = [f"{name}={value}" for name, value in ALLOCATOR.items() if name not in named]
    allocator = {ALLOCATOR_VARIABLE: ":".join(own + ours)}
    counts = dict.fromkeys(THREAD_VARIABLES, str(threads)) | {SUMS_VARIABLE: "1"}
    return given | counts | allocator


def usable_cores() -> int:
    """Return how many hardware threads this process may use: fewer than there are, in a job."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def machine_name() -> str:
    """Return the name of this machine in records: `CEMBENCH_MACHINE`, or the system's name."""
    return printable(os.environ.get(MACHINE_VARIABLE) or platform.node() or "unnamed")


def describe_environment() -> dict[str, Any]:
    """Return everything that a figure may depend on, as JSON values; "id" is a hash of the rest."""
    import psutil
    from threadpoolctl import threadpool_info

    about: dict[str, Any] = {
        "machine": machine_name(),
        "cembench": installed_version(),
        "git": _git_state(),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "cpu": _cpu_model(),
        "cores": psutil.cpu_count(logical=False),
        "hardware_threads": psutil.cpu_count(),
        "memory_bytes": psutil.virtual_memory().total,
        "allocator": _allocator(),
        "libraries": {name: version_of(name) for name in _LIBRARIES},
        "blas": sorted(
            f"{pool['internal_api']} {pool.get('version') or '?'} "
            f"({pool.get('architecture', 'unknown')})"
            for pool in threadpool_info()
            if pool["user_api"] == "blas"
        ),
    }
    content = json.dumps(about, sort_keys=True).encode()
    return about | {"id": hashlib.sha256(content).hexdigest()[:12]}


def _allocator() -> dict[str, str | None]:
    """Return how timed processes and the reference kernel have memory, and large pages."""
    offered = _OFFERED.read_text(encoding="utf-8") if _OFFERED.exists() else ""
    chosen = offered.partition("[")[2].partition("]")[0]
    return {
        "settings": for_measuring(1)[ALLOCATOR_VARIABLE],
        "huge_pages": chosen or None,
        # Without it the kernel took 1.35 times as long in processes that had freed no large array.
        "reference_kernel": "in one state of the heap",
    }


def _cpu_model() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _git_state() -> dict[str, Any] | None:
    """Return commit and state of cembench's git checkout; None if it is installed."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return None
    try:
        commit = _git(root, "rev-parse", "HEAD")
        return {"commit": commit, "dirty": bool(_git(root, "status", "--porcelain"))}
    except (OSError, subprocess.CalledProcessError):
        return None


def _git(root: Path, *arguments: str) -> str:
    run = subprocess.run(
        ["git", "-C", str(root), *arguments], capture_output=True, encoding="utf-8", check=True
    )
    return run.stdout.strip()
