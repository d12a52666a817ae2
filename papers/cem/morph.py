"""Exhibits of a morph: a strip of frames, and the registrations under a checkerboard."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from cembench.core.atomic import write_bytes
from cembench.drawing.preview import draw_panels
from cembench.drawing.scene import FILL
from cembench.morphing.drawing import draw_film
from cembench.morphing.metrics import tables_of
from cembench.morphing.morph import Morph
from cembench.results.exhibits import (
    Exhibit,
    ExhibitPicture,
    exhibit_folder,
    write_exhibit,
)
from cembench.results.papers import usual_paper
from cembench.results.records import MeshOrigin

Complex = NDArray[np.complex128]
Picture = NDArray[np.uint8]
Grid = Sequence[Sequence[Picture]]

DPI = 100
INK, TARGET, PLACE = "#22384d", "#ffffff", "#d11c21"
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
    return _page(rows, heads, list(STRIP_VIEWS))


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
    targets = morph.aligned[0][places[:, 0]]
    marks: dict[tuple[int, int], tuple[Complex, Complex]] = {}
    for k in range(len(morph.meshes)):
        marks[1, k] = morph.maps[k][places[:, k]], np.empty(0, dtype=np.complex128)
        marks[3, k] = registered[k][places[:, k]], targets
    numbers = range(1, len(morph.meshes) + 1)
    after = ["m1 f1", *(f"r{k}" for k in numbers[1:])]
    heads = [f"M{k}: {mesh.name}" for k, mesh in zip(numbers, morph.meshes, strict=True)]
    notes = [
        [f"M{k} under the board of f{k}" for k in numbers],
        [f"f{k}" for k in numbers],
        [f"M{k} under the board of {name}" for k, name in zip(numbers, after, strict=True)],
        [f"{name}, landmarks registered" if k else name for k, name in enumerate(after)],
    ]
    return _page(rows, heads, None, notes, marks)


def _page(
    rows: Grid,
    heads: Sequence[str],
    sides: Sequence[str] | None,
    notes: Sequence[Sequence[str]] | None = None,
    marks: dict[tuple[int, int], tuple[Complex, Complex]] | None = None,
) -> bytes:
    """Return a page of equally large pictures, with text above columns, beside rows, and below."""
    side = len(rows[0][0])
    top, left, below = 46, 24 if sides else 6, 24 if notes else 4
    width = left + side * len(rows[0]) + 6
    height = top + (side + below) * len(rows) + 4
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    text_style: dict[str, Any] = {"color": INK, "ha": "center", "va": "center", "parse_math": False}
    for k, head in enumerate(heads):
        x = (left + (k + 0.5) * side) / width
        figure.text(x, 1 - top / 2 / height, head, fontsize=10, weight="bold", **text_style)
    for r, pictures in enumerate(rows):
        bottom = height - top - r * (side + below) - side
        if sides:
            figure.text(
                left / 2 / width,
                (bottom + side / 2) / height,
                sides[r],
                rotation=90,
                fontsize=10,
                **text_style,
            )
        for k, picture in enumerate(pictures):
            axes = figure.add_axes(
                ((left + k * side) / width, bottom / height, side / width, side / height)
            )
            axes.imshow(picture, extent=(-1, 1, -1, 1), interpolation="nearest")
            axes.set_axis_off()
            if marks and (r, k) in marks:
                for z, style in zip(marks[r, k], _STYLES, strict=True):
                    axes.plot(FILL * z.real, FILL * z.imag, **style)
            if notes:
                x = (left + (k + 0.5) * side) / width
                figure.text(x, (bottom - below / 2) / height, notes[r][k], fontsize=9, **text_style)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    return buffer.getvalue()


_DOT: dict[str, Any] = {"linestyle": "", "marker": "o"}
#: Colours of landmarks and of their targets.
_STYLES = (
    _DOT | {"markersize": 5, "color": PLACE},
    _DOT | {"markersize": 10, "markerfacecolor": "none", "markeredgecolor": TARGET},
)
