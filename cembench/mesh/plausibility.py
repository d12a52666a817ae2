"""Notes on surfaces that can be mapped but cannot be what was meant, each with its remedy."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cembench.core.arrays import Indices, Points
from cembench.core.errors import CembenchError
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.defects import LARGEST_LENGTH
from cembench.mesh.gluing import edges_of_half_edges
from cembench.mesh.repair import repair
from cembench.mesh.seams import shortest_at_vertices, tolerances_of_gaps

#: Coordinates are coarse if their steps are above this share of the median edge.
_COARSE = 0.05
#: Heights are in another unit than positions if they differ by this many times the positions.
_MIXED = 20.0
#: Sheets nearly coincide if they are closer than this share of the edges there, at this share of
#: the vertices; so many are looked at.
_NEAR, _SHARE, _SAMPLE = 1e-3, 0.05, 5_000
_METRES_PER_DEGREE = 111_320


def implausible(V: Points, F: Indices, *, sheets: bool = True) -> tuple[Notice, ...]:
    """Return what cannot be right about vertices V (n, 3) and triangles F (m, 3), one line each.

    Without `sheets` only the coordinates are looked at. Triangles with vertices that are missing or
    too large are left out.
    """
    finite = np.append((np.abs(V) <= LARGEST_LENGTH).all(axis=1), False)
    F = F[finite[np.where((F >= 0) & (len(V) > F), F, -1)].all(axis=1)]
    if not len(F):
        return ()
    used, F = np.unique(F, return_inverse=True)
    V, F = V[used], F.reshape(-1, 3)
    edges = edges_of_half_edges(F)[0]
    lengths = np.linalg.norm(V[edges[:, 0]] - V[edges[:, 1]], axis=1)
    # Where the coordinates are wrong, so are distances between sheets.
    notes = [*_coarse(V, lengths), *_mixed_units(V, F)]
    if not notes and sheets:
        notes = [*_near(V, F, edges, lengths)]
    return tuple(Notice(kind, text) for kind, text in notes)


def _coarse(V: Points, lengths: Points) -> Iterator[tuple[NoticeKind, str]]:
    """Yield whether the floating-point numbers are too far from 0 for such short edges."""
    with np.errstate(over="ignore"):
        single = V.astype(np.float32)
    is_single = bool((single == V).all())
    largest = float(np.abs(V).max())
    step = float(np.spacing(np.float32(largest))) if is_single else float(np.spacing(largest))
    edge = float(np.median(lengths))
    if not step > _COARSE * edge:
        return
    middle = ", ".join(f"{x:.6g}" for x in (V.min(axis=0) + V.max(axis=0)) / 2)
    precision = "single" if is_single else "double"
    yield (
        NoticeKind.COARSE_COORDINATES,
        f"{precision} precision holds coordinates of {largest:.3g} in steps of {step:.2g}, but "
        f"half of the edges are shorter than {edge:.2g}: the shapes of the triangles are lost. "
        f"Subtract an offset such as ({middle}) before the coordinates are written",
    )


def _mixed_units(V: Points, F: Indices) -> Iterator[tuple[NoticeKind, str]]:
    """Yield whether a landscape has positions in degrees and heights in another unit."""
    low, high = V.min(axis=0), V.max(axis=0)
    size = high - low
    in_degrees = (np.abs(V[:, :2]).max(axis=0) <= (180, 180)).all() and size[:2].max() <= 90
    if not (in_degrees and size[2] > _MIXED * size[:2].max() > 0):
        return
    a, b, c = (V[F[:, k], :2] for k in range(3))
    u, v = b - a, c - a
    facing = np.sign(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    if abs(facing.sum()) < 0.99 * len(F):  # not the graph of a height
        return
    ranges = [f"{x:.5g} to {y:.5g}" for x, y in zip(low, high, strict=True)]
    across = _METRES_PER_DEGREE * np.cos(np.deg2rad((low[1] + high[1]) / 2))
    yield (
        NoticeKind.MIXED_UNITS,
        f"x ({ranges[0]}) and y ({ranges[1]}) look like degrees, z ({ranges[2]}) like metres: the "
        f"angles are not those of the landscape. Bring all to metres: x * {across:.0f}, "
        f"y * {_METRES_PER_DEGREE}, or project them (pyproj)",
    )


def _near(
    V: Points, F: Indices, edges: Indices, lengths: Points
) -> Iterator[tuple[NoticeKind, str]]:
    """Yield whether boundaries have gaps, or sheets nearly coincide; welding is tried first."""
    for weld in tolerances_of_gaps(V, F):
        if _joins(V, F, weld):
            yield (
                NoticeKind.GAPS,
                f"boundaries lie less than {weld:.0e} apart, far less than the edges there: a "
                f"repair with --weld {weld:.0e} (weld={weld:.0e}) joins them",
            )
            return
    from scipy.spatial import cKDTree

    shortest = shortest_at_vertices(len(V), edges, lengths)
    chosen = np.arange(len(V))[:: max(1, len(V) // _SAMPLE)]
    away = cKDTree(V).query(V[chosen], k=2)[0][:, 1]
    near = (away > 0) & (away < _NEAR * shortest[chosen])
    if near.mean() < _SHARE:
        return
    weld = float(f"{10 ** np.ceil(np.log10(2 * away[near].max())):.0e}")
    remedy = "keep one of them: delete the other in a modelling program"
    if _joins(V, F, weld):
        remedy = f"a repair with --weld {weld:.0e} (weld={weld:.0e}) makes them one"
    yield (
        NoticeKind.NEAR_SHEETS,
        f"{near.mean():.0%} of the vertices have another within {away[near].max():.1e}, far less "
        f"than the edges there: two sheets nearly coincide. {remedy[0].upper()}{remedy[1:]}",
    )


def _joins(V: Points, F: Indices, weld: float) -> bool:
    """Whether welding at this distance joins vertices and loses no more than double triangles."""
    try:
        repaired = repair(V, F, weld=weld, components="all")
    except CembenchError:
        return False
    kept = repaired.kept
    return kept.is_whole and len(V) > sum(len(own) for own, _ in repaired.surfaces)
