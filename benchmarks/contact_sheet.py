"""The contact sheet of the stand-ins."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO

import numpy as np
from cembench.surfaces.catalogue import stand_in
from cembench.surfaces.rows import ROWS
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from benchmarks.pages import Section
from cembench.drawing.painter import draw_clay
from cembench.drawing.scene import framed
from cembench.mesh.triangle_mesh import TriangleMesh

#: Viewing direction of each surface (x, y, z); figures look along -y.
VIEWS: dict[str, tuple[float, float, float]] = {
    "left-hand-stand-in": (0.15, -1.0, 0.1),
    "stanford-bunny-stand-in": (-0.45, -1.0, 0.3),
    "human-brain-stand-in": (-0.25, -1.0, 0.25),
    "foot-stand-in": (0.8, -0.8, 0.35),
    "cowboy-hat-stand-in": (0.8, -0.9, 0.35),
    "chinese-lion-stand-in": (0.25, -1.0, 0.1),
    "statue-of-liberty-stand-in": (0.3, -1.0, 0.1),
    "isis-statue-stand-in": (0.7, -1.0, 0.2),
    "nefertiti-stand-in": (0.9, -0.7, 0.15),
}
DEFAULT_VIEW = (0.55, -1.0, 0.25)
#: Pictures in a row, and the side of each in pixels.
COLUMNS, SIZE = 5, 420


def contact_sheet() -> Section:
    """Draw all stand-ins on one sheet with names and counts."""
    rows = -(-len(ROWS) // COLUMNS)
    figure = Figure(figsize=(COLUMNS * SIZE / 100, rows * (SIZE + 50) / 100), dpi=100)
    FigureCanvasAgg(figure)
    for k, name in enumerate(ROWS):
        mesh = stand_in(name)
        axes = figure.add_subplot(rows, COLUMNS, k + 1)
        axes.imshow(seen_from(VIEWS.get(name, DEFAULT_VIEW), mesh))
        axes.set_axis_off()
        axes.set_title(f"{name}\n{mesh.m:,} faces", fontsize=11, y=-0.12)
    figure.subplots_adjust(left=0, right=1, top=1, bottom=0.03, wspace=0, hspace=0.12)
    buffer = BytesIO()
    figure.savefig(buffer, format="jpg", dpi=65, pil_kwargs={"quality": 80})
    return Section([], files={"reports/surfaces/contact_sheet.jpg": buffer.getvalue()})


def seen_from(view: Sequence[float], mesh: TriangleMesh) -> np.ndarray:
    """Return the pixels of a shaded surface; `view` is the direction to the eye, z up."""
    eye = np.asarray(view, dtype=float) / np.linalg.norm(view)
    right = np.cross((0, 0, 1.0), eye)
    right /= np.linalg.norm(right) + 1e-12
    turned = mesh.V @ np.stack([right, np.cross(eye, right), eye], axis=1)
    return draw_clay(mesh.F, framed(turned), SIZE)
