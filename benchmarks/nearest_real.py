"""Which real surface is nearest to a row of the paper whose model is not public?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import log, sqrt

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.api.sets import gathered, surfaces_of_set
from cembench.conformal.laplacian import non_delaunay_share
from cembench.conformal.metrics import all_metrics
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Registry, load_registry
from cembench.report.difficulty import boundary_crowding, shape
from cembench.results.papers import find_paper

CEM_PAPER = find_paper("cem")
#: The algorithm by whose E_C difficulty is compared, the one that the paper prints it for.
MAPPED_BY = "cem"
LAYOUT = """
| row | triangles | E_C printed | nearest real surface | triangles | boundary \
| E_C, times printed | not Delaunay | obtuse | crowding |
|---|---:|---:|---|---:|---:|---:|---:|---:|---:|
| {row} | {wanted[faces]:,.0f} | {wanted[energy]:.3g} | {name} | {r[faces]:,.0f} \
| {r[boundary]:,.0f} | {r[ratio]:.2g} | {r[thin]:.1%} | {r[obtuse]:.1%} | {r[crowding]:.0f} |"""
Facts = Mapping[str, float]


def nearest_real(sets: Sequence[str]) -> Section:
    """Find the real disk nearest to each row of the paper whose model is not public.

    Nearest by the logarithms of three ratios to what the paper prints: triangles, boundary
    vertices, and E_C of CEM, in counts and in difficulty. `sets` are folders of meshes, or names
    of sets (`corpus`, `real-disks`).
    """
    registry = load_registry()
    every = (one for name in sets for one in surfaces_of_set(name, registry))
    candidates = gathered(
        (one for one in every if one.mesh is None or not one.cut),
        registry,
        [registry.algorithm(MAPPED_BY)],
    )
    known = {d.mesh_hash: d.name for d in registry.datasets.values() if d.mesh_hash}
    meshes = [mesh.renamed(known.get(mesh.hash, mesh.name)) for mesh in candidates.meshes]
    real = {mesh.name: one for mesh in progress(meshes) if (one := facts(mesh, registry))}
    public = {d.paper_row for d in registry.datasets.values() if d.paper_row}
    rows = []
    for row in (model for model in CEM_PAPER.models if model not in public):
        wanted = printed(row)
        name = min(real, key=lambda name: distance(real[name], wanted))
        ratio = real[name]["energy"] / wanted["energy"]
        rows.append(
            {"row": row, "wanted": wanted, "name": name, "r": {**real[name], "ratio": ratio}}
        )
    about = (
        f"Nearest of {len(real)} real disks. Obtuse: triangles with an angle above 120 degrees. "
        "Crowding: the 99 over the 1 percentile of image length over length along the boundary, in "
        "the common gauge."
    )
    return Section([about, Table(rows, LAYOUT)], "docs/surfaces.md")


def printed(row: str) -> dict[str, float]:
    """Return what the paper prints of a model: triangles, boundary vertices, E_C of CEM."""
    faces, vertices = CEM_PAPER.faces(row), CEM_PAPER.count(row, "vertices")
    energy = CEM_PAPER.tables[3][row][MAPPED_BY]
    assert vertices is not None
    assert energy is not None
    return {"faces": faces, "boundary": 2 * vertices - faces - 2, "energy": energy}


def facts(mesh: TriangleMesh, registry: Registry) -> Facts | None:
    """Return counts and difficulty of a disk; None if it has no map."""
    mapper = registry.algorithm(MAPPED_BY)
    try:
        uv = mapper.function(mesh.fresh(), **mapper.arguments({})).uv
    except AlgorithmFailed:
        return None
    return {
        "faces": mesh.m,
        "boundary": len(mesh.loops[0]),
        "energy": float(all_metrics(mesh, uv)["conformal_energy"]),
        "thin": non_delaunay_share(mesh),
        "obtuse": shape(mesh).obtuse_share,
        "crowding": boundary_crowding(mesh, uv) or float("nan"),
    }


def distance(one: Facts, wanted: Mapping[str, float]) -> float:
    """Return how far a surface is from what is printed: the norm of the logarithms of ratios."""
    return sqrt(sum(log(max(one[key], 1e-12) / wanted[key]) ** 2 for key in wanted))
