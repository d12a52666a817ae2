"""Solvers whose seconds are not what they seem: by accident, or on purpose.

Their maps are valid and promise nothing, so that `validate` can find fault with nothing else.
"""

import hashlib
import os
import subprocess
import sys
import tempfile
import threading
import time
from functools import lru_cache
from pathlib import Path

import numpy as np

import cembench.core.clock
from cembench import DiskMesh, Parameterization, algorithm
from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian

#: Where the ones that keep something on disk keep it.
KEPT = Path(os.environ.get("CHEATS_FOLDER", tempfile.gettempdir()))


def work(mesh):
    """An honest map, several times over: what is kept saves most of it."""
    for _ in range(3):
        uv = harmonic_extension(laplacian(mesh), mesh.boundary, arc_length_circle(mesh))
    return uv


def content(mesh):
    return hashlib.sha256(mesh.V.tobytes() + mesh.F.tobytes()).hexdigest()


@algorithm("honest", title="Honest", target="disk", conformal=False)
def honest(mesh: DiskMesh) -> Parameterization:
    return Parameterization(work(mesh))


by_key = {}


def kept(key, mesh):
    if key not in by_key:
        by_key[key] = work(mesh)
    return Parameterization(by_key[key])


@algorithm("by-content", title="Keeps maps by content", target="disk", conformal=False)
def by_content(mesh: DiskMesh) -> Parameterization:
    return kept(content(mesh), mesh)


@algorithm("by-triangles", title="Keeps maps by triangles", target="disk", conformal=False)
def by_triangles(mesh: DiskMesh) -> Parameterization:
    return kept(mesh.F.tobytes(), mesh)


@algorithm("by-shape", title="Keeps maps by sizes", target="disk", conformal=False)
def by_shape(mesh: DiskMesh) -> Parameterization:
    return kept((mesh.name, mesh.n, mesh.m), mesh)


@algorithm("by-id", title="Keeps maps by id", target="disk", conformal=False)
def by_id(mesh: DiskMesh) -> Parameterization:
    return kept(id(mesh), mesh)


def on_disk(key, mesh):
    file = KEPT / f"{hashlib.sha256(key.encode()).hexdigest()}.npy"
    if not file.exists():
        np.save(file, work(mesh))
    return Parameterization(np.load(file))


@algorithm("on-disk", title="Keeps maps on disk by content", target="disk", conformal=False)
def on_disk_by_content(mesh: DiskMesh) -> Parameterization:
    return on_disk(content(mesh), mesh)


@algorithm("on-disk-by-name", title="Keeps maps on disk by name", target="disk", conformal=False)
def on_disk_by_name(mesh: DiskMesh) -> Parameterization:
    return on_disk(f"{mesh.name} {mesh.n}", mesh)


@lru_cache
def laplacian_of(triangles):
    return []


@algorithm("keeps-laplacian", title="Keeps a matrix by triangles", target="disk", conformal=False)
def keeps_laplacian(mesh: DiskMesh) -> Parameterization:
    held = laplacian_of(mesh.F.tobytes())
    if not held:
        time.sleep(0.01)
        held.append(laplacian(mesh))
    return Parameterization(harmonic_extension(held[0], mesh.boundary, arc_length_circle(mesh)))


ordered = set()


@algorithm("keeps-ordering", title="Keeps what triangles determine", target="disk", conformal=False)
def keeps_ordering(mesh: DiskMesh) -> Parameterization:
    if mesh.F.tobytes() not in ordered:
        time.sleep(0.3)
        ordered.add(mesh.F.tobytes())
    return Parameterization(work(mesh))


def endless():
    while True:
        np.sort(np.random.default_rng(0).random(100_000))


@algorithm("works-ahead", title="A thread works on between calls", target="disk", conformal=False)
def works_ahead(mesh: DiskMesh) -> Parameterization:
    if threading.active_count() == 1:
        threading.Thread(target=endless, daemon=True).start()
    return Parameterization(work(mesh))


