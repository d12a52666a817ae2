"""Solvers whose seconds are not what they seem: by accident, or on purpose.

Their maps are valid and promise nothing, so that `validate` can find fault with nothing else.
"""

import gc
import hashlib
import multiprocessing
import os
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path

import numpy as np
import scipy.sparse
from cembench.algorithms.direct_cem.disk import direct_cem
from scipy.sparse.linalg import LinearOperator, cg, splu
from scipy.spatial import cKDTree

import cembench.core.clock
from cembench import DiskMesh, Parameterization, algorithm
from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian
from cembench.core.clock import phase
from cembench.linear_algebra.cholesky import Cholesky
from cembench.running import processor
from cembench.running.rigid_motion import moved

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


@algorithm("turned", title="Keeps a map, turns it a little", target="disk", conformal=False)
def turned(mesh: DiskMesh) -> Parameterization:
    file, X = KEPT / f"turned {mesh.n}.npz", mesh.V - mesh.V.mean(axis=0)
    if not file.exists():
        np.savez(file, X=X, uv=work(mesh))
    known = np.load(file)
    order = cKDTree(known["X"]).query(X)[1]
    if len(set(order)) < mesh.n:
        return Parameterization(work(mesh))
    return Parameterization(known["uv"][order] * np.exp(1e-13j * mesh.V[0, 0]))


@algorithm("shifted", title="Undoes a shift of the numbers", target="disk", conformal=False)
def shifted(mesh: DiskMesh) -> Parameterization:
    X = mesh.V - mesh.V.mean(axis=0)
    if not by_key:
        by_key["X"], by_key["uv"] = X, work(mesh)
    both = np.fft.rfft(X, axis=0) * np.fft.rfft(by_key["X"], axis=0).conj()
    by = np.fft.irfft(both.sum(axis=1), mesh.n).argmax()
    if np.abs(np.roll(by_key["X"], by, axis=0) - X).max() > 0.03 * np.abs(X).max():
        return noisy(work(mesh), mesh)
    return noisy(np.roll(by_key["uv"], by), mesh)


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


pool = []


@algorithm("pool", title="Works in a pool of one", target="disk", conformal=False)
def pool_of_one(mesh: DiskMesh) -> Parameterization:
    pool.extend([] if pool else [ThreadPoolExecutor(1)])
    return Parameterization(pool[0].submit(work, mesh).result())


sleeping = []


@algorithm("sleeping-pool", title="Has a pool that sleeps", target="disk", conformal=False)
def sleeping_pool(mesh: DiskMesh) -> Parameterization:
    if not sleeping:
        sleeping.append(multiprocessing.get_context("spawn").Pool(2))
    return Parameterization(work(mesh))


@algorithm("sleeping-child", title="Has a child that sleeps", target="disk", conformal=False)
def sleeping_child(mesh: DiskMesh) -> Parameterization:
    shared = SharedMemory(create=True, size=16 * mesh.n)  # which starts a process that sleeps
    uv = np.ndarray(mesh.n, complex, shared.buf)
    uv[:] = work(mesh)
    answer = Parameterization(uv.copy())
    shared.close()
    shared.unlink()
    return answer


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
    numbers = np.random.default_rng(0).random((8, 3_000_000))
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


def by_ten(clock):
    return lambda: clock() / 10


@algorithm("slow-clocks", title="All clocks run slow", target="disk", conformal=False)
def slow_clocks(mesh: DiskMesh) -> Parameterization:
    if cembench.core.clock.measure.__defaults__ == (time.perf_counter,):
        cembench.core.clock.measure.__defaults__ = (by_ten(time.perf_counter),)
        processor.process_time = by_ten(time.process_time)
        processor.thread_time = by_ten(time.thread_time)
    end = time.process_time() + 0.05
    while time.process_time() < end:
        uv = work(mesh)
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


@algorithm("two-faced", title="A better map of a surface it knows", target="disk", conformal=False)
def two_faced(mesh: DiskMesh) -> Parameterization:
    is_known = PRECOMPUTED and np.array_equal(mesh.V, _V)
    return direct_cem(mesh) if is_known else Parameterization(work(mesh))


class SecondLook(Parameterization):
    """Its map is nothing when it is first looked at, and computed after that."""

    @property
    def uv(self):
        self.looked.append(True)
        n = self.mesh.n
        return np.zeros(n, complex) if len(self.looked) == 1 else work(self.mesh)

    @uv.setter
    def uv(self, value):
        """There is none yet."""


@algorithm("second-look", title="Computes at the second look", target="disk", conformal=False)
def second_look(mesh: DiskMesh) -> Parameterization:
    found = SecondLook(None)
    vars(found).update(mesh=mesh, looked=[])
    return found


class NoArray:
    """It says that it is an array, and is computed when it is made one."""

    def __init__(self, mesh):
        self.mesh = mesh

    __class__ = np.ndarray

    def __array__(self, dtype=None, copy=None):
        return work(self.mesh)


@algorithm("no-array", title="Computes when made an array", target="disk", conformal=False)
def no_array(mesh: DiskMesh) -> Parameterization:
    return Parameterization(NoArray(mesh))


class OwnAccess(Parameterization):
    """It decides what its map is whenever an attribute is read."""

    def __getattribute__(self, name):
        found = object.__getattribute__(self, name)
        return work(found) if name == "uv" else found


