"""A program that maps a flat disk by its own coordinates, or breaks one promise: MODE IN OUT."""

import gzip
import hashlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path


def main(mode, given, left, *more):
    if mode == "slow-start":
        time.sleep(0.2)
    V, F = read(given)
    uv = [(x, y) for x, y, _ in V]
    match mode:
        case "hangs":
            child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
            Path(more[0]).write_text(f"{os.getpid()} {child.pid}", encoding="utf-8")
            time.sleep(600)
        case "hogs":
            kept = []
            while True:
                kept.append(b"x" * 2**25)
                time.sleep(0.02)
        case "leaves":
            subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        case "segfaults":
            os.kill(os.getpid(), signal.SIGSEGV)
        case "refuses":
            sys.exit("this surface is not for me")
        case "nothing":
            return
        case "elsewhere":
            left = Path(left).with_name("result.obj")
        case "empty":
            Path(left).touch()
            return
        case "noise":
            Path(left).write_bytes(bytes(range(256)) * 100)
            return
        case "gzip":
            Path(left).write_bytes(gzip.compress(Path(given).read_bytes()))
            return
        case "text":
            Path(left).write_text("".join(f"{x!r} {y!r}\n" for x, y in uv), encoding="utf-8")
            return
        case "large":
            Path(left).write_bytes(b"# " + b"x" * 100_000_000)
            return
        case "talks":
            for _ in range(1000):
                print("x" * 100_000)
        case "other-vertices":
            V = [(x + 0.1, y, z) for x, y, z in V]
        case "other-triangles":
            F = [F[-1], *F[:-2], F[0]]
        case "nan":
            uv[7] = (float("nan"), 0.0)
        case "folded":
            inner = min(range(len(uv)), key=lambda k: uv[k][0] ** 2 + uv[k][1] ** 2)
            uv[inner] = (0.9, 0.0)
        case "mirrored":
            uv = [(x, -y) for x, y in uv]
        case "six-digits":
            uv = [(round(x, 6), round(y, 6)) for x, y in uv]
        case "keeps":
            kept = Path(more[0]) / f"kept-{hashlib.sha256(str(F).encode()).hexdigest()}"
            if not kept.exists():
                time.sleep(0.3)
                kept.touch()
            uv = on_the_disk(V)
        case "normalised":
            uv = on_the_disk(V)
        case "unit-square":
            uv = [((x + 1) / 2, (y + 1) / 2) for x, y in uv]
        case "too-many":
            F = [*F, F[0]]
    write(left, V, uv, F, mode)
    if mode == "truncated":
        os.truncate(left, Path(left).stat().st_size * 2 // 3)
    print("solve: 0.125 s")
    if mode == "boasts":
        print("solve: 1e6 s")


def on_the_disk(V):
    """The flat disk in the unit disk, wherever it lies."""
    z = [complex(x, y) for x, y, _ in V]
    middle = sum(z) / len(z)
    z = [one - middle for one in z]
    most = max(map(abs, z))
    z = [one / abs(one) if abs(one) > 0.99 * most else one / most for one in z]
    return [(one.real, one.imag) for one in z]


def read(path):
    V, F = [], []
    for line in Path(path).read_text(encoding="utf-8").splitlines():
        words = line.split()
        if words[0] == "v":
            V.append(tuple(map(float, words[1:4])))
        elif words[0] == "f":
            F.append([int(word.split("/")[0]) - 1 for word in words[1:]])
    return V, F


def write(path, V, uv, F, mode):
    uvs = list(uv)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in V]
    faces = []
    for number, face in enumerate(F):
        moved = mode == "cut" and number == 0
        uvs += [(u + 5, v) for u, v in (uv[i] for i in face)] if moved else []
        at = len(uvs) - 3 if moved else None
        corners = [(i, at + k if moved else i) for k, i in enumerate(face)]
        faces.append("f " + " ".join(f"{v + 1}/{t + 1}" for v, t in corners))
    lines += [] if mode == "no-uv" else [f"vt {u!r} {v!r}" for u, v in uvs]
    Path(path).write_text("\n".join([*lines, *faces]) + "\n", encoding="utf-8")


main(*sys.argv[1:])
