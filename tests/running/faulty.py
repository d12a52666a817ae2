"""Algorithms that break each promise once."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
import warnings
from pathlib import Path

import numpy as np

from cembench import AlgorithmFailed, DiskMesh, Parameterization, algorithm
from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian


def good_map(mesh):
    return harmonic_extension(laplacian(mesh), mesh.boundary, arc_length_circle(mesh))


@algorithm("good", title="Good", target="disk")
def good(mesh: DiskMesh) -> Parameterization:
    return Parameterization(good_map(mesh), extras={"said": 1})


@algorithm("sleeps", title="Sleeps", target="disk")
def sleeps(mesh: DiskMesh) -> Parameterization:
    time.sleep(600)


@algorithm("segfaults", title="Segfaults", target="disk")
def segfaults(mesh: DiskMesh) -> Parameterization:
    os.kill(os.getpid(), signal.SIGSEGV)


@algorithm("exits", title="Exits", target="disk")
def exits(mesh: DiskMesh) -> Parameterization:
    sys.stderr.write("the last words\n")
    sys.stderr.flush()
    os._exit(7)


@algorithm("raises", title="Raises", target="disk")
def raises(mesh: DiskMesh) -> Parameterization:
    raise ZeroDivisionError("by nothing")


@algorithm("gives-up", title="Gives up", target="disk")
def gives_up(mesh: DiskMesh) -> Parameterization:
    raise AlgorithmFailed("it did not converge")


@algorithm("nan", title="NaN", target="disk")
def nan(mesh: DiskMesh) -> Parameterization:
    uv = good_map(mesh)
    uv[7] = np.nan
    return Parameterization(uv)


@algorithm("short", title="Short", target="disk")
def short(mesh: DiskMesh) -> Parameterization:
    return Parameterization(good_map(mesh)[:-1])


@algorithm("real", title="Real", target="disk")
def real(mesh: DiskMesh) -> Parameterization:
    return Parameterization(good_map(mesh).real)


@algorithm("nothing", title="Nothing", target="disk")
def nothing(mesh: DiskMesh) -> Parameterization:
    return None


@algorithm("mirrored", title="Mirrored", target="disk")
def mirrored(mesh: DiskMesh) -> Parameterization:
    return Parameterization(np.conj(good_map(mesh)))


@algorithm("off-circle", title="Off the circle", target="disk")
def off_circle(mesh: DiskMesh) -> Parameterization:
    return Parameterization(1.001 * good_map(mesh))


@algorithm("folded", title="Folded", target="disk")
def folded(mesh: DiskMesh) -> Parameterization:
    uv = good_map(mesh)
    inner = mesh.interior
    uv[inner] = uv[inner[::-1]]
    return Parameterization(uv)


@algorithm("writes", title="Writes to the mesh", target="disk")
def writes(mesh: DiskMesh) -> Parameterization:
    uv = good_map(mesh)
    mesh.V.setflags(write=True)
    mesh.V[0] += 1
    return Parameterization(uv)


@algorithm("spins", title="Spins in C", target="disk")
def spins(mesh: DiskMesh) -> Parameterization:
    re.match("(a|a)*b", "a" * 60)


@algorithm("hoards", title="Allocates without end", target="disk")
def hoards(mesh: DiskMesh) -> Parameterization:
    kept = []
    while True:
        kept.append(np.ones(2**20))


@algorithm("talks", title="Prints megabytes", target="disk")
def talks(mesh: DiskMesh) -> Parameterization:
    for _ in range(64):
        sys.stdout.write("la " * 2**18)
    sys.stdout.flush()
    return Parameterization(good_map(mesh))


@algorithm("talks-and-dies", title="Prints megabytes and dies", target="disk")
def talks_and_dies(mesh: DiskMesh) -> Parameterization:
    talks(mesh)
    sys.stdout.write("\nthe last words\n")
    sys.stdout.flush()
    os._exit(7)


def leave_a_child(**how):
    return subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"], **how).pid


def note_child(pid):
    if file := os.environ.get("FAULTY_CHILDREN"):
        with open(file, "a", encoding="utf-8") as noted:  # noqa: PTH123
            noted.write(f"{pid} ")


@algorithm("forks", title="Leaves a child", target="disk")
def forks(mesh: DiskMesh) -> Parameterization:
    return Parameterization(good_map(mesh), extras={"child": leave_a_child()})


@algorithm("detaches", title="Leaves a child in a session of its own", target="disk")
def detaches(mesh: DiskMesh) -> Parameterization:
    child = leave_a_child(start_new_session=True)
    return Parameterization(good_map(mesh), extras={"child": child})


@algorithm("detaches-twice", title="Leaves the child of a child that is gone", target="disk")
def detaches_twice(mesh: DiskMesh) -> Parameterization:
    script = (
        "import subprocess, sys;"
        "print(subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'],"
        "start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).pid)"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True)
    note_child(int(run.stdout))
    return Parameterization(good_map(mesh), extras={"child": int(run.stdout)})


@algorithm("hoards-in-a-child", title="A child allocates without end", target="disk")
def hoards_in_a_child(mesh: DiskMesh) -> Parameterization:
    script = "kept = []\nwhile True: kept.append(b'x' * 2**22)"
    subprocess.run([sys.executable, "-c", script], check=True)
    return Parameterization(good_map(mesh))


@algorithm("by-chance", title="By chance", target="disk")
def by_chance(mesh: DiskMesh) -> Parameterization:
    turn = np.exp(1j * np.random.default_rng().uniform())
    return Parameterization(turn * good_map(mesh))


@algorithm("fails-later", title="Fails when called again", target="disk")
def fails_later(mesh: DiskMesh) -> Parameterization:
    if later:
        raise ZeroDivisionError("by habit")
    later.append(True)
    return Parameterization(good_map(mesh))


later = []


@algorithm("daemonises", title="Leaves a copy of itself in a session of its own", target="disk")
def daemonises(mesh: DiskMesh) -> Parameterization:
    told, tell = os.pipe()
    first = os.fork()
    if not first:
        os.setsid()
        second = os.fork()
        if not second:
            time.sleep(600)
        os.write(tell, str(second).encode())
        os._exit(0)
    os.waitpid(first, 0)
    child = int(os.read(told, 20))
    note_child(child)
    return Parameterization(good_map(mesh), extras={"child": child})


HOPS = """
import os, resource, sys, time
resource.setrlimit(resource.RLIMIT_MSGQUEUE, (1, 1))
end = time.monotonic() + 30
while time.monotonic() < end:
    with open(sys.argv[1], "a") as file:
        print(os.getpid(), file=file)
    time.sleep(0.005)
    if os.fork():
        os._exit(0)
