"""How do CEM's figures on the stand-ins lie beside the printed ones?"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.conformal.metrics import all_metrics
from cembench.mesh.datasets import is_fetched
from cembench.mesh.files import read_mesh
from cembench.registry import Registry, load_registry
from cembench.report.surface_facts import factor_spans, find_facts, row_check
from cembench.results.papers import find_paper
from cembench.results.records import MeshFacts
from cembench.running.plan import mesh_facts, provenance_of

PAPER = find_paper("cem")
COUNTS = """
| surface | is | faces | boundary | row's faces | row's boundary | not Delaunay | span |
|---|---|---:|---:|---:|---:|---:|---:|
| {surface} | {origin} | {mesh.faces:,} | {mesh.boundary_vertices:,} | {row_faces:,} \
| {row_boundary:,} | {mesh.non_delaunay_share:.1%} | {span:.1e} |"""
FIGURES = """
| surface | is | iterations | E_C | mean | SD | folds | printed: iterations | E_C | mean | SD |
|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|
| {surface} | {origin} | {iterations} | {conformal_energy:.4f} | {angle_error_mean_deg:.2f} \
| {angle_error_sd_deg:.2f} | {flipped_triangles} | {printed[0]:.0f} | {printed[1]:.4f} \
| {printed[2]:.2f} | {printed[3]:.2f} |"""


def surfaces_page(*, mesh: Sequence[Path] = ()) -> Section:
    """Compare CEM's figures on the stand-ins with the printed ones.

    Maps all twenty stand-ins with CEM. A model of the paper that was fetched, or is named with
    --mesh, gets a line of its own.
    """
    registry = load_registry()
    fetched = [d.path for d in registry.datasets.values() if d.paper_row and is_fetched(d)]
    rows = in_order([*stand_ins(registry), *models(registry, [*mesh, *fetched])])
    parts = ["### Counts", Table(rows, COUNTS), "### CEM", Table(rows, FIGURES)]
    return Section(parts, "docs/surfaces.md")


def stand_ins(registry: Registry) -> Iterator[dict[str, Any]]:
    """Every surface that stands for a row of the paper, mapped anew."""
    surfaces = [one for one in registry.surfaces.values() if one.paper_row and one.kept]
    for surface in progress(surfaces):
        facts = find_facts(registry, surface)
        span = facts.conformal_factor_span
        yield row(surface.name, facts.mesh, facts.iterations, facts.metrics, span)


def models(registry: Registry, files: Iterable[Path]) -> Iterator[dict[str, Any]]:
    """The paper's own models among these files."""
    cem, seen = registry.algorithm("cem"), set[str]()
    for path in files:
        mesh = read_mesh(path)
        standing = provenance_of(registry, mesh)
        if standing.origin != "model":
            raise SystemExit(f"{path} is none of the paper's models; see `cembench fetch`.")
        if standing.paper_row in seen:
            continue
        seen.add(standing.paper_row)
        result = cem.function(mesh, **cem.arguments({}))
        span = factor_spans(mesh, result.uv)["conformal_factor_span"]
        facts, metrics = mesh_facts(mesh, standing), all_metrics(mesh, result.uv)
        yield row(mesh.name, facts, result.iterations, metrics, span)


def row(
    name: str,
    mesh: MeshFacts,
    iterations: int | None,
    metrics: Mapping[str, float | int],
    span: float,
) -> dict[str, Any]:
    """Return what a line of both tables needs of a measured surface."""
    check, model = row_check(mesh), mesh.paper_row
    assert check is not None
    first, third, fourth = (PAPER.tables[k][model] for k in (1, 3, 4))
    return {
        "surface": name,
        "origin": f"{'model' if mesh.origin == 'model' else 'stand-in for'} {model}",
        "mesh": mesh,
        "iterations": iterations,
        "span": span,
        **metrics,
        **check,
        "printed": (
            *(first["cem_iterations"], third["cem"], fourth["cem_mean"], fourth["cem_sd"]),
        ),
    }


def in_order(rows: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the rows in the order of the paper's, the stand-in before the model."""
    order = {model: k for k, model in enumerate(PAPER.models)}

    def place(one: dict[str, Any]) -> tuple[int, bool]:
        return order[one["mesh"].paper_row], one["mesh"].origin == "model"

    return sorted(rows, key=place)
