"""libigl, called through its Python binding: LSCM, the harmonic map, SLIM.

Its spectral conformal map is not in the binding.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Any

import numpy as np
import scipy
from numpy.typing import NDArray
from pydantic import Field

from cembench.conformal.free_boundary import two_distant_vertices
from cembench.conformal.harmonic import arc_length_circle
from cembench.conformal.planar import folded_triangles, polygon_area
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.core.program import Library
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

LIBIGL = Library("igl", "libigl")


@algorithm(
    "igl-lscm",
    title="LSCM of libigl",
    target="free boundary",
    source="Levy, Petitjean, Ray & Maillot 2002; igl::lscm",
    library=LIBIGL,
)
def igl_lscm(mesh: DiskMesh) -> Parameterization:
    """Map a disk by libigl's least squares conformal map, with the pins of `lscm`.

    As in `lscm`, the image is scaled to area pi. Folds remain.
    """
    import igl

    pins = two_distant_vertices(mesh)
    uv, _ = igl.lscm(mesh.V.copy(), mesh.F.copy(), pins, np.array([[-1.0, 0.0], [1.0, 0.0]]))
    return Parameterization(_of_area_pi(mesh, _complex(uv)), extras={"pins": pins.tolist()})


@algorithm(
    "igl-harmonic",
    title="Harmonic map of libigl",
    target="disk",
    source="igl::harmonic with igl::map_vertices_to_circle",
    library=LIBIGL,
)
def igl_harmonic(mesh: DiskMesh) -> Parameterization:
    """Map a disk by libigl's harmonic map, with the boundary spaced by arc length."""
    import igl

    b = mesh.boundary
    circle = igl.map_vertices_to_circle(np.asfortranarray(mesh.V), b.astype(np.int32))
    uv = _complex(igl.harmonic(mesh.V.copy(), mesh.F.copy(), b, np.ascontiguousarray(circle), 1))
    return Parameterization(uv)


class SlimEnergy(StrEnum):
    """Energies that SLIM can minimise."""

    symmetric_dirichlet = "symmetric_dirichlet"
    conformal = "conformal"
    arap = "arap"


@algorithm(
    "igl-slim",
    title="SLIM of libigl",
    target="free boundary",
    source="Rabinovich, Poranne, Panozzo & Sorkine-Hornung 2017; igl::slim",
    library=LIBIGL,
)
def igl_slim(
    mesh: DiskMesh,
    *,
    energy: SlimEnergy = SlimEnergy.symmetric_dirichlet,
    max_iterations: Annotated[int, Field(ge=1, le=10_000)] = 20,
) -> Parameterization:
    """Map a disk by libigl's SLIM, starting from the harmonic map.

    Its default energy, symmetric Dirichlet, measures isometry: lengths count as well as angles.
    Decided here: the start is the harmonic map by arc length, scaled to the surface's area, as in
    libigl's tutorial; if that has folds, Tutte's map.
    """
    import igl

    F = np.asfortranarray(mesh.F.astype(np.int32))
    b = mesh.boundary
    z = arc_length_circle(mesh)
    circle = np.stack([z.real, z.imag], axis=1)
    start = igl.harmonic(mesh.V.copy(), mesh.F.copy(), b, circle, 1)
    if len(folded_triangles(_complex(start), mesh.F)):
        start = _by_tutte(mesh, circle)
    area = 0.5 * float(igl.doublearea(mesh.V.copy(), mesh.F.copy()).sum())
    start = np.asfortranarray(start * np.sqrt(area / np.pi))
    kinds: Any = igl.MappingEnergyType
    kind = {
        SlimEnergy.symmetric_dirichlet: kinds.SYMMETRIC_DIRICHLET,
        SlimEnergy.conformal: kinds.CONFORMAL,
        SlimEnergy.arap: kinds.ARAP,
    }[energy]
    nothing = np.zeros(0, dtype=np.int32), np.zeros((0, 2), order="F")
    data = igl.slim_precompute(np.asfortranarray(mesh.V), F, start, kind, *nothing, 0.0)
    uv = igl.slim_solve(data, max_iterations)
    return Parameterization(_of_area_pi(mesh, _complex(uv[:, :2])), iterations=max_iterations)


def _by_tutte(mesh: DiskMesh, circle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the map (n, 2) in which each interior vertex is the mean of its neighbours."""
    import igl

    A = scipy.sparse.csr_array(igl.adjacency_matrix(mesh.F.copy()), dtype=np.float64)
    i, b = mesh.interior, mesh.boundary
    L = scipy.sparse.diags_array(np.asarray(A.sum(axis=1)).ravel()).tocsr() - A
    uv = np.empty((mesh.n, 2))
    uv[b] = circle
    uv[i] = Cholesky(scipy.sparse.csc_array(L[i][:, i])).solve(-(L[i][:, b] @ circle))
    return uv


def _complex(uv: NDArray[np.float64]) -> NDArray[np.complex128]:
    return np.ascontiguousarray(uv[:, 0] + 1j * uv[:, 1])


def _of_area_pi(mesh: DiskMesh, uv: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Scale a map so that its boundary encloses pi."""
    area = polygon_area(uv[mesh.boundary])
    if not area > 0:
        raise AlgorithmFailed(f"the image of the boundary encloses an area of {area:.3g}")
    return uv * np.sqrt(np.pi / area)
