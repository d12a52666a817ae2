"""By how much the capacities of holes differ from those of the circles of maps."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.holed_surfaces import holed_below
from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.conformal.certificate import HolesCertificate, certificate_of
from cembench.core.errors import AlgorithmFailed, NotPositiveDefinite
from cembench.mesh.triangle_mesh import HoledMesh
from cembench.registry import load_registry

ALGORITHMS = ("direct-cem-holes", "koebe-cem")
LAYOUT = f"""
| surface | triangles | holes | the bounds leave open | {
    " | ".join(f"`{name}`" for name in ALGORITHMS)
} |
|---|{"---:|" * (3 + len(ALGORITHMS))}
| {{surface}} | {{faces:,}} | {{holes}} | {{error}} | {
    " | ".join(f"{{off[{name}]}}" for name in ALGORITHMS)
} |"""


def hole_certificates(folders: Sequence[Path], *, faces: int = 50_000) -> Section:
    """Measure by how much the capacities of holes differ from those of a map's circles, in percent.

    All surfaces with holes below some folders, of no more than `faces` triangles. A map whose holes
    are not circles has no such figure. It is one of the circles alone: the map may have folds.
    """
    rows = [row(name, mesh) for name, mesh in progress(holed_below(folders, faces))]
    if not rows:
        raise SystemExit(f"no surface with holes is below {', '.join(map(str, folders))}.")
    return Section([Table(rows, LAYOUT)], "docs/theory.md")


def row(name: str, mesh: HoledMesh) -> dict[str, Any]:
    """Return what the bounds leave open, and how far each map's circles are off."""
    registry, off, error = load_registry(), {}, "-"
    for algorithm in map(registry.algorithm, ALGORITHMS):
        try:
            z = algorithm.function(mesh.fresh(), **algorithm.arguments({})).uv
            bounds = certificate_of(mesh, z, algorithm.target)
            assert isinstance(bounds, HolesCertificate)
            least, most = bounds.off(z[bounds.corners])
        except (AlgorithmFailed, NotPositiveDefinite):
            off[algorithm.name] = "none"
            continue
        error = percent(bounds.reciprocal_error)
        off[algorithm.name] = f"{percent(least)} to {percent(most)}"
    return {
        "surface": name,
        "faces": mesh.m,
        "holes": len(mesh.loops) - 1,
        "error": error,
        "off": off,
    }


def percent(share: float) -> str:
    """Return a share in percent with two digits.

    >>> percent(0.00123), percent(0.5678), percent(12.345), percent(-1e-15)
    ('0.12', '57', '1,234', '0.00')
    """
    number = 100 * max(share, 0.0)
    return f"{number:.2f}" if number < 1 else f"{number:.1f}" if number < 10 else f"{number:,.0f}"
