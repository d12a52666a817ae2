"""What is called and on which surfaces: for asv and for pytest-benchmark alike.

The quick benchmarks always run; `CEMBENCH_TRACK=all` adds larger sizes and more kinds of surface.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from cembench.conformal.beltrami import (
    beltrami_coefficients,
    linear_beltrami_solver,
    weights_of_map,
)
from cembench.linear_algebra.cholesky import Cholesky
from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh
from cembench.conformal.metrics import all_metrics
from cembench.registry import load_registry

VARIABLE = "CEMBENCH_TRACK"

#: How jagged the boundaries of tracked surfaces are.
JAG = 0.5
#: A round surface, and a steep one whose map shrinks its middle.
DISKS = ("spherical-cap", "hemi-ellipsoid")
#: A long one, and one with corners.
MORE_DISKS = (*DISKS, "swiss-roll", "catenoid-sheet")
HOLED = ("catenoid-ring",)
MORE_HOLED = (*HOLED, "holed-cap")

#: Real disks, which are tracked where they are at hand: a scan of a face, and of a bust, of whose
#: edges 5 and 0.1 % are not Delaunay.
REAL = ("human_face.obj", "demosthenes.off")
#: Environment variable for their folder.
MESHES_VARIABLE = "CEMBENCH_TEST_MESHES"

FACES = (2_000, 20_000)
MORE_FACES = (*FACES, 80_000, 320_000)


def everything_is_asked_for() -> bool:
    """Shall the long benchmarks be there? asv would list them line by line as n/a otherwise."""
    return os.environ.get(VARIABLE) == "all"


@lru_cache(maxsize=4)
def surface(name: str, faces: int) -> TriangleMesh:
    """The surface of this name with about this many triangles; the same one at every call.

    Its boundary is as ragged as those of scans, where it can be.
    """
    family = load_registry().surface(name)
    harder = {"jag": JAG} if "jag" in {one.name for one in family.parameters} else {}
    mesh: TriangleMesh = family.function(**family.arguments({"faces": faces} | harder))
    return mesh


def real_disks() -> list[str]:
    """The names of the real disks that are at hand."""
    folder = os.environ.get(MESHES_VARIABLE)
    return [name for name in REAL if folder and (Path(folder) / name).is_file()]


@lru_cache(maxsize=2)
def real_disk(name: str) -> TriangleMesh:
    """The real disk of this name; the same one at every call."""
    return read_mesh(Path(os.environ[MESHES_VARIABLE]) / name)


def algorithm_names(mesh_type: type[TriangleMesh]) -> list[str]:
    """The usual algorithms that take this kind of surface."""
    algorithms = load_registry().algorithms.values()
    return sorted(a.name for a in algorithms if a.usual and issubclass(mesh_type, a.mesh_type))


def field_names() -> list[str]:
    """The other algorithms of the field that take a disk, which runs measure if they are named."""
    algorithms = load_registry().algorithms.values()
    choose = ("best", "best-holes")  # they call the others
    return sorted(
        a.name
        for a in algorithms
        if not a.usual and a.name not in choose and issubclass(DiskMesh, a.mesh_type)
    )


def mapping(algorithm: str, mesh: TriangleMesh) -> Callable[[], Any]:
    """A call of the algorithm with its defaults, from arrays in memory to the map."""
    spec = load_registry().algorithm(algorithm)
    arguments = spec.arguments({})
    return lambda: spec.function(mesh.fresh(), **arguments)


def kernels(mesh: DiskMesh) -> dict[str, Callable[[], Any]]:
    """The steps that the algorithms share, each ready to be called on this surface."""
    L = laplacian(mesh)
    interior = mesh.interior
    L_ii = L[interior][:, interior]
    factor = Cholesky(L_ii)
    right = np.random.default_rng(0).standard_normal((len(interior), 2)) @ [1, 1j]
    f_b = arc_length_circle(mesh)
    uv = harmonic_extension(L, mesh.boundary, f_b)
    weights = weights_of_map(uv, mesh.F, beltrami_coefficients(uv, mesh.F, mesh.V), mesh.V)
    return {
        "boundary_loops": lambda: mesh.fresh().loops,
        "laplacian": lambda: laplacian(mesh),
        "factorisation": lambda: Cholesky(L_ii),
        "solve": lambda: factor.solve(right),
        "beltrami_coefficients": lambda: beltrami_coefficients(uv, mesh.F, mesh.V),
        "linear_beltrami_solver": lambda: linear_beltrami_solver(
            mesh.F, weights, mesh.boundary, f_b
        ),
        "metrics": lambda: all_metrics(mesh, uv),
    }


#: Names of the kernels, in the order of a run.
KERNELS = tuple(kernels(surface("spherical-cap", 100)))
