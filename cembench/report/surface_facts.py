"""Facts of a registered surface: counts, metrics of its map, and a thumbnail.

For a registered surface that is kept on disk, its facts and a thumbnail are stored with it, so that
they are available at once the next time.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel

from cembench.conformal.metrics import all_metrics
from cembench.conformal.planar import signed_areas
from cembench.core.atomic import read_model, write_model
from cembench.core.errors import RecordError, RegistryError
from cembench.core.notices import NoticeKind, of_kind
from cembench.mesh.datasets import CACHE_VARIABLE
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.registry import Algorithm, Registry, Surface
from cembench.report.document import Plain, Table, missing, words
from cembench.report.given_tables import given_table
from cembench.results.papers import paper_of
from cembench.results.records import MeshFacts
from cembench.running.plan import mesh_facts, provenances
from cembench.running.sources import code_hash
from cembench.running.surfaces import generate_surface

#: The algorithm whose map measures how unevenly a surface is scaled.
MAPPED_BY = "cem"
#: Tolerance of a stand-in's counts, relative to its row.
FACES_OFF, BOUNDARY_OFF = 0.01, 0.10


class SurfaceFacts(BaseModel):
    """Facts of a surface at its own size, and of its conformal map to the disk."""

    mesh: MeshFacts
    mesh_hash: str
    #: Hash of the algorithm that made the map; facts by another version are not used.
    code_hash: str
    iterations: int | None
    #: Metrics of the map (cembench.conformal.metrics).
    metrics: dict[str, float | int]
    #: See :func:`factor_spans`.
    conformal_factor_span: float
    conformal_factor_span_99_8: float
    #: The PNG file with its picture.
    thumbnail: str


def kept_facts(registry: Registry, surface: Surface) -> SurfaceFacts | None:
    """Return the stored facts of this surface; None if there are none or they are out of date."""
    if surface.kept is None:
        return None
    place = _place(surface)
    if not place.is_file():
        return None
    try:
        facts = read_model(place, SurfaceFacts)
    except (RecordError, OSError):  # damaged, or from another version or user: compute again
        return None
    held = facts.code_hash == code_hash(_mapper(registry)) and Path(facts.thumbnail).is_file()
    return facts if held else None


def find_facts(registry: Registry, surface: Surface) -> SurfaceFacts:
    """Make a surface, map it, draw it, and store its facts.

    Raises
    ------
    RegistryError
        The surface is not kept on disk.
    RecordError
        The cache cannot be written.
    MeshError, AlgorithmFailed, RenderError
        The surface cannot be made, mapped, or drawn.
    """
    if surface.kept is None:
        raise RegistryError(
            f"surface {surface.name!r} is not stored on disk; declare it with "
            "@surface_family(..., kept=...)"
        )
    from cembench.drawing.preview import write_thumbnail  # slow to import, and seldom needed

    place, mapper = _place(surface), _mapper(registry)
    _check_writable(place.parent)
    mesh = generate_surface(registry, surface.name)
    mapped = mapper.function(mesh, **mapper.arguments({}))
    thumbnail = place.with_suffix(".png")
    write_thumbnail(mesh, mapped.uv, thumbnail)
    facts = SurfaceFacts(
        mesh=mesh_facts(mesh, **_standing(registry, surface)),
        mesh_hash=mesh.hash,
        code_hash=code_hash(mapper),
        iterations=mapped.iterations,
        metrics=all_metrics(mesh, mapped.uv),
        **factor_spans(mesh, mapped.uv),
        thumbnail=str(thumbnail),
    )
    write_model(place, facts)
    return facts


def factor_spans(mesh: TriangleMesh, uv: NDArray[np.complex128]) -> dict[str, float]:
    """Return how unevenly a map scales lengths: the largest over the smallest factor.

    The factor of a triangle is the square root of image area over surface area, a ratio of lengths.
    `conformal_factor_span` is the ratio of the extremes, `conformal_factor_span_99_8` that of the
    99.9 and 0.1 percentiles over the triangles.
    """
    image = np.abs(signed_areas(uv, mesh.F))
    p, q, r = (mesh.V[mesh.F[:, k]] for k in range(3))
    flat = np.linalg.norm(np.cross(q - p, r - p), axis=1) / 2
    factor = np.sqrt(np.maximum(image, 1e-300) / flat)
    low, high = np.percentile(factor, [0.1, 99.9])
    return {
        "conformal_factor_span": float(factor.max() / factor.min()),
        "conformal_factor_span_99_8": float(high / low),
    }


def row_check(mesh: MeshFacts) -> dict[str, Any] | None:
    """Return how well a surface matches the counts printed for its model; None without a row.

    Deviations are relative to the row's counts; a disk with V vertices and F triangles has
    2 V - F - 2 vertices on its boundary.
    """
    paper = paper_of(mesh.paper_row)
    vertices, faces = paper.count(mesh.paper_row, "vertices"), paper.faces(mesh.paper_row)
    if not vertices:
        return None
    boundary = 2 * vertices - faces - 2
    faces_off, boundary_off = mesh.faces / faces - 1, mesh.boundary_vertices / boundary - 1
    return {
        "row_faces": faces,
        "row_vertices": vertices,
        "row_boundary": boundary,
        "faces_off": faces_off,
        "boundary_off": boundary_off,
        "ok": abs(faces_off) <= FACES_OFF
        and abs(boundary_off) <= BOUNDARY_OFF
        and not of_kind(NoticeKind.DEFINITION_1, mesh.notices),
    }


def facts_table(known: Mapping[str, SurfaceFacts]) -> Table:
    """Return counts of surfaces, whether these are the paper's, and conformal-factor spans."""
    tones = {"ok": words("ok"), "off": words("off", "bad")}
    rows: list[list[Plain]] = []
    for name, facts in sorted(known.items(), key=lambda item: item[1].mesh.faces):
        mesh, check = facts.mesh, row_check(facts.mesh)
        verdict = missing("no row") if check is None else tones["ok" if check["ok"] else "off"]
        counts = mesh.vertices, mesh.faces, mesh.boundary_vertices, mesh.non_delaunay_share
        rows.append([name, *counts, facts.conformal_factor_span, verdict])
    folders = dict.fromkeys(str(Path(facts.thumbnail).parent) for facts in known.values())
    return given_table("surface-facts", rows, {"folders": ", ".join(folders)})


def _place(surface: Surface) -> Path:
    assert surface.kept is not None
    return surface.kept(**surface.arguments({})).with_suffix(".json")


def _check_writable(folder: Path) -> None:
    """Raise if the cache cannot be written, before minutes of work."""
    reason = "" if os.access(folder, os.W_OK) or not folder.exists() else "no permission"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
    if reason:
        raise RecordError(
            f"the cache {folder} cannot be written to: {reason}. Set {CACHE_VARIABLE} to another "
            "folder."
        )


def _mapper(registry: Registry) -> Algorithm:
    return registry.algorithm(MAPPED_BY)


def _standing(registry: Registry, surface: Surface) -> dict[str, Any]:
    known = provenances(registry, [surface.name])
    return {"standing": known[surface.name]} if known else {}
