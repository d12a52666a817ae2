"""A page on which a surface and its map can be turned."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.metrics import METRICS, caption
from cembench.drawing.preview import preview_png
from cembench.drawing.view_scene import ViewedMap, view_scene
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.report.render.view_page import view_page
from cembench.results.records import Outcome


def map_page(
    mesh: TriangleMesh,
    z: NDArray[np.complex128],
    outcome: Outcome,
    algorithm: str,
    notices: Sequence[str] = (),
) -> str:
    """Compose the page of one map: the view, a picture for browsers without WebGL, the figures.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    z : complex128 (n,)
        Its map.
    outcome : Outcome
        What the check found.
    algorithm : str
        The title of what mapped it.
    notices : sequence of str
        What a reader should know.

    Returns
    -------
    str
        HTML that asks for no other file.

    """
    title = f"{mesh.name}: {algorithm}"
    about = caption(outcome.metrics)
    line = about.replace("   ", " · ")
    scene = view_scene(mesh, [ViewedMap(algorithm, z, line)], mesh.name)
    facts = [("surface", f"{mesh.n:,} vertices, {mesh.m:,} triangles")]
    status = outcome.status + (f": {outcome.cause}" if outcome.cause else "")
    facts += [("status", status), *metric_facts(outcome)]
    facts += [("note", notice) for notice in notices]
    return view_page(title, scene, preview_png(mesh, z, title=title, caption=about), facts)


def metric_facts(outcome: Outcome) -> list[tuple[str, str]]:
    """Return the figures of a map as pairs of a title and a number with its unit."""
    return [
        (metric.title, f"{metric.text(outcome.metrics[metric.name], precise=True)} {metric.unit}")
        for metric in METRICS
        if metric.name in outcome.metrics
    ]