"""


@algorithm("hops", title="Leaves a process without a mark that is ever another one", target="disk")
def hops(mesh: DiskMesh) -> Parameterization:
    file = Path(os.environ["FAULTY_CHILDREN"])
    command = [sys.executable, "-S", "-c", HOPS, file]
    subprocess.Popen(command, env={}, start_new_session=True)
    while not file.exists() or len(file.read_text(encoding="utf-8").split()) < 5:
        time.sleep(0.01)
    return Parameterization(good_map(mesh))


@algorithm("draws", title="Draws from the global generator", target="disk")
def draws(mesh: DiskMesh) -> Parameterization:
    turn = np.exp(1j * np.random.rand())  # noqa: NPY002
    return Parameterization(turn * good_map(mesh))


@algorithm("kills-its-parent", title="Kills what started it", target="disk")
def kills_its_parent(mesh: DiskMesh) -> Parameterization:
    if not sys.argv[0].endswith("worker.py"):
        os.kill(os.getppid(), signal.SIGKILL)
        time.sleep(600)
    return Parameterization(good_map(mesh))


@algorithm("tells-where", title="Tells of its process", target="disk")
def tells_where(mesh: DiskMesh) -> Parameterization:
    raise AlgorithmFailed(
        f"{os.environ['GLIBC_TUNABLES']} {sys.argv[0]} {os.environ['OMP_NUM_THREADS']} "
        f"{os.getpgid(0) == os.getpid()} "
        f"{sorted(name for name in sys.modules if name.startswith('algorithms.'))} {len(later)}"
    )


def flat(mesh):
    return mesh.V[:, 0] + 1j * mesh.V[:, 1]


@algorithm("wound-twice", title="Covers the disk twice", target="disk")
def wound_twice(mesh: DiskMesh) -> Parameterization:
    z = flat(mesh)
    return Parameterization(z**2 / np.maximum(abs(z), 1e-300))


@algorithm("zeros-later", title="Zeros when called again", target="disk")
def zeros_later(mesh: DiskMesh) -> Parameterization:
    uv = good_map(mesh) * (not later)
    later.append(True)
    return Parameterization(uv)


@algorithm("worse-later", title="A worse map when called again", target="disk")
def worse_later(mesh: DiskMesh) -> Parameterization:
    uv = good_map(mesh)
    uv[mesh.interior] *= 0.99 if later else 1.0
    later.append(True)
    return Parameterization(uv)


@algorithm("raises-real-time-signal", title="Ends by a real-time signal", target="disk")
def raises_real_time_signal(mesh: DiskMesh) -> Parameterization:
    os.kill(os.getpid(), signal.SIGRTMIN + 3)


@algorithm("removes-scratch", title="Removes the folder of the answer", target="disk")
def removes_scratch(mesh: DiskMesh) -> Parameterization:
    shutil.rmtree(scratch())
    return Parameterization(good_map(mesh))


@algorithm("replaces-scratch", title="Puts a file in its place", target="disk")
def replaces_scratch(mesh: DiskMesh) -> Parameterization:
    shutil.rmtree(scratch())
    scratch().write_text("mine")
    return Parameterization(good_map(mesh))


@algorithm("spoils-meshes", title="Writes to the mesh files of all", target="disk")
def spoils_meshes(mesh: DiskMesh) -> Parameterization:
    for file in scratch().glob("*-V.npy"):
        np.save(file, 2 * mesh.V)
    return Parameterization(good_map(mesh))


@algorithm("answers-itself", title="Writes the answer itself", target="disk")
def answers_itself(mesh: DiskMesh) -> Parameterization:
    (scratch() / "answer.json").write_text('{"outcome": {"status": "splendid"}}')
    os._exit(0)


@algorithm("answers-at-length", title="Writes an endless answer", target="disk")
def answers_at_length(mesh: DiskMesh) -> Parameterization:
    (scratch() / "answer.json").write_bytes(b" " * 2**25)
    os._exit(0)


@algorithm("moves-away", title="Changes its folder and closes its output", target="disk")
def moves_away(mesh: DiskMesh) -> Parameterization:
    os.chdir("/")
    sys.stdout = None
    warnings.simplefilter("error")
    np.seterr(all="raise")
    return Parameterization(good_map(mesh))


@algorithm("exits-politely", title="Calls sys.exit", target="disk")
def exits_politely(mesh: DiskMesh) -> Parameterization:
    sys.exit(0)


def scratch():
    """The folder of the answer, as a started worker or a forked process knows it."""
    frame = sys._getframe()
    while "job" not in frame.f_locals:
        frame = frame.f_back
    return frame.f_locals["job"].answer_file.parent
