"""Disks by name: from files, and generated ones."""

from __future__ import annotations

from pathlib import Path

from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry
from cembench.running.surfaces import generate_surface


def disk_of(name: str) -> DiskMesh:
    """Return the disk in a mesh file, or the generated one that NAME@TRIANGLES names.

    >>> disk_of("flat-disk@600").m
    600
    """
    family, at, faces = name.rpartition("@")
    if at:
        mesh = generate_surface(load_registry(), family, int(faces))
        return DiskMesh.from_arrays(mesh.V, mesh.F, name=family)
    surface = read_mesh(name)
    return DiskMesh.from_arrays(surface.V, surface.F, name=Path(name).stem)
