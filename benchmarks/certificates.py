"""How far maps are from the modulus of four boundary points. Fills a table of docs/theory.md.

Two closed forms and real disks::

    python -m benchmarks.certificates FOLDER_OF_MESHES
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.spherical_cap import spherical_cap

from benchmarks.pages import ROOT, fill
from cembench.conformal.certificate import certify
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.files import read_mesh
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry

PAGE = ROOT / "docs/theory.md"
FACES = 6_144
MESHES = ("turtle.obj", "max_planck_head.ply")
ALGORITHMS = (
    "direct-cem",
    "cetm",
    "bff",
    "qiem",
    "fdm",
    "ldm",
    "cem",
    "harmonic-circle",
    "circle-packing",
)


def main() -> None:
    """Map every surface by every algorithm, and write how far off its modulus is."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("meshes", type=Path, help="folder with the real disks")
    rows = [row(name, mesh) for name, mesh in surfaces(parser.parse_args().meshes)]
    titles = ["surface", "triangles", "reciprocal error", *ALGORITHMS]
    head = [f"| {' | '.join(titles)} |", f"|---{'|---:' * (len(titles) - 1)}|"]
    fill(PAGE, Path(__file__).stem, "\n".join([*head, *rows]))


def surfaces(folder: Path) -> Iterator[tuple[str, DiskMesh]]:
    """Give the two closed forms and the real disks with their names."""
    yield "spherical cap", spherical_cap(FACES)
    yield "half an ellipsoid", hemi_ellipsoid(FACES)
    for name in MESHES:
        yield Path(name).stem, read_mesh(folder / name, DiskMesh)


def row(name: str, mesh: DiskMesh) -> str:
    """Return a line of the table: each map's distance from the middle of the bounds."""
    registry, found = load_registry(), certify(mesh)
    cells = [name, f"{mesh.m:,}", f"{found.reciprocal_error:.3f}"]
    for algorithm in map(registry.algorithm, ALGORITHMS):
        try:
            uv = algorithm.function(mesh, **algorithm.arguments({})).uv
            cells.append(f"{abs(found.off(uv[found.corners])):.0e}".replace("e-0", "e-"))
        except AlgorithmFailed:
            cells.append("failed")
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
