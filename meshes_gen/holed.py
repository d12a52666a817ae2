"""Surfaces with holes: a spherical cap with 1 to 8 holes, and Ho's face with three."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from cembench.core.arrays import Complex, Real
from cembench.mesh.triangle_mesh import HoledMesh
from cembench.registry import MAX_FACES, surface_family

from .cache import cached
from .faces import HO, face_body, mask
from .head import NEUTRAL, Head
from .implicit import Body, ellipsoid, sphere
from .levers import with_levers
from .remesh import Shape, edge_length, has_remeshing_filter, mesh_of
from .rows import ROWS

#: Polar angle of the cap's rim, of the holes' centres, and the holes' radius; degrees.
CAP, PLACE, HOLE = 100.0, 55.0, 14.0


def hole_centres(holes: int) -> Real:
    """Return the centres of the cap's holes: unit vectors (holes, 3), evenly around the pole."""
    turn = 2 * np.pi * np.arange(holes) / holes
    polar = np.deg2rad(PLACE)
    return np.stack(
        [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.full(holes, np.cos(polar))],
        axis=1,
    )


def holed_cap_body(holes: int) -> Body:
    """The unit sphere, cut by the rim's plane and one plane per hole."""
    centres = hole_centres(holes)

    def keep(p: Real) -> Real:
        inside = [p[:, 2] - np.cos(np.deg2rad(CAP))]
        inside += [np.cos(np.deg2rad(HOLE)) - p @ c for c in centres]
        return np.min(inside, axis=0)

    return Body(
        lambda p: sphere(p, (0, 0, 0), 1.0), keep, (-1.1,) * 3, (1.1,) * 3, 100, loops=holes + 1
    )


def exact_map(V: Real) -> Complex:
    """Return the cap's map to the unit disk with round holes: stereographic projection."""
    return (V[:, 0] + 1j * V[:, 1]) / (1 + V[:, 2]) / np.tan(np.deg2rad(CAP) / 2)


@surface_family(
    "holed-cap", title="Spherical cap with holes", source="closed form", exact_map=exact_map
)
@with_levers
def holed_cap(
    faces: Annotated[int, Field(ge=2_000, le=MAX_FACES)] = 20_000,
    *,
    holes: Annotated[int, Field(ge=1, le=8)] = 3,
) -> HoledMesh:
    """A spherical cap of 100 degrees with `holes` round holes, evenly around its pole.

    Stereographic projection, :func:`exact_map`, takes it to the unit disk with round holes.
    """
    body = holed_cap_body(holes)
    rims = 2 * np.pi * (np.sin(np.deg2rad(CAP)) + holes * np.sin(np.deg2rad(HOLE)))
    area = 2 * np.pi * (1 - np.cos(np.deg2rad(CAP)))
    area -= holes * 2 * np.pi * (1 - np.cos(np.deg2rad(HOLE)))
    boundary = round(rims / edge_length(area, faces))
    mesh = _made("holed-cap", body, faces, boundary, holes=holes)
    return mesh.moved(Shape(body, 1e-3).nearest(mesh.V, mesh.F, 1e-3, rounds=2))


@surface_family(
    "ho-face-with-holes", title="Ho's Face with Holes", source="procedural stand-in for the model"
)
@with_levers
def ho_face_with_holes(
    faces: Annotated[int, Field(ge=5_000, le=MAX_FACES)] = 100_000,
    *,
    seed: Annotated[int, Field(ge=0)] = 0,
) -> HoledMesh:
    """Ho's neutral face with three holes at the eyes and the mouth."""
    head = Head(HO, NEUTRAL, ears=False)
    marks = head.landmarks()
    eyes = [(marks[f"eye_inner_{s}"] + marks[f"eye_outer_{s}"]) / 2 for s in ("right", "left")]
    mouth = (marks["mouth_corner_right"] + marks["mouth_corner_left"]) / 2
    whole = face_body(HO, NEUTRAL, seed)

    def keep(p: Real) -> Real:
        holes = [ellipsoid(p, eye, (0.185, 0.30, 0.125)) for eye in eyes]
        holes.append(ellipsoid(p, mouth, (0.34, 0.34, 0.155)))
        return np.minimum(mask(p), np.min(holes, axis=0))

    body = Body(whole.f, keep, whole.lower, whole.upper, whole.cells, loops=4)
    boundary = round(1.5 * ROWS["ho-neutral-face-stand-in"].boundary_at(faces))
    return _made("ho-face-with-holes", body, faces, boundary, seed=seed)


def _made(name: str, body: Body, faces: int, boundary: int, **more: int) -> HoledMesh:
    """Return the cached surface of a body, with boundary vertices of the required parity."""
    boundary += (faces - boundary) % 2
    parameters = {"faces": faces, "remeshing_filter": has_remeshing_filter(), **more}
    return cached(
        HoledMesh, name, parameters, lambda: mesh_of(HoledMesh, body, faces, boundary, name=name)
    )
