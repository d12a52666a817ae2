"""Exhibits of a morph: a strip of frames, and the registrations under a checkerboard."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from cembench.core.arrays import Picture
from cembench.core.atomic import write_bytes
from cembench.drawing.preview import draw_panels
from cembench.drawing.scene import FILL
from cembench.results.exhibits import (
    Exhibit,
    ExhibitPicture,
    exhibit_folder,
    write_exhibit,
)
from cembench.results.papers import usual_paper
from cembench.results.records import MeshOrigin

from .morphing.drawing import draw_film
from .morphing.metrics import tables_of
from .morphing.morph import Morph
from .page import page

#: How landmarks and their targets are marked.
_DOT: dict[str, Any] = {"linestyle": "", "marker": "o"}
PLACE = _DOT | {"markersize": 5, "color": "#d11c21"}
TARGET = _DOT | {"markersize": 10, "markerfacecolor": "none", "markeredgecolor": "#ffffff"}
#: Number of frames of a strip, and the views of its rows.
FRAMES, STRIP_VIEWS = 7, ("front", "three-quarter")


def write_exhibits(
    run: Path,
    morph: Morph,
    figures: dict[str, Any],
    command: str,
    rows_of_paper: tuple[str, ...],
    tell: Callable[[str], object] = lambda step: None,
    sides: tuple[int, int] = (240, 420),
) -> list[Path]:
    """Write both exhibits to a run's folder; return the paths of their descriptions.

    `figures` are the morph's metrics; `rows_of_paper` are the paper's models that the surfaces
    stand in for, "" for none; `sides` are the pixels of a picture on each page.
    """
    paper = usual_paper()
    origin: MeshOrigin = "stand-in" if all(rows_of_paper) else "surface"
    names = [mesh.name for mesh in morph.meshes]
    stem = "-".join(names)
    registrations, path = tables_of(figures)
    shared: dict[str, Any] = {"command": command, "origin": origin, "facts": figures}
    tell("drawing the strip")
    strip = _picture(
        run,
        f"morph-{stem}",
        "strip.png",
        strip_page(morph, sides[0]),
        f"From {names[0]} to {names[-1]}: seven moments of the path, from the front and from three "
        "quarters.",
    )
    board = _picture(
        run,
        f"registration-{stem}",
        "maps.png",
        registration_page(morph, sides[1], tell),
        "Conformal maps, and below them the Moebius map and the registrations: now equal squares "
        "lie on the same features. Dots are landmarks, rings their targets.",
    )
    spline = "a cubic spline" if len(names) > 2 else "a straight line"
    done = [
        Exhibit(
            name=f"morph-{stem}",
            title="Morph: " + ", ".join(names),
            text=f"The vertices of {names[0]} are carried onto the other surfaces, and {spline} in "
            "time leads through their places.",
            figure=paper.exhibited("morph", rows_of_paper),
            pictures=(strip,),
            tables=(path,),
            **shared,
        ),
        Exhibit(
            name=f"registration-{stem}",
            title="Registration: " + ", ".join(names),
            text="Conformal maps f of the surfaces to the disk; a Moebius map m1 that takes the "
            "first landmark to the centre; registration maps r that minimise (34).",
            figure=paper.exhibited("registration", rows_of_paper),
            pictures=(board,),
            tables=(registrations,),
            **shared,
        ),
    ]
    return [write_exhibit(run, exhibit) for exhibit in done]


def _picture(run: Path, name: str, file: str, content: bytes, caption: str) -> ExhibitPicture:
    write_bytes(exhibit_folder(run, name) / file, content)
    return ExhibitPicture(file=file, caption=caption, alternative=caption)


def strip_page(morph: Morph, side: int = 240) -> bytes:
    """Return a PNG of the path at seven moments, one column each, in two views."""
    times = np.linspace(0, 1, FRAMES)
    pictures = draw_film(morph.meshes[0], morph.stops, times, STRIP_VIEWS, side)
    rows = [
        [picture[:, row * side : (row + 1) * side] for picture in pictures]
        for row in range(len(STRIP_VIEWS))
    ]
    knots = np.linspace(0, 1, len(morph.meshes))
    heads = []
    for time in times:
        at = np.flatnonzero(np.isclose(knots, time))
        heads.append(f"t = {time:.2f}" + (f"\n{morph.meshes[at[0]].name}" if len(at) else "\n"))
    return page(rows, heads, sides=STRIP_VIEWS)


def registration_page(
    morph: Morph, side: int = 420, tell: Callable[[str], object] = lambda step: None
) -> bytes:
    """Return a PNG of f_k, the Moebius map and the registrations, one column per surface.

    Rows: the surface under the checkerboard of its conformal map, and that map; the same for the
    registered map. Red dots are the landmarks, white rings those of the first surface.
    """
    registered = [morph.aligned[0], *(one.uv for one in morph.registrations)]
    rows: list[list[Picture]] = [[], [], [], []]
    for k, mesh in enumerate(morph.meshes):
        tell(f"drawing {mesh.name}")
        for row, uv in ((0, morph.maps[k]), (2, registered[k])):
            surface, image = draw_panels(mesh, uv, side)
            rows[row].append(surface)
            rows[row + 1].append(image)
    places = morph.landmarks.vertices
    marks: dict[tuple[int, int], Any] = {}
    for k in range(len(morph.meshes)):
        first, own, moved = (
            FILL * np.stack([z.real, z.imag], axis=1)
            for z in (
                morph.aligned[0][places[:, 0]],
                morph.maps[k][places[:, k]],
                registered[k][places[:, k]],
            )
        )
        marks |= {(1, k): [(own, PLACE)], (3, k): [(moved, PLACE), (first, TARGET)]}
    numbers = range(1, len(morph.meshes) + 1)
    after = ["m1 f1", *(f"r{k}" for k in numbers[1:])]
    heads = [f"M{k}: {mesh.name}" for k, mesh in zip(numbers, morph.meshes, strict=True)]
    notes = [
        [f"M{k} under the board of f{k}" for k in numbers],
        [f"f{k}" for k in numbers],
        [f"M{k} under the board of {name}" for k, name in zip(numbers, after, strict=True)],
        [f"{name}, landmarks registered" if k else name for k, name in enumerate(after)],
    ]
    return page(rows, heads, notes=notes, marks=marks)
