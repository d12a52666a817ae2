"""How hard are the stand-ins, and which real surface is nearest to each row of the paper?"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
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
from cembench.running.surfaces import generate_surface

CEM_PAPER = find_paper("cem")
#: The algorithm by whose E_C difficulty is compared, the one that the paper prints it for.
MAPPED_BY = "cem"
LAYOUT = """
| row | triangles | E_C printed | stand-in: E_C, times printed | not Delaunay | obtuse \
| crowding | nearest real surface | triangles | boundary | E_C, times printed | not Delaunay \
| obtuse | crowding |
|---|---:|---:|---:|---:|---:|---:|---|---:|---:|---:|---:|---:|---:|
| {row} | {faces:,.0f} | {printed:.3g} | {s[ratio]:.2g} | {s[thin]:.1%} | {s[obtuse]:.1%} \
| {s[crowding]:.0f} | {name} | {r[faces]:,.0f} | {r[boundary]:,.0f} | {r[ratio]:.2g} \
| {r[thin]:.1%} | {r[obtuse]:.1%} | {r[crowding]:.0f} |"""
Facts = Mapping[str, float]


def nearest_real(sets: Sequence[str], *, made: bool = False) -> Section:
    """Find the real disk nearest to each row of the paper, in counts and in difficulty.

    Nearest by the logarithms of three ratios to what the paper prints: triangles, boundary
    vertices, and E_C of CEM. `sets` are folders of meshes, or names of sets (`corpus`,
    `real-disks`). Stand-ins are measured if they are kept, or all of them with `--made`, which
    makes them first.
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
    stand_ins = {row: facts(mesh, registry) for row, mesh in progress(list(kept(registry, made)))}
    own = {d.paper_row: d.name for d in registry.datasets.values() if d.paper_row}
    own = {row: name for row, name in own.items() if name in real}
    rows = []
    for row in CEM_PAPER.models:
        wanted, stand_in = printed(row), stand_ins.get(row)
        name = own.get(row) or min(real, key=lambda name: distance(real[name], wanted))
        rows.append(
            {
                "row": row,
                "faces": wanted["faces"],
                "printed": wanted["energy"],
                "name": name + " (the model)" * (row in own),
                "s": beside(stand_in, wanted),
                "r": beside(real.get(name), wanted),
            }
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


def beside(one: Facts | None, wanted: Mapping[str, float]) -> dict[str, float | None]:
    """Return a surface's figures with E_C over the printed one; None where it was not measured."""
    names = ("faces", "boundary", "thin", "obtuse", "crowding")
    ratio = one["energy"] / wanted["energy"] if one else None
    return {name: one[name] if one else None for name in names} | {"ratio": ratio}


def kept(registry: Registry, made: bool) -> Iterable[tuple[str, TriangleMesh]]:
    """Yield the stand-ins by the rows that they stand for."""
    for surface in registry.surfaces.values():
        there = surface.kept is not None and surface.kept(**surface.arguments({})).is_file()
        if surface.paper_row in CEM_PAPER.models and (made or there):
            yield surface.paper_row, generate_surface(registry, surface.name)
