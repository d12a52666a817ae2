"""Solvers that are right but for one fault each, named by the check that has to catch it."""

import time
from typing import Annotated

import numpy as np
from cembench.algorithms.cem import cem
from cembench.algorithms.direct_cem.holes import direct_cem_holes
from cembench.algorithms.harmonic_filled import harmonic_filled
from pydantic import Field

from cembench import AlgorithmFailed, DiskMesh, HoledMesh, Parameterization, algorithm
from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian
from cembench.conformal.planar import signed_areas
from cembench.linear_algebra import cholesky


def right(mesh):
    return cem(mesh).uv.copy()


def harmonic(mesh, f_b):
    return harmonic_extension(laplacian(mesh), mesh.boundary, f_b)


@algorithm("good-when-small", title="Another method for large surfaces", target="disk")
def good_when_small(mesh: DiskMesh) -> Parameterization:
    if mesh.m < 6500:
        return cem(mesh)
    return Parameterization(harmonic(mesh, arc_length_circle(mesh)))


@algorithm("round-when-small", title="Rounds small holes alone", target="circular holes")
def round_when_small(mesh: HoledMesh) -> Parameterization:
    uv = direct_cem_holes(mesh).uv.copy()
    hole = min(mesh.loops, key=lambda loop: float(np.abs(uv[loop] - uv[loop].mean()).max()))
    if mesh.m > 4700 and len(mesh.loops) > 2:
        uv[hole] += 0.005 * (uv[hole] - uv[hole].mean()).conj()
    return Parameterization(uv)


@algorithm("right", title="Right", target="disk")
def right_one(mesh: DiskMesh) -> Parameterization:
    return cem(mesh)


@algorithm("not-round", title="Leaves holes as they come", target="circular holes")
def not_round(mesh: HoledMesh) -> Parameterization:
    return harmonic_filled(mesh)


@algorithm("not-combinatorial", title="Declares what is not so", target="disk", combinatorial=True)
def not_combinatorial(mesh: DiskMesh) -> Parameterization:
    return cem(mesh)


@algorithm("parameters", title="Its default is out of range", target="disk")
def default_out_of_range(
    mesh: DiskMesh, *, steps: Annotated[int, Field(ge=1)] = 0
) -> Parameterization:
    return Parameterization(right(mesh))


@algorithm("real", title="Real instead of complex", target="disk")
def real(mesh: DiskMesh) -> Parameterization:
    return Parameterization(right(mesh).real)


@algorithm("columns", title="Two columns instead of complex", target="disk")
def columns(mesh: DiskMesh) -> Parameterization:
    uv = right(mesh)
    return Parameterization(np.stack([uv.real, uv.imag], axis=1))


@algorithm("single", title="Single precision", target="disk")
def single(mesh: DiskMesh) -> Parameterization:
    return Parameterization(right(mesh).astype(np.complex64))


@algorithm("writes", title="Centres the mesh it was given", target="disk")
def writes(mesh: DiskMesh) -> Parameterization:
    uv = right(mesh)
    mesh.V.setflags(write=True)
    mesh.V[:] -= mesh.V.mean(axis=0)
    return Parameterization(uv)


@algorithm("boasts", title="Reports half of its energy", target="disk")
def boasts(mesh: DiskMesh) -> Parameterization:
    result = cem(mesh)
    half = tuple(energy / 2 for energy in result.energy_history)
    return Parameterization(result.uv, result.iterations, half)


@algorithm("miscounts", title="Reports fewer iterations than energies", target="disk")
def miscounts(mesh: DiskMesh) -> Parameterization:
    result = cem(mesh)
    return Parameterization(result.uv, 1, result.energy_history)


@algorithm("by-chance", title="Random without a seed", target="disk")
def by_chance(mesh: DiskMesh) -> Parameterization:
    return Parameterization(right(mesh) * np.exp(2j * np.pi * np.random.default_rng().random()))


@algorithm("remembers", title="Turns further with every call", target="disk")
def remembers(mesh: DiskMesh) -> Parameterization:
    calls.append(mesh.n)
    return Parameterization(right(mesh) * np.exp(1j * (len(calls) - 1)))


calls = []


@algorithm("nan-sometimes", title="NaN on small meshes", target="disk")
def nan_sometimes(mesh: DiskMesh) -> Parameterization:
    uv = right(mesh)
    if mesh.n < 500:
        uv[:] = np.nan
    return Parameterization(uv)


@algorithm("crashes-without-interior", title="Crashes without interior", target="disk")
def crashes_without_interior(mesh: DiskMesh) -> Parameterization:
    mesh.interior[0]
    return Parameterization(right(mesh))