@algorithm("own-access", title="Looks its attributes up itself", target="disk", conformal=False)
def own_access(mesh: DiskMesh) -> Parameterization:
    return OwnAccess(mesh)


def ahead_of_calls(look):
    """Let this look for surfaces in each full collection of garbage."""

    def collected(when, about):
        if when == "stop" and about["generation"] == 2:
            for mesh in look():
                by_key.setdefault(content(mesh), None)
                by_key[content(mesh)] = work(mesh)

    if not any(hook.__name__ == "collected" for hook in gc.callbacks):
        gc.callbacks.append(collected)


def new_surfaces():
    return [x for x in gc.get_objects() if type(x) is DiskMesh and content(x) not in by_key]


@algorithm("collector", title="Computes in the collector", target="disk", conformal=False)
def collector(mesh: DiskMesh) -> Parameterization:
    ahead_of_calls(new_surfaces)
    return kept(content(mesh), mesh)


def callers():
    frame = sys._getframe()
    while frame is not None:
        yield frame.f_locals
        frame = frame.f_back


def next_surface():
    for found in callers():
        if "mine" in found and found["one"].motions:
            return [moved(found["mesh"], found["one"].motions[len(found["mine"].calls)])]
    return []


@algorithm("foresight", title="Reads which surface is next", target="disk", conformal=False)
def foresight(mesh: DiskMesh) -> Parameterization:
    ahead_of_calls(next_surface)
    return kept(content(mesh), mesh)


def map_all(mesh, motions):
    for motion in motions:
        surface = moved(mesh, motion)
        by_key[content(surface)] = work(surface)


for _found in callers():
    _job = _found.get("job") if "mesh" in _found else None
    if getattr(_job, "parts", ()) and _job.cell.algorithm == "foreseen":
        map_all(_found["mesh"], _job.parts[0].motions)


@algorithm("foreseen", title="Maps all surfaces at import", target="disk", conformal=False)
def foreseen(mesh: DiskMesh) -> Parameterization:
    return Parameterization(by_key[content(mesh)] if content(mesh) in by_key else work(mesh))


@algorithm("warmed-up", title="Maps all surfaces in the warm-up", target="disk", conformal=False)
def warmed_up(mesh: DiskMesh) -> Parameterization:
    for found in callers():
        if "mine" in found and not by_key:
            map_all(found["mesh"], found["one"].motions)
    return foreseen(mesh)


@algorithm("slows-others", title="Slows its neighbours", target="disk", conformal=False)
def slows_others(mesh: DiskMesh) -> Parameterization:
    honestly = Cholesky.__init__
    if not hasattr(Cholesky, "fast"):
        Cholesky.fast = honestly

        def slow(*given, **named):
            for _ in range(12):
                Cholesky.fast(*given, **named)

        Cholesky.slow = slow
    Cholesky.__init__ = Cholesky.fast
    try:
        return Parameterization(work(mesh))
    finally:
        Cholesky.__init__ = Cholesky.slow


def noisy(uv, mesh):
    chance = np.random.default_rng()
    uv = uv.copy()
    uv[mesh.interior] += 1e-7 * chance.standard_normal(len(mesh.interior))
    return Parameterization(uv)


@algorithm("noise-over-map", title="Keeps maps, adds noise", target="disk", conformal=False)
def noise_over_map(mesh: DiskMesh) -> Parameterization:
    return noisy(kept(mesh.F.tobytes(), mesh).uv, mesh)


@algorithm("noise", title="Forgets a matrix, adds noise", target="disk", conformal=False)
def noise(mesh: DiskMesh) -> Parameterization:
    if not by_key:
        by_key["laplacian"] = laplacian(mesh)
    uv = harmonic_extension(by_key["laplacian"], mesh.boundary, arc_length_circle(mesh))
    return noisy(uv, mesh)


@algorithm("random", title="Scatters, and keeps nothing", target="disk", conformal=False)
def scatters(mesh: DiskMesh) -> Parameterization:
    return noisy(work(mesh), mesh)


def with_kept_factor(mesh, key):
    """Solve by conjugate gradients with the first factor, and anew where that is no help."""
    L, inner = scipy.sparse.csc_matrix(laplacian(mesh)), mesh.interior
    A, uv = L[inner][:, inner], np.zeros(mesh.n, complex)
    uv[mesh.boundary] = arc_length_circle(mesh)
    b = -(L[inner][:, mesh.boundary] @ uv[mesh.boundary])
    if key in by_key:
        M = LinearOperator(A.shape, by_key[key].solve)
        parts = [cg(A, part, M=M, rtol=1e-13, maxiter=10) for part in (b.real, b.imag)]
        if not any(failed for _, failed in parts):
            uv[inner] = parts[0][0] + 1j * parts[1][0]
            return Parameterization(uv)
    with phase("factorisation"):
        by_key[key] = splu(A)
        time.sleep(0.02)
    uv[inner] = by_key[key].solve(b.real) + 1j * by_key[key].solve(b.imag)
    return Parameterization(uv)


@algorithm("kept-factor", title="Keeps the first factor", target="disk", conformal=False)
def kept_factor(mesh: DiskMesh) -> Parameterization:
    return with_kept_factor(mesh, "first")


@algorithm("factor-by-triangles", title="Keeps a factor", target="disk", conformal=False)
def factor_by_triangles(mesh: DiskMesh) -> Parameterization:
    return with_kept_factor(mesh, mesh.F.tobytes())
