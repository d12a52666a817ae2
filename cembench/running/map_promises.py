"""Judge a map: whether it keeps the promises of its target.

A map whose image triangles all have positive area takes each value as often as the boundaries'
images wind around it. So it is injective if no triangle is folded and the boundaries' images are
polygons that cross neither themselves nor each other. Both are decided exactly for the given
doubles.

Boundary vertices can be closer together on the circle than doubles can resolve. Angles that differ
by no more than rounding (:data:`~cembench.conformal.planar.ANGLE_ROUNDING`) therefore count as
ordered. Nothing is lost by that: if two neighbours coincide, the triangle at their edge has no area
and counts as folded; if a rounding error swaps them, either that triangle is folded or the polygon
crosses itself.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from pydantic import BaseModel, ConfigDict

from cembench.conformal.atlas import AtlasFigures, cut_map
from cembench.conformal.metrics import (
    CIRCULAR,
    boundary_circles,
    flipped_triangles,
    image_area,
)
from cembench.conformal.planar import crossing_polygons, polygon_area, turns, winding_words
from cembench.core.arrays import Complex, Indices
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.triangle_mesh import TriangleMesh, definition_1_notices
from cembench.registry import Algorithm, Target
from cembench.results.records import Fault, FaultKind

#: Tolerance of a disk's boundary vertices from the unit circle.
CIRCLE_TOLERANCE = 1e-9
#: Targets with the outer boundary on the unit circle, and holes inside it.
WITH_HOLES = "circular holes", "disk with holes"


class Promise(BaseModel):
    """The properties by which an algorithm's maps are judged, without importing the algorithm."""

    model_config = ConfigDict(frozen=True)

    target: Target = "disk"
    #: Tolerance of a disk's boundary from the unit circle.
    circle: float = CIRCLE_TOLERANCE
    #: Whether the map depends only on the triangles, not on the shape.
    combinatorial: bool = False
    #: Whether every call is a separate process.
    is_program: bool = False

    @classmethod
    def of(cls, algorithm: Algorithm) -> Promise:
        """Return the promise of this algorithm."""
        others = algorithm.program or algorithm.library or algorithm.maps
        return cls(
            target=algorithm.target,
            circle=CIRCLE_TOLERANCE if others is None else others.circle,
            combinatorial=algorithm.combinatorial,
            is_program=algorithm.program is not None,
        )


def faults(promised: Algorithm | Promise, mesh: TriangleMesh, uv: Complex) -> list[Fault]:
    """Return the promises that this map breaks; none for a valid one.

    A misplaced boundary is listed before folds. A boundary that is only out of order is listed
    after them, because it comes with folded triangles next to it.
    """
    promise = promised if isinstance(promised, Promise) else Promise.of(promised)
    if promise.target == "atlas":
        return judged_atlas(mesh, uv.reshape(-1, 3))
    flipped = flipped_triangles(mesh, uv)
    is_reversed = image_area(mesh, uv) <= 0 or flipped == mesh.m
    placed: list[Fault] = []
    order: list[Fault] = []
    if promise.target in ("disk", *WITH_HOLES):
        placed, order = _of_the_circle(mesh, uv, promise.circle)
    if promise.target in WITH_HOLES:
        placed += _crossings(mesh, uv)
        placed += _turned_holes(mesh, uv) if not (placed or is_reversed) else []
        order += _uncircular_holes(mesh, uv, promise)
    elif promise.target == "disk" and not (flipped or placed or order):
        order = _crossings(mesh, uv)
    if is_reversed:
        off = [fault for fault in placed if fault.kind is not FaultKind.WINDING]
        return [*off, _fault(FaultKind.REVERSED, "the map reverses the surface's orientation")]
    if flipped:
        message = f"{flipped} of {mesh.m} triangles are folded ({flipped / mesh.m:.2%})"
        message = "; ".join([message, *broken_premises(mesh)])
        placed.append(_fault(FaultKind.FOLDED, message))
    return placed + order


def judged_atlas(mesh: TriangleMesh, corners: Complex) -> list[Fault]:
    """Return the promises that an atlas breaks: no island may have a folded triangle.

    Packing may mirror islands, but not all of them may be mirrored.
    """
    figures = AtlasFigures(cut_map(mesh, corners))
    folded = int(figures.folds.sum())
    if figures.cut.mirrored == figures.cut.islands:
        return [_fault(FaultKind.REVERSED, "the map reverses the surface's orientation")]
    if not folded:
        return []
    message = (
        f"{folded} of {mesh.m} triangles are folded ({folded / mesh.m:.2%}), in "
        f"{int((figures.folds > 0).sum())} of {figures.cut.islands} islands"
    )
    return [_fault(FaultKind.FOLDED, message)]


