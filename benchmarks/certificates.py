"""How far maps are from the modulus of four boundary points."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.spherical_cap import spherical_cap

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.conformal.certificate import certify
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry

FACES = 6_144
MESHES = ("turtle.obj", "max_planck_head.ply")
ALGORITHMS = (
    *("direct-cem", "cetm", "bff", "qiem", "fdm", "ldm", "cem", "harmonic-circle"),
    "circle-packing",
)
LAYOUT = f"""
| surface | triangles | reciprocal error | {" | ".join(ALGORITHMS)} |
|---{"|---:" * (2 + len(ALGORITHMS))}|
| {{surface}} | {{faces:,}} | {{error:.3f}} | {
    " | ".join(f"{{off[{name}]}}" for name in ALGORITHMS)
} |"""


def certificates(folder: Path) -> Section:
    """Measure how far maps are from the modulus of four boundary points.

    Two closed forms and the real disks of a folder.
    """
    surfaces = {"spherical cap": spherical_cap(FACES), "half an ellipsoid": hemi_ellipsoid(FACES)}
    surfaces |= {Path(name).stem: read_mesh(folder / name, DiskMesh) for name in MESHES}
    rows = [row(name, surfaces[name]) for name in progress(surfaces)]
    return Section([Table(rows, LAYOUT)], "docs/theory.md")


def row(name: str, mesh: DiskMesh) -> dict[str, Any]:
    """Return each map's distance from the middle of the bounds."""
    registry, bounds = load_registry(), certify(mesh)
    off = {}
    for algorithm in map(registry.algorithm, ALGORITHMS):
        try:
            uv = algorithm.function(mesh, **algorithm.arguments({})).uv
            distance = abs(bounds.off(uv[bounds.corners]))
            off[algorithm.name] = f"{distance:.0e}".replace("e-0", "e-")
        except AlgorithmFailed:
            off[algorithm.name] = "failed"
    return {"surface": name, "faces": mesh.m, "error": bounds.reciprocal_error, "off": off}
