"""The steps of Koebe's method in one picture, all under the checkerboard of the final map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from cembench.core.atomic import write
from cembench.drawing import painter
from cembench.drawing.compose import INK
from cembench.drawing.scene import Board, folded_by, image_in_window, surface_in_window
from cembench.mesh.triangle_mesh import TriangleMesh

Complex = NDArray[np.complex128]

#: Pixels: panel side, margin, height of the text under a panel and at the top.
SIDE, GAP, LABEL, TITLE = 460, 26, 40, 64
COLUMNS = 4
DPI = 100
#: Colour of the boundary that the step opens.
OPEN = "#c8553d"


@dataclass(frozen=True)
class StepPanel:
    """An image (n,), or the surface if None; `loop` is the highlighted boundary."""

    label: str
    uv: Complex | None = None
    loop: NDArray[np.int64] | None = None


def write_steps(
    mesh: TriangleMesh, panels: Sequence[StepPanel], final: Complex, path: Path, title: str
) -> None:
    """Draw panels in rows into a PNG file.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    panels : sequence of StepPanel
        In order, four per row.
    final : complex (n,)
        The map whose checkerboard is drawn on all panels. Where it and the panel's image are
        conformal, small squares have right angles.
    path : Path
        The PNG file.
    title : str
        Text at the top.

    """
    columns = min(COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    width = columns * (SIDE + GAP) + GAP
    height = TITLE + rows * (SIDE + LABEL + GAP)
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    figure.text(0.5, 1 - TITLE / 2 / height, title, ha="center", va="center", fontweight="bold")
    space = surface_in_window(mesh)
    board = Board.of(mesh.F, space, final)
    for number, panel in enumerate(panels):
        row, column = divmod(number, columns)
        left = GAP + column * (SIDE + GAP)
        bottom = height - TITLE - row * (SIDE + LABEL + GAP) - SIDE
        folded = folded_by(final if panel.uv is None else panel.uv, mesh.F)
        drawn = (
            painter.surface_panel(mesh.F, space, SIDE)
            if panel.uv is None
            else painter.image_panel(mesh.F, space, panel.uv, folded, SIDE)
        )
        picture = painter.paint(drawn, painter.checkerboard(drawn, board), folded)
        figure.figimage(picture, left, bottom, origin="upper")
        if panel.uv is not None:
            _outline(figure, mesh, panel, (left, bottom), (width, height))
        words = f"({chr(ord('a') + number)}) {panel.label}" if number < 26 else panel.label
        x, y = (left + SIDE / 2) / width, (bottom - LABEL / 2) / height
        figure.text(x, y, words, ha="center", va="center", fontsize=10, color=INK)
    write(path, lambda file: figure.savefig(file, format="png", dpi=DPI))


def _outline(
    figure: Figure,
    mesh: TriangleMesh,
    panel: StepPanel,
    corner: tuple[int, int],
    size: tuple[int, int],
) -> None:
    """Draw the highlighted boundary of a panel."""
    assert panel.uv is not None
    window = image_in_window(panel.uv)[:, :2]
    for loop in mesh.loops:
        opened = panel.loop is not None and set(panel.loop) == set(loop)
        curve = np.concatenate([window[loop], window[loop[:1]]])
        x, y = (corner + (curve + 1) / 2 * SIDE).T / np.array(size)[:, None]
        colour, line = (OPEN, 1.8) if opened else (INK, 0.8)
        figure.add_artist(Line2D(x, y, color=colour, linewidth=line))
