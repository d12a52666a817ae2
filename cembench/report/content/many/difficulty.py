"""Difficulty of surfaces (size, thin triangles, crowding) and its effect on maps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.metrics import in_common_gauge, is_disk_map
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.report.content.evidence import ANGLE, DISK, Evidence, MeasuredSurface, figure
from cembench.report.plots import Axis, Plot, PlotPanel, Point, through
from cembench.report.surface_facts import factor_spans
from cembench.results.records import Record

#: Maximum number of algorithms in the plot; more cannot be distinguished.
DRAWN = 8


@dataclass(frozen=True)
class Difficulty:
    """Difficulty of mapping a surface to a disk, judged by its best map.

    Parameters
    ----------
    span : float
        Span of the conformal factor, a ratio of lengths: the 99.9 over the 0.1 percentile.
    crowding : float
        The same along the boundary, in the common gauge: the 99 over the 1 percentile of the
        edges' image lengths over their lengths.

    """

    span: float
    crowding: float


def difficulties(evidence: Evidence, policy: str) -> dict[str, Difficulty]:
    """Return the difficulty of each surface that has a map to the disk, by its hash."""
    found = {}
    for surface in evidence.surfaces:
        record = best_record(evidence, surface, policy)
        if record is None or record.target != DISK:
            continue
        mesh, uv = evidence.mesh(surface), evidence.uv(record)
        if mesh is None or uv is None:
            continue
        crowded = boundary_crowding(mesh, uv)
        span = factor_spans(mesh, uv)["conformal_factor_span_99_8"]
        if crowded is not None:
            found[surface.mesh_hash] = Difficulty(span, crowded)
    return found


def best_record(evidence: Evidence, surface: MeasuredSurface, policy: str) -> Record | None:
    """Return the record with the smallest mean angle error, preferring maps to the disk."""
    best: tuple[bool, float] = (True, inf)
    found = None
    for series in evidence.series:
        angle = figure(evidence, surface, series, policy, ANGLE)
        rank = (series.target != DISK, inf if angle is None else angle)
        if rank[1] < inf and rank < best:
            best, found = rank, evidence.find(surface, series, policy)
    return found


def boundary_crowding(mesh: TriangleMesh, uv: NDArray[np.complex128]) -> float | None:
    """Return how unevenly a map to the disk scales the boundary, in the common gauge.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface; the boundary is its outer one.
    uv : complex128 (n,)
        The map.

    Returns
    -------
    float or None
        The 99 over the 1 percentile of image length over length of the boundary's edges; None
        if the map has no such gauge, or an edge has no length.

    """
    if not is_disk_map(mesh, uv):
        return None
    try:
        centred = in_common_gauge(mesh, uv)
    except AlgorithmFailed:
        return None
    loop = mesh.loops[0]
    after = np.roll(loop, -1)
    lengths = np.linalg.norm(mesh.V[after] - mesh.V[loop], axis=1)
    images = np.abs(centred[after] - centred[loop])
    if not (lengths.min() > 0 and images.min() > 0):
        return None
    low, high = np.percentile(images / lengths, [1, 99])
    return float(high / low)


def errors_by_difficulty(
    evidence: Evidence, policy: str, known: Mapping[str, Difficulty]
) -> Plot | None:
    """Return a plot of angle errors against size, thin triangles, span and crowding."""
    if not known:
        return None
    axes = (
        (Axis("triangles", log=True), lambda s: float(s.faces)),
        (Axis("edges not Delaunay (%)"), lambda s: 100 * s.non_delaunay_share),
        (Axis("span of the conformal factor", log=True), lambda s: known[s.mesh_hash].span),
        (Axis("crowding of the boundary", log=True), lambda s: known[s.mesh_hash].crowding),
    )
    series = [s for s in evidence.disk_series if s.main]
    surfaces = [s for s in evidence.surfaces if s.mesh_hash in known]
    panels = []
    for axis, place in axes:
        clouds = []
        for one in series[:DRAWN]:
            points = []
            for surface in surfaces:
                error = figure(evidence, surface, one, policy, ANGLE)
                if error is not None and 0 < error < inf:
                    points.append(Point(place(surface), error, surface.title))
            clouds.append(through(one.label, points, "points", evidence.styles[one.label]))
        panels.append(PlotPanel(axis, Axis("mean angle error (degrees)", log=True), tuple(clouds)))
    others = ", ".join(s.label for s in series[DRAWN:])
    left = f" Not drawn: {others}." if others else ""
    return Plot(
        "errors-by-difficulty",
        "Angle errors by the difficulty of surfaces",
        tuple(panels),
        "Each point is a valid map to the disk. The span is that of the conformal factor of the "
        "surface's best map, a ratio of lengths (99.9 over 0.1 percentile of the triangles); "
        "crowding is the same along the boundary, in the common gauge (99 over 1 percentile of "
        f"its edges).{left}",
        "Clouds of points; if they rise to the right, surfaces of that kind are harder.",
    )
