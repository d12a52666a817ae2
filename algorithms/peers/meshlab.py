"""MeshLab's parametrisations, through pymeshlab; it computes UVs in single precision."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Atlas, Parameterization
from cembench.core.program import Library
from cembench.mesh.soup import Soup, complex_of
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh
from cembench.mesh.uvs import uv_of_corners
from cembench.registry import algorithm

MESHLAB = Library("pymeshlab", "pymeshlab", circle=1e-6)


@algorithm(
    "meshlab-harmonic",
    title="Harmonic map of MeshLab",
    target="disk",
    source="compute_texcoord_parametrization_harmonic",
    library=MESHLAB,
)
def meshlab_harmonic(mesh: DiskMesh) -> Parameterization:
    """Map a disk by MeshLab's harmonic map."""
    return Parameterization(_of_vertices(mesh, "compute_texcoord_parametrization_harmonic"))


@algorithm(
    "meshlab-lscm",
    title="LSCM of MeshLab",
    target="free boundary",
    source="compute_texcoord_parametrization_least_squares_conformal_maps",
    library=MESHLAB,
)
def meshlab_lscm(mesh: DiskMesh) -> Parameterization:
    """Map a disk by MeshLab's least squares conformal map, with its own pins."""
    name = "compute_texcoord_parametrization_least_squares_conformal_maps"
    return Parameterization(_of_vertices(mesh, name))


@algorithm(
    "meshlab-voronoi",
    title="Voronoi atlas of MeshLab",
    target="atlas",
    source="generate_voronoi_atlas_parametrization",
    library=MESHLAB,
)
def meshlab_voronoi(
    mesh: TriangleMesh, *, regions: Annotated[int, Field(ge=1, le=1000)] = 10
) -> Atlas:
    """Map a surface by MeshLab's atlas of Voronoi regions."""
    meshes = _loaded(mesh)
    _apply(meshes, "generate_voronoi_atlas_parametrization", regionnum=regions)
    charts = meshes.mesh(meshes.mesh_number() - 1)  # the surface differs from the given one
    V, F = charts.vertex_matrix(), charts.face_matrix().astype(np.int64)
    if charts.has_wedge_tex_coord():
        uv, index = charts.wedge_tex_coord_matrix(), np.arange(F.size).reshape(-1, 3)
    else:
        uv, index = charts.vertex_tex_coord_matrix(), F
    return Atlas(uv_of_corners(Soup.of_triangles(V, F, complex_of(uv), index), mesh.V, mesh.F))


def _of_vertices(mesh: DiskMesh, name: str) -> NDArray[np.complex128]:
    meshes = _loaded(mesh)
    _apply(meshes, name)
    return complex_of(meshes.current_mesh().vertex_tex_coord_matrix())


def _loaded(mesh: TriangleMesh) -> Any:
    import pymeshlab

    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(mesh.V, mesh.F))
    return meshes


def _apply(meshes: Any, name: str, **parameters: Any) -> None:
    """Apply a MeshLab filter; its errors become those of an algorithm."""
    from pymeshlab.pmeshlab import PyMeshLabException

    try:
        getattr(meshes, name)(**parameters)
    except PyMeshLabException as error:
        raise AlgorithmFailed(f"MeshLab: {error}") from None
