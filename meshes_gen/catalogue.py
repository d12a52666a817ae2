"""The stand-ins, one for each model of the paper, with their landmarks.

Each is a function ``(faces, *, seed, levers) -> DiskMesh`` whose default size and levers are those
of its row (:mod:`meshes_gen.rows`); the result is cached (:mod:`meshes_gen.cache`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from cembench.core.errors import RegistryError
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh
from cembench.registry import MAX_FACES, surface_family

from .brain import human_brain_body
from .bunny import stanford_bunny_body
from .busts import bimba_statue_body, david_head_body, knit_cap_man_body, nefertiti_body
from .cache import cached, place_of
from .cowboy_hat import cowboy_hat_body
from .faces import EXPRESSIONS, HO, LIU, face_body
from .foot import foot_body
from .hand import left_hand_body
from .head import Head
from .implicit import Body, trimmed
from .levers import Cut, Even, Gain, Jag, Levers, NonDelaunay, Smooth, hardened
from .lion import chinese_lion_body
from .remesh import has_remeshing_filter, mesh_of
from .rows import ROWS
from .statues import isis_statue_body, statue_of_liberty_body
from .vessels import bourbon_bottle_body, chinese_vase_body

#: Smallest and largest number of triangles that can be requested.
Faces = Annotated[int, Field(ge=400, le=MAX_FACES)]
Seed = Annotated[int, Field(ge=0)]

#: The function that makes the solid of each stand-in from a seed.
BODIES: Mapping[str, Callable[[int], Body]] = {
    "nefertiti-stand-in": nefertiti_body,
    "cowboy-hat-stand-in": cowboy_hat_body,
    "chinese-vase-stand-in": chinese_vase_body,
    "bourbon-bottle-stand-in": bourbon_bottle_body,
    "foot-stand-in": foot_body,
    "chinese-lion-stand-in": chinese_lion_body,
    "david-head-stand-in": david_head_body,
    "stanford-bunny-stand-in": stanford_bunny_body,
    "human-brain-stand-in": human_brain_body,
    "ho-pouting-face-stand-in": lambda seed: face_body(HO, EXPRESSIONS["pouting"], seed),
    "ho-neutral-face-stand-in": lambda seed: face_body(HO, EXPRESSIONS["neutral"], seed),
    "left-hand-stand-in": left_hand_body,
    "statue-of-liberty-stand-in": statue_of_liberty_body,
    "liu-neutral-face-stand-in": lambda seed: face_body(LIU, EXPRESSIONS["neutral"], seed),
    "liu-smile-face-stand-in": lambda seed: face_body(LIU, EXPRESSIONS["smile"], seed),
    "liu-pouting-face-stand-in": lambda seed: face_body(LIU, EXPRESSIONS["pouting"], seed),
    "liu-wry-face-stand-in": lambda seed: face_body(LIU, EXPRESSIONS["wry"], seed),
    "isis-statue-stand-in": isis_statue_body,
    "bimba-statue-stand-in": bimba_statue_body,
    "knit-cap-man-stand-in": knit_cap_man_body,
}


def stand_in(
    name: str, faces: int | None = None, *, seed: int = 0, levers: Levers | None = None
) -> DiskMesh:
    """Return the stand-in for a row, with the row's counts or with about `faces` triangles.

    `seed` sets the random details of its shape and boundary; `levers` (default: the row's) how hard
    it is to map.

    Raises
    ------
    RegistryError
        The name is unknown; the message lists the known names.
    MeshError
        There are so few triangles that the surface is not a disk.
    """
    if name not in ROWS:
        raise RegistryError(f"unknown stand-in {name!r}; known: {', '.join(ROWS)}.")
    row = ROWS[name]
    count, used = row.faces if faces is None else faces, row.levers if levers is None else levers

    def make() -> DiskMesh:
        return hardened(body_mesh(name, count, seed, used.cut), used, seed)

    return cached(DiskMesh, name, _content(count, seed, used), make)


def body_mesh(name: str, faces: int, seed: int = 0, cut: float = 0.0) -> DiskMesh:
    """Return the smooth, evenly meshed body of a stand-in, its cut moved in by this share."""
    body, boundary = BODIES[name](seed), ROWS[name].boundary_at(faces)
    return mesh_of(DiskMesh, trimmed(body, cut), faces, boundary, name=name)


def _content(faces: int, seed: int, levers: Levers) -> dict[str, Any]:
    """Return everything that determines the shape of a stand-in."""
    return {
        "faces": faces,
        "seed": seed,
        "levers": asdict(levers),
        "remeshing_filter": has_remeshing_filter(),
    }


#: Person and expression of each stand-in that is a face.
FACES = {
    "ho-pouting-face-stand-in": (HO, "pouting"),
    "ho-neutral-face-stand-in": (HO, "neutral"),
    "liu-neutral-face-stand-in": (LIU, "neutral"),
    "liu-smile-face-stand-in": (LIU, "smile"),
    "liu-pouting-face-stand-in": (LIU, "pouting"),
    "liu-wry-face-stand-in": (LIU, "wry"),
}


def landmarks(name: str, mesh: TriangleMesh) -> dict[str, int]:
    """Return the vertices of the landmarks of a face: nose tip, corners of eyes and mouth, lips.

    Keys: nose_tip, eye_inner_right, eye_outer_right, eye_inner_left, eye_outer_left,
    mouth_corner_right, mouth_corner_left, and lips_right, lips_middle, lips_left on the line where
    the lips meet (the person's own right and left are x < 0 and x > 0).

    Raises
    ------
    RegistryError
        The name is not that of a face.
    """
    if name not in FACES:
        raise RegistryError(f"{name!r} has no landmarks; the faces are: {', '.join(FACES)}.")
    person, expression = FACES[name]
    points = Head(person, EXPRESSIONS[expression], ears=False).landmarks()
    return {
        key: int(np.argmin(((mesh.V - point) ** 2).sum(axis=1))) for key, point in points.items()
    }


def _registered(name: str) -> Callable[..., DiskMesh]:
    """Return the stand-in for a row as a registered surface family."""
    row = ROWS[name]
    own = row.levers

    def make(
        faces: Faces = row.faces,
        *,
        seed: Seed = 0,
        jag: Jag = own.jag,
        smooth: Smooth = own.smooth,
        even: Even = own.even,
        gain: Gain = own.gain,
        non_delaunay: NonDelaunay = own.non_delaunay,
        centred: bool = own.centred,
        cut: Cut = own.cut,
    ) -> DiskMesh:
        levers = Levers(jag, smooth, even, gain, non_delaunay, centred, cut)
        return stand_in(name, faces, seed=seed, levers=levers)

    def kept(faces: int, *, seed: int, **levers: Any) -> Path:
        return place_of(name, _content(faces, seed, Levers(**levers)))

    make.__name__ = make.__qualname__ = name.replace("-", "_")
    make.__doc__ = BODIES[name].__doc__ or f"A procedural stand-in for the model {row.model}."
    declare = surface_family(
        name,
        title=row.model,
        source="procedural stand-in",
        paper_row=row.model,
        fitted=row.fitted,
        landmarks=partial(landmarks, name) if name in FACES else None,
        kept=kept,
    )
    return declare(make)


#: Each under the name of its stand-in, as its entry point has it: ``nefertiti``, ``cowboy_hat``.
globals().update(
    {name.removesuffix("-stand-in").replace("-", "_"): _registered(name) for name in BODIES}
)
