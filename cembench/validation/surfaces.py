"""The small surfaces of the checks, with what is known of their maps.

They are taken from the registry by name, so a check only names the family it needs.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
from cembench.registry import Algorithm, ExactMap, Registry

#: Families whose map is known or whose energy tends to zero, with their numbers of triangles.
_REFINED: dict[type[TriangleMesh], dict[str, tuple[int, ...]]] = {
    DiskMesh: {"spherical-cap": (384, 1536, 6144), "hemi-ellipsoid": (384, 1536, 6144)},
    HoledMesh: {"catenoid-ring": (384, 1536, 6144), "holed-cap": (2000, 3000, 4500)},
}
#: Default disks of a comparison.
USUAL_DISKS = (
    *("hemi-ellipsoid", "catenoid-sheet", "cylinder-sheet", "cone"),
    *("cowboy-hat-stand-in", "nefertiti-stand-in"),
)
#: Default surfaces of the comparison: family and parameters.
_COMPARED: dict[type[TriangleMesh], tuple[tuple[str, dict[str, Any]], ...]] = {
    DiskMesh: tuple((name, {}) for name in USUAL_DISKS),
    HoledMesh: (
        ("catenoid-ring", {}),
        *(("holed-cap", {"holes": holes}) for holes in (1, 2, 3, 5, 8)),
    ),
}
#: Surfaces of the scaling stage.
_GROWING: dict[type[TriangleMesh], str] = {DiskMesh: "hemi-ellipsoid", HoledMesh: "catenoid-ring"}


@dataclass(frozen=True)
class RefinedSurface:
    """One surface in ever finer triangulations."""

    name: str
    meshes: tuple[TriangleMesh, ...]
    exact_map: ExactMap | None


def mesh_kind(algorithm: Algorithm) -> type[TriangleMesh]:
    """Return the kind of surface to test on; disks for an algorithm that takes any surface."""
    return HoledMesh if algorithm.mesh_type is HoledMesh else DiskMesh


def make(registry: Registry, name: str, faces: int, **parameters: Any) -> TriangleMesh:
    """Return a registered surface with about `faces` triangles."""
    family = registry.surface(name)
    mesh: TriangleMesh = family.function(**family.arguments({"faces": faces} | parameters))
    return mesh


def uneven(registry: Registry, kind: type[TriangleMesh]) -> TriangleMesh:
    """Return a surface without symmetry, so that no choice depends on rounding or numbering."""
    rng = np.random.default_rng(7)
    name = _GROWING[kind]
    mesh = make(registry, name, 1500)
    V = mesh.V + 0.01 * rng.standard_normal(mesh.V.shape)
    V[:, 2] += 0.3 * V[:, 0] ** 2 + 0.1 * V[:, 1]
    return kind.from_arrays(V, mesh.F, name=f"uneven {name}")


def awkward(registry: Registry, kind: type[TriangleMesh]) -> list[TriangleMesh]:
    """Return unusual but allowed surfaces."""
    if kind is HoledMesh:
        return [_slanted(make(registry, "catenoid-ring", 600), kind)]
    return [_fan(), _strip(), _slanted(make(registry, "hemi-ellipsoid", 600), kind)]


def refined(registry: Registry, kind: type[TriangleMesh]) -> list[RefinedSurface]:
    """Return the families on which errors must fall under refinement."""
    return [
        RefinedSurface(
            name,
            tuple(make(registry, name, faces) for faces in sizes),
            registry.surface(name).exact_map,
        )
        for name, sizes in _REFINED[kind].items()
    ]


def compared(registry: Registry, kind: type[TriangleMesh], faces: int) -> list[TriangleMesh]:
    """Return the default surfaces for quality and speed."""
    meshes = []
    for name, parameters in _COMPARED[kind]:
        mesh = make(registry, name, faces, **parameters)
        suffix = "".join(f"-{value}" for value in parameters.values())
        meshes.append(mesh.renamed(name + suffix))
    return meshes


def growing(
    registry: Registry, kind: type[TriangleMesh], sizes: tuple[int, ...]
) -> list[TriangleMesh]:
    """Return one surface in these sizes."""
    name = _GROWING[kind]
    meshes = [make(registry, name, faces) for faces in sizes]
    return [mesh.renamed(f"{name}-{mesh.m}") for mesh in meshes]


def moved(mesh: TriangleMesh) -> TriangleMesh:
    """Return the same surface rotated, shifted and 40 times as large."""
    Q, _ = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))
    Q *= np.sign(np.linalg.det(Q))
    V = 40 * mesh.V @ Q.T + [1, -2, 3]
    return type(mesh).from_arrays(V, mesh.F, name=f"{mesh.name}, moved")


def reshaped(mesh: TriangleMesh) -> TriangleMesh:
    """Return a surface of another shape with the same triangles."""
    return type(mesh).from_arrays(mesh.V * [1.0, 0.7, 1.5], mesh.F, name=f"{mesh.name}, reshaped")


def renumbered(mesh: TriangleMesh) -> tuple[TriangleMesh, NDArray[np.int64]]:
    """Return the surface with vertices, triangles and corners reordered, and the new numbers."""
    rng = np.random.default_rng(4)
    number = rng.permutation(mesh.n)
    V = np.empty_like(mesh.V)
    V[number] = mesh.V
    first = rng.integers(3, size=mesh.m)
    F = mesh.F[np.arange(mesh.m)[:, None], (first[:, None] + np.arange(3)) % 3]
    F = number[F][rng.permutation(mesh.m)]
    return type(mesh).from_arrays(V, F, name=f"{mesh.name}, renumbered"), number


def _fan() -> DiskMesh:
    """Return seven triangles around a single interior vertex."""
    angle = 2 * np.pi * np.arange(7) / 7
    rim = np.stack([np.cos(angle), np.sin(angle), 0.2 * np.cos(2 * angle)], axis=1)
    k = np.arange(7)
    F = np.stack([np.full(7, 7), k, (k + 1) % 7], axis=1)
    return DiskMesh.from_arrays(np.concatenate([rim, [[0, 0, 0.3]]]), F, name="fan")


def _strip() -> DiskMesh:
    """Return a row of triangles without an interior vertex."""
    k = np.arange(6)
    V = np.array([[j, i, 0.0] for i in range(2) for j in range(7)])
    F = np.concatenate([np.stack([k, k + 1, k + 8], axis=1), np.stack([k, k + 8, k + 7], axis=1)])
    return DiskMesh.from_arrays(V, F, name="strip")


def _slanted(mesh: TriangleMesh, kind: type[TriangleMesh]) -> TriangleMesh:
    """Return the surface sheared: many obtuse triangles, a tenth of the edges not Delaunay."""
    V = mesh.V @ np.array([[1.0, 0, 0], [1.0, 1, 0], [0, 0, 1]])
    return kind.from_arrays(V, mesh.F, name=f"slanted {mesh.name}")