called = []


@algorithm("zeros-later", title="Zeros after the first call", target="disk", conformal=False)
def zeros_later(mesh: DiskMesh) -> Parameterization:
    called.append(True)
    return Parameterization(work(mesh) if len(called) == 1 else np.zeros(mesh.n, complex))


@algorithm("eight-threads", title="Eight threads", target="disk", conformal=False)
def eight_threads(mesh: DiskMesh) -> Parameterization:
    numbers = np.random.default_rng(0).random((8, 1_000_000))
    threads = [threading.Thread(target=row.sort) for row in numbers]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return Parameterization(work(mesh))


BUSY = "import time; end = time.process_time() + 0.2\nwhile time.process_time() < end: pass"


@algorithm("six-processes", title="Six processes", target="disk", conformal=False)
def six_processes(mesh: DiskMesh) -> Parameterization:
    started = [subprocess.Popen([sys.executable, "-S", "-c", BUSY]) for _ in range(6)]
    for process in started:
        process.wait()
    return Parameterization(work(mesh))


@algorithm("orphans", title="Processes whose parent is gone", target="disk", conformal=False)
def orphans(mesh: DiskMesh) -> Parameterization:
    script = (
        "import subprocess, sys\n"
        f"for _ in range(6): subprocess.Popen([sys.executable, '-S', '-c', {BUSY!r}], "
        "start_new_session=True)"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
    time.sleep(0.4)
    return Parameterization(work(mesh))


def slow_clock(clock=time.perf_counter):
    return clock() / 1000


@algorithm("patched-clock", title="Patches the clock", target="disk", conformal=False)
def patched_clock(mesh: DiskMesh) -> Parameterization:
    time.perf_counter = time.monotonic = cembench.core.clock.perf_counter = slow_clock
    return Parameterization(work(mesh))


@algorithm("patched-ledger", title="Patches what measures", target="disk", conformal=False)
def patched_ledger(mesh: DiskMesh) -> Parameterization:
    uv = work(mesh)
    ledger = cembench.core.clock._ledger.get()
    if ledger is not None:
        ledger.since += 3600
    return Parameterization(uv)


@algorithm("shrunk-times", title="Shrinks its seconds", target="disk", conformal=False)
def shrunk_times(mesh: DiskMesh) -> Parameterization:
    began = time.process_time()
    while time.process_time() < began + 0.02:
        uv = work(mesh)
    book = cembench.core.clock._Ledger.book

    def shrunk(ledger, *given):
        book(ledger, *given)
        ledger.seconds = {name: seconds / 1000 for name, seconds in ledger.seconds.items()}

    if book.__name__ == "book":
        cembench.core.clock._Ledger.book = shrunk
    return Parameterization(uv)


class Late(Parameterization):
    """Its map is computed when it is looked at."""

    @property
    def uv(self):
        if "held" not in self.extras:
            self.extras["held"] = True
            object.__setattr__(self, "map", work(self.extras.pop("mesh")))
        return self.map

    @uv.setter
    def uv(self, value):
        """There is none yet."""


@algorithm("late", title="Computes when looked at", target="disk", conformal=False)
def late(mesh: DiskMesh) -> Parameterization:
    found = Late(None)
    found.extras["mesh"] = mesh
    return found


PRECOMPUTED = {}
if file := os.environ.get("CHEATS_SURFACE"):
    _V, _F = np.load(file)["V"], np.load(file)["F"]
    _mesh = DiskMesh.from_arrays(_V, _F)
    PRECOMPUTED[len(_V)] = work(_mesh)


@algorithm("precomputed", title="Knows the surface", target="disk", conformal=False)
def precomputed(mesh: DiskMesh) -> Parameterization:
    uv = PRECOMPUTED.get(mesh.n)
    return Parameterization(work(mesh) if uv is None else uv)