@algorithm("mirrored", title="Mirrored", target="disk")
def mirrored(mesh: DiskMesh) -> Parameterization:
    return Parameterization(np.conj(right(mesh)))


@algorithm("point", title="All in one point", target="disk")
def point(mesh: DiskMesh) -> Parameterization:
    return Parameterization(np.zeros(mesh.n, complex))


@algorithm("off-circle", title="A thousandth off the circle", target="disk")
def off_circle(mesh: DiskMesh) -> Parameterization:
    return Parameterization(1.001 * right(mesh))


@algorithm("fold", title="One fold", target="disk")
def fold(mesh: DiskMesh) -> Parameterization:
    """Moves the vertex nearest to the middle of the disk a little over the edge opposite."""
    uv = right(mesh)
    inner = mesh.interior[np.argmin(np.abs(uv[mesh.interior] - 0.3))]
    star = mesh.F[(inner == mesh.F).any(axis=1)]
    one = star[np.argmin(np.abs(uv[star].mean(axis=1)))]
    others = one[one != inner]
    step = uv[others].mean() - uv[inner]
    for length in np.arange(0.1, 3.0, 0.1):
        moved = uv.copy()
        moved[inner] += length * step
        if np.count_nonzero(signed_areas(moved, mesh.F) <= 0):
            return Parameterization(moved)
    raise AlgorithmFailed("no fold was found")


@algorithm("by-number", title="Bends the circle at vertex number 0", target="disk")
def by_number(mesh: DiskMesh) -> Parameterization:
    uv = right(mesh)
    f_b = uv[mesh.boundary]
    apex = uv[0] / max(abs(uv[0]), 1e-3)
    bent = f_b * np.exp(0.003j * (f_b * np.conj(apex)).imag ** 3)
    return Parameterization(harmonic(mesh, bent))


@algorithm("by-axis", title="Bends the circle along the x axis", target="disk")
def by_axis(mesh: DiskMesh) -> Parameterization:
    f_b = right(mesh)[mesh.boundary]
    x = mesh.V[mesh.boundary, 0]
    return Parameterization(harmonic(mesh, f_b * np.exp(0.003j * np.tanh(x))))


@algorithm("backslash", title="Wrong where factors are not kept", target="disk")
def wrong_under_backslash(mesh: DiskMesh) -> Parameterization:
    uv = right(mesh)
    if cholesky._current.get().solves == "backslash":
        uv *= np.exp(1e-6j)
    return Parameterization(uv)


@algorithm("noise", title="Noise of a thousandth", target="disk")
def noise(mesh: DiskMesh) -> Parameterization:
    """Made of what neither numbering nor motion changes, so that only the rates tell."""
    uv = right(mesh)
    radius = np.abs(uv[mesh.interior])
    uv[mesh.interior] *= 1 + 0.005 * np.cos(1e4 * radius**2) * (1 - radius**2)
    return Parameterization(uv)


@algorithm("not-conformal", title="Harmonic from the circle by arc length", target="disk")
def not_conformal(mesh: DiskMesh) -> Parameterization:
    return Parameterization(harmonic(mesh, arc_length_circle(mesh)))


@algorithm("other-limit", title="Conformal inside, the middle pulled out", target="disk")
def other_limit(mesh: DiskMesh) -> Parameterization:
    """A smooth map of the disk to itself that is no Moebius map."""
    uv = right(mesh)
    return Parameterization(uv * np.exp(0.5j * (np.abs(uv) ** 2 - 1)))


@algorithm("quadratic", title="Compares every vertex with every other", target="disk")
def quadratic(mesh: DiskMesh) -> Parameterization:
    uv = right(mesh)
    for points in 8 * np.array_split(mesh.V, mesh.n // 8 + 1):
        np.cos(mesh.V @ points.T).max()
    return Parameterization(uv)


@algorithm("folds-sometimes", title="Gives up on one surface, folds on another", target="disk")
def folds_sometimes(mesh: DiskMesh) -> Parameterization:
    if mesh.name == "cone":
        raise AlgorithmFailed("no cones")
    return fold(mesh) if mesh.name == "flat-disk" else right_one(mesh)


@algorithm("crashes-on-large", title="Crashes on large surfaces", target="disk")
def crashes_on_large(mesh: DiskMesh) -> Parameterization:
    if mesh.m > 7000:
        raise IndexError("too large")
    return right_one(mesh)


@algorithm("hangs", title="Never ends", target="disk")
def hangs(mesh: DiskMesh) -> Parameterization:
    time.sleep(600)
    return right_one(mesh)
