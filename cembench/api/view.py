"""An interactive page with a surface and its map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.metrics import METRICS, caption
from cembench.conformal.texel_density import ISLANDS, needs_islands
from cembench.drawing.preview import preview_png
from cembench.drawing.view_scene import ViewedMap, view_scene
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.report.render.view_page import view_page
from cembench.results.records import Outcome


def map_page(
    mesh: TriangleMesh, z: NDArray[np.complex128], outcome: Outcome, algorithm: str
) -> str:
    """Return the page of a map: a 3-D view, a picture for browsers without WebGL, the figures.

    z (n,) is the map, `algorithm` its algorithm's title; the HTML needs no other file.
    """
    title = f"{mesh.name}: {algorithm}"
    about = caption(outcome.metrics)
    line = about.replace("   ", " · ")
    scene = view_scene(mesh, [ViewedMap(algorithm, z, line)], mesh.name)
    facts = [("surface", f"{mesh.n:,} vertices, {mesh.m:,} triangles")]
    status = outcome.status + (f": {outcome.cause}" if outcome.cause else "")
    facts += [("status", status), *metric_facts(outcome)]
    facts += [("note", notice) for notice in notices_of(mesh, outcome)]
    return view_page(title, scene, preview_png(mesh, z, title=title, caption=about), facts)


def notices_of(mesh: TriangleMesh, outcome: Outcome) -> tuple[str, ...]:
    """Return the remarks on a surface and its map."""
    islands = (ISLANDS,) if outcome.status == "ok" and needs_islands(outcome.metrics) else ()
    return (*map(str, mesh.notices), *map(str, outcome.notes), *islands)


def metric_facts(outcome: Outcome) -> list[tuple[str, str]]:
    """Return the figures of a map as pairs of a title and a number with unit."""
    facts = [
        (metric.title, f"{metric.text(outcome.metrics[metric.name], precise=True)} {metric.unit}")
        for metric in METRICS
        if metric.name in outcome.metrics
    ]
    folded = outcome.folded_before_repair
    return facts if folded is None else [*facts, ("folded before repair", str(folded))]
