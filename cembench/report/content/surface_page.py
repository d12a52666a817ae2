"""The page of a surface: pictures of all algorithms, and all figures of merit."""

from __future__ import annotations

from cembench.report.content.evidence import Evidence, MeasuredSurface
from cembench.report.content.inspection import Inspection
from cembench.report.declared import declared_table
from cembench.report.declared_plots import declared_plot
from cembench.report.document import ORIGINS, Gallery, Gap, Item, Section, Table, Text
from cembench.report.plots import Plot


def surface_page(
    evidence: Evidence, surface: MeasuredSurface, seen: Inspection
) -> tuple[Section, Plot | None]:
    """Return the page without its plot, and the plot of angles, energies and phases, if any."""
    name = evidence.name_of(surface)
    items: list[Item] = [Text(_about(surface)), *notices(evidence, surface)]
    if seen.checkerboards:
        items.append(
            Gallery(
                f"{name}-maps",
                "The surface and its image by each algorithm, under one checkerboard",
                tuple(seen.checkerboards.values()),
                "Squares stay squares where a map is conformal. Squares that would be large on the "
                "surface are divided 3 by 3 in both panels. Folded triangles are red. Images are "
                "rotated to match the upright surface.",
                seen.scene,
            )
        )
    if seen.curvature and seen.mesh:
        items.append(
            Gallery(f"{name}-surface", "Mean curvature and mesh", (seen.curvature, seen.mesh))
        )
    if not seen.kept:
        command = "repeat the command of the run: it adds the surfaces and measures nothing twice"
        items.append(Gap("Pictures", f"{seen.missing_reason}.", command))
    items.append(figures_table(evidence, surface, name))
    section = Section(f"surface-{name}", surface.full_title, tuple(items), page=True)
    plot = declared_plot(
        evidence, "surface", seen={surface.mesh_hash: seen}, surface=surface, called=f"{name}-plots"
    )
    return section, plot


def _about(surface: MeasuredSurface) -> str:
    about = (
        f"{surface.vertices:,} vertices, {surface.faces:,} triangles, "
        f"{surface.boundary_vertices:,} boundary vertices; {surface.non_delaunay_share:.1%} of the "
        "interior edges are not Delaunay. "
    )
    if surface.paper_row and surface.origin == "stand-in":
        return about + f"{surface.name}: a stand-in for {surface.paper_row}, not the paper's model."
    kind = ORIGINS[surface.origin][0].removeprefix("measured here on ")
    return about + f"{surface.name}: {kind}."


def notices(evidence: Evidence, surface: MeasuredSurface) -> list[Text]:
    """Return the notices about the mesh."""
    record = next(r for r in evidence.records if r.cell.mesh_hash == surface.mesh_hash)
    return [Text(f"Note: {notice}.") for notice in record.mesh.notices]


def figures_table(evidence: Evidence, surface: MeasuredSurface, name: str) -> Table:
    """Return a table of all figures of merit on one surface, one row per cell."""
    keys = [r.cell.key for r in evidence.records if r.cell.mesh_hash == surface.mesh_hash]
    called = f"figures-{name}"
    table = declared_table(
        evidence, "figures", keys=keys, called=called, surface=surface.full_title
    )
    assert table is not None, "a surface has records"
    return table
