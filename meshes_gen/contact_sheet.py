"""Thumbnails of surfaces: a single one, or a sheet of many."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from cembench.core.atomic import write
from cembench.core.names import file_name
from cembench.drawing.painter import draw_clay
from cembench.drawing.scene import framed
from cembench.mesh.triangle_mesh import TriangleMesh

#: Viewing direction of each surface (x, y, z); figures look along -y.
VIEWS: Mapping[str, tuple[float, float, float]] = {
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


def thumbnail(
    mesh: TriangleMesh,
    path: Path,
    *,
    view: Sequence[float] = DEFAULT_VIEW,
    size: int = 480,
) -> None:
    """Draw the shaded surface into a PNG file.

    `view` is the direction from the surface to the eye, z up; `size` is in pixels.
    """
    eye = np.asarray(view, dtype=float) / np.linalg.norm(view)
    right = np.cross((0, 0, 1.0), eye)
    right /= np.linalg.norm(right) + 1e-12
    turned = mesh.V @ np.stack([right, np.cross(eye, right), eye], axis=1)
    picture = Image.fromarray(draw_clay(mesh.F, framed(turned), size))
    write(path, lambda file: picture.save(file, format="PNG"))


def contact_sheet(
    meshes: Mapping[str, TriangleMesh], path: Path, *, columns: int = 5, size: int = 420
) -> Path:
    """Draw all `meshes` on one sheet with names and counts; return the path of the PNG file."""
    from matplotlib import image
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows = -(-len(meshes) // columns)
    figure = Figure(figsize=(columns * size / 100, rows * (size + 50) / 100), dpi=100)
    FigureCanvasAgg(figure)
    with tempfile.TemporaryDirectory() as folder:
        for k, (name, mesh) in enumerate(meshes.items()):
            picture = Path(folder) / f"{file_name(name)}.png"
            thumbnail(mesh, picture, view=VIEWS.get(name, DEFAULT_VIEW), size=size)
            axes = figure.add_subplot(rows, columns, k + 1)
            axes.imshow(image.imread(picture))
            axes.set_axis_off()
            axes.set_title(f"{name}\n{mesh.m:,} faces", fontsize=11, y=-0.12)
    figure.subplots_adjust(left=0, right=1, top=1, bottom=0.03, wspace=0, hspace=0.12)
    write(path, lambda file: figure.savefig(file, format="png"))
    return path
