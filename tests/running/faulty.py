"""Algorithms that break each promise once."""

import os
import signal
import sys
import time

import numpy as np

from cembench import AlgorithmFailed, DiskMesh, Parameterization, algorithm
from cembench.geometry.harmonic import arc_length_circle, harmonic_extension
from cembench.geometry.laplacian import laplacian


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
