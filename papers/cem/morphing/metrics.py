"""Metrics of registrations and of the path."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.metrics import dilatations, dirichlet_energy, flipped_triangles
from cembench.core.arrays import Real
from cembench.mesh.side_lengths import side_lengths
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.results.exhibits import ExhibitTable

from ..exhibit_tables import exhibit_table
from .registration import Registration

Ints = NDArray[np.int64]

#: Number of random points per surface, besides the vertices, for distances.
SAMPLES = 50_000


def size_of(V: Real) -> float:
    """Return the size of a surface: the diagonal of its bounding box."""
    return float(np.linalg.norm(np.ptp(V, axis=0)))


def mean_edge(mesh: DiskMesh) -> float:
    """Return the mean length of the triangles' sides."""
    return float(side_lengths(mesh.V, mesh.F).mean())


def registration_metrics(
    target: DiskMesh,
    registration: Registration,
    carried: Real,
    F: Ints,
    landmarks: Ints,
    there: Ints,
) -> dict[str, Any]:
    """Return the metrics of a registration map and of the carried surface.

    Parameters
    ----------
    target : DiskMesh
        The surface that is registered.
    registration : Registration
        Its map.
    carried : float64 (n, 3)
        The first surface's vertices, carried onto the target.
    F : int64 (m, 3)
        The first surface's triangles.
    landmarks, there : int64 (k,)
        The landmarks on the first surface and on the target.

    Returns
    -------
    dict
        `landmark_error_share` is the largest distance in space of a carried landmark from its
        target, as a share of the target's size (:func:`size_of`). Distances are in mean edges of
        the target, in both directions; the mean and the largest over vertices and random points
        are given. Energies and dilatations are those of the registration map; None if a triangle
        is too thin for a finite value.
    """
    stretch = dilatations(target, registration.uv)
    apart = np.linalg.norm(carried[landmarks] - target.V[there], axis=1)
    edge = mean_edge(target)
    there_and_back = (
        distances_to(_samples(carried, F), target.V, target.F),
        distances_to(_samples(target.V, target.F), carried, F),
    )
    figures: dict[str, Any] = {
        "landmark_error_share": float(apart.max() / size_of(target.V)) if len(landmarks) else None,
        "landmark_error_disk": registration.landmark_error if len(landmarks) else None,
        "lambdas": list(registration.lambdas),
        "dirichlet_energy": dirichlet_energy(target, registration.uv),
        "dilatation_mean": float(stretch.mean()),
        "dilatation_max": float(stretch.max()),
        "flipped_triangles": flipped_triangles(target, registration.uv),
        "mean_edge": edge,
    }
    for name, d in zip(("carried_to_target", "target_to_carried"), there_and_back, strict=True):
        figures[f"{name}_mean_edges"] = float(d.mean() / edge)
        figures[f"{name}_max_edges"] = float(d.max() / edge)
    sides = ("carried_to_target", "target_to_carried")
    figures["distance_mean_edges"] = max(figures[f"{side}_mean_edges"] for side in sides)
    figures["hausdorff_edges"] = max(figures[f"{side}_max_edges"] for side in sides)
    if not np.isfinite(figures["dilatation_max"]):  # a triangle so thin that the value overflows
        figures |= {"dilatation_mean": None, "dilatation_max": None}
    return figures


def _samples(V: Real, F: Ints) -> Real:
    """Return the vertices, and random points distributed evenly over the area."""
    rng = np.random.default_rng(0)
    p, q, r = (V[F[:, c]] for c in range(3))
    area = np.cumsum(np.linalg.norm(np.cross(q - p, r - p), axis=1))
    face = np.searchsorted(area, rng.random(SAMPLES) * area[-1]).clip(max=len(F) - 1)
    u, v = rng.random((2, SAMPLES, 1))
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    return np.vstack([V, p[face] + u * (q - p)[face] + v * (r - p)[face]])


def distances_to(points: Real, V: Real, F: Ints) -> Real:
    """Return the distances (p,) of points (p, 3) from the surface of V (n, 3) and F (m, 3)."""
    import igl  # slow to load

    squared, _, _ = igl.point_mesh_squared_distance(points, np.ascontiguousarray(V), F)
    return np.sqrt(squared)


def tables_of(figures: dict[str, Any]) -> tuple[ExhibitTable, ExhibitTable]:
    """Return the metrics of the registrations, one row per surface, and those of the path."""
    rows = [{**row, "steps": len(row["lambdas"])} for row in figures["registrations"]]
    return exhibit_table("registrations", rows), exhibit_table("path", [figures])