def broken_premises(mesh: TriangleMesh) -> list[str]:
    """Return a remark if a mesh breaks a premise of the paper, else nothing.

    A disk without interior vertices is flat, so a free boundary maps it exactly; so is a surface
    with holes once it is cut.
    """
    broken = definition_1_notices(mesh.F, mesh.n, mesh.loops) if mesh.loops else ()
    if not broken:
        return []
    remark = f"the mesh breaks a premise of the paper: {'; '.join(map(str, broken))}"
    if len(mesh.interior):
        return [remark]
    cut = "--cut " if len(mesh.loops) > 1 else ""
    return [remark, f"a free boundary unrolls it exactly: {cut}-a lscm"]


def remarks(algorithm: Algorithm | Promise, mesh: TriangleMesh, uv: Complex) -> list[Notice]:
    """Return the remark on a map without faults whose free boundary overlaps itself.

    Its target allows that.
    """
    if algorithm.target != "free boundary":
        return []
    return [
        Notice(NoticeKind.IMAGE_OVERLAPS, f"the image overlaps itself: {fault.detail}")
        for fault in (*_crossings(mesh, uv), *_turned_holes(mesh, uv))
    ]


def _fault(kind: FaultKind, detail: str) -> Fault:
    return Fault(kind=kind, detail=detail)


def _outer(mesh: TriangleMesh, uv: Complex) -> Indices:
    return max(mesh.loops, key=lambda loop: polygon_area(uv[loop]))


def _of_the_circle(
    mesh: TriangleMesh, uv: Complex, tolerance: float
) -> tuple[list[Fault], list[Fault]]:
    """Return faults of position and winding on the unit circle, and faults of order."""
    z = uv[_outer(mesh, uv)]
    name = "boundary" if len(mesh.loops) == 1 else "outer boundary"
    placed, order = [], []
    off = np.abs(np.abs(z) - 1).max()
    if off > tolerance:
        message = f"the {name} lies off the unit circle by up to {off:.2g}"
        placed.append(_fault(FaultKind.OFF_CIRCLE, message))
    around, winding, backward = turns(z)
    if around != 1 and winding not in (0, 1):  # 0: all points may be on one half of the circle
        message = (
            f"the {name} {winding_words(winding)}; it must go around it once, counter-clockwise"
        )
        placed.append(_fault(FaultKind.WINDING, message))
    elif around != 1:
        message = f"{backward} of {len(z)} arcs of the {name} go backward"
        order.append(_fault(FaultKind.BOUNDARY_ORDER, message))
    return placed, order


def _crossings(mesh: TriangleMesh, uv: Complex) -> list[Fault]:
    crossing = crossing_polygons([uv[loop] for loop in mesh.loops])
    if crossing is None:
        return []
    one, other = (f"boundary {int(mesh.loops[k].min())}" for k in crossing)
    whom = "itself" if one == other else other
    message = f"{one} crosses {whom} (a boundary is named by its smallest vertex)"
    return [_fault(FaultKind.BOUNDARIES_CROSS, message)]


def _turned_holes(mesh: TriangleMesh, uv: Complex) -> list[Fault]:
    """Return faults of holes that run counter-clockwise, with the surface inside them."""
    outer = _outer(mesh, uv)
    turned = [k for k in mesh.loops if k is not outer and polygon_area(uv[k]) >= 0]
    return [
        _fault(
            FaultKind.HOLE_ORIENTATION,
            f"boundary {int(loop.min())} runs counter-clockwise; a hole's image runs clockwise",
        )
        for loop in turned
    ]


def _uncircular_holes(mesh: TriangleMesh, uv: Complex, promise: Promise) -> list[Fault]:
    """Return the fault that holes are not circles inside the disk that are apart."""
    if promise.target != "circular holes":
        return []
    circles, allowed = boundary_circles(mesh, uv)[1:], max(CIRCULAR, promise.circle)
    texts = []
    off = [circle for circle in circles if not circle.circularity <= allowed]
    if off:
        worst = max(off, key=lambda circle: circle.circularity)
        texts.append(
            f"{len(off)} of {len(circles)} holes are not circles: that of vertex {worst.vertex} is "
            f"off by {worst.circularity:.2g} of its radius, {allowed:g} is allowed"
        )
    # Three vertices are always on a circle, but not always on one inside the disk.
    out = [c for c in circles if c.circularity <= allowed < abs(c.centre) + c.radius - 1]
    if out:
        texts.append(f"the circles of {len(out)} of {len(circles)} holes reach outside the disk")
    if any(
        abs(one.centre - other.centre) < (one.radius + other.radius) * (1 - allowed)
        for one, other in combinations(circles, 2)
        if max(one.circularity, other.circularity) <= allowed
    ):
        texts.append("circles of holes overlap")
    return [_fault(FaultKind.HOLES_NOT_CIRCULAR, "; ".join(texts))] if texts else []
