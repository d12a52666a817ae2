"""How do CEM's figures on the stand-ins lie beside the printed ones? Fills docs/surfaces.md.

Maps all twenty stand-ins with CEM and writes the page's tables anew. A model of the paper that was
fetched, or is named with --mesh, gets a line of its own. --sheet draws the contact sheet instead::

    python -m benchmarks.surfaces_page
    python -m benchmarks.surfaces_page --mesh chinese_lion.mat
    python -m benchmarks.surfaces_page --sheet
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from cembench.surfaces.catalogue import stand_in
from cembench.surfaces.contact_sheet import contact_sheet
from cembench.surfaces.rows import ROWS

from benchmarks.pages import fill
from cembench.conformal.metrics import all_metrics
from cembench.mesh.datasets import is_fetched
from cembench.mesh.files import read_mesh
from cembench.registry import Registry, load_registry
from cembench.report.surface_facts import factor_spans, find_facts, row_check
from cembench.results.papers import find_paper
from cembench.results.records import MeshFacts
from cembench.running.plan import mesh_facts, paper_role_of

PAPER = find_paper("cem")
PAGE = Path(__file__).parents[1] / "docs/surfaces.md"
SHEET = Path(__file__).parents[1] / "reports/surfaces/contact_sheet.jpg"


@dataclass(frozen=True)
class Line:
    """A measured surface: what a line of both tables needs."""

    name: str
    mesh: MeshFacts
    iterations: int | None
    metrics: Mapping[str, float | int]
    span: float


def main() -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mesh", type=Path, action="append", default=[], help="a model's file")
    parser.add_argument("--sheet", action="store_true", help="draw the contact sheet, no more")
    chosen = parser.parse_args()
    registry = load_registry()
    if chosen.sheet:
        contact_sheet({name: stand_in(name) for name in ROWS}, SHEET)
        return
    fetched = [d.path for d in registry.datasets.values() if d.paper_row and is_fetched(d)]
    lines = [*stand_ins(registry), *models(registry, [*chosen.mesh, *fetched])]
    fill(PAGE, "surfaces_page", tables(lines))


def stand_ins(registry: Registry) -> Iterable[Line]:
    """Every surface that stands for a row of the paper, mapped anew."""
    for surface in registry.surfaces.values():
        if surface.paper_row and surface.kept:
            facts = find_facts(registry, surface)
            span = facts.conformal_factor_span
            yield Line(surface.name, facts.mesh, facts.iterations, facts.metrics, span)
            print(surface.name, flush=True)


def models(registry: Registry, files: Iterable[Path]) -> Iterable[Line]:
    """The paper's own models among these files."""
    cem, seen = registry.algorithm("cem"), set[str]()
    for path in files:
        mesh = read_mesh(path)
        standing = paper_role_of(registry, mesh)
        if standing.origin != "model":
            raise SystemExit(f"{path} is none of the paper's models; see `cembench fetch`.")
        if standing.paper_row in seen:
            continue
        seen.add(standing.paper_row)
        found = cem.function(mesh, **cem.arguments({}))
        span = factor_spans(mesh, found.uv)["conformal_factor_span"]
        facts, metrics = mesh_facts(mesh, standing), all_metrics(mesh, found.uv)
        yield Line(mesh.name, facts, found.iterations, metrics, span)


def tables(lines: Iterable[Line]) -> str:
    """Both tables in Markdown, in the order of the paper's rows, the stand-in first."""
    order = {model: k for k, model in enumerate(PAPER.models)}
    ordered = sorted(
        lines, key=lambda line: (order[line.mesh.paper_row], line.mesh.origin == "model")
    )
    counts = [
        "| surface | is | faces | boundary | row's faces | row's boundary | not Delaunay | span |",
        "|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    figures = [
        "| surface | is | iterations | E_C | mean | SD | folds "
        "| printed: iterations | E_C | mean | SD |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for line in ordered:
        mesh, found = line.mesh, line.metrics
        what = f"{'model' if mesh.origin == 'model' else 'stand-in for'} {mesh.paper_row}"
        check = row_check(mesh)
        assert check is not None
        counts.append(
            f"| {line.name} | {what} | {mesh.faces:,} | {mesh.boundary_vertices:,} "
            f"| {check['row_faces']:,} | {check['row_boundary']:,} "
            f"| {mesh.non_delaunay_share:.1%} | {line.span:.1e} |"
        )
        printed = (
            _shown(PAPER.tables[1][mesh.paper_row]["cem_iterations"], ".0f"),
            _shown(PAPER.tables[3][mesh.paper_row]["cem"], ".4f"),
            _shown(PAPER.tables[4][mesh.paper_row]["cem_mean"], ".2f"),
            _shown(PAPER.tables[4][mesh.paper_row]["cem_sd"], ".2f"),
        )
        figures.append(
            f"| {line.name} | {what} | {line.iterations} | {found['conformal_energy']:.4f} "
            f"| {found['angle_error_mean_deg']:.2f} | {found['angle_error_sd_deg']:.2f} "
            f"| {found['flipped_triangles']} | {' | '.join(printed)} |"
        )
    return "\n".join(["### Counts", "", *counts, "", "### CEM", "", *figures, ""])


def _shown(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)


if __name__ == "__main__":
    main()
