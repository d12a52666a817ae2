"""Pictures of surfaces: one shaded thumbnail, or a sheet of many.

pyvista draws in a process of its own, for where no graphics library is there it does not raise, it
crashes; matplotlib is what remains then.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from cembench.core.atomic import write, write_bytes
from cembench.core.names import file_name
from cembench.mesh.triangle_mesh import TriangleMesh

from .local_operations import vertex_normals

#: From where each surface is seen (x, y, z); figures look along -y.
VIEWS: Mapping[str, tuple[float, float, float]] = {
    "left-hand": (0.15, -1.0, 0.1),
    "stanford-bunny": (-0.45, -1.0, 0.3),
    "human-brain": (-0.25, -1.0, 0.25),
    "foot": (0.8, -0.8, 0.35),
    "cowboy-hat": (0.8, -0.9, 0.35),
    "chinese-lion": (0.25, -1.0, 0.1),
    "statue-of-liberty": (0.3, -1.0, 0.1),
    "isis-statue": (0.7, -1.0, 0.2),
    "nefertiti": (0.9, -0.7, 0.15),
}
DEFAULT_VIEW = (0.55, -1.0, 0.25)

_DRAW = """
import sys, numpy as np, pyvista as pv
data = np.load(sys.argv[1])
V, F, view, size = data["V"], data["F"], data["view"], int(data["size"])
mesh = pv.PolyData(V, np.hstack([np.full((len(F), 1), 3), F]).ravel())
plot = pv.Plotter(off_screen=True, window_size=(size, size), lighting="none")
plot.set_background("white")
flat = len(F) < 3000
plot.add_mesh(mesh, color="#c9b79c", smooth_shading=not flat, show_edges=flat, edge_color="#8a7a60",
              specular=0.25, specular_power=20, split_sharp_edges=False)
centre = (V.max(0) + V.min(0)) / 2
radius = np.linalg.norm(V.max(0) - V.min(0)) / 2
view = view / np.linalg.norm(view)
side = np.cross(view, (0, 0, 1.0)); side /= np.linalg.norm(side) + 1e-12
up = np.cross(side, view)
lights = (view + 0.9 * up - 0.9 * side, 0.85), (view + 0.9 * side, 0.3), (view - up, 0.12)
for direction, strength in lights:
    plot.add_light(pv.Light(position=centre + 10 * radius * direction, focal_point=centre,
                            intensity=strength, light_type="scene light"))
flatwise = V @ np.stack([side, up], axis=1)
low, high = flatwise.min(0), flatwise.max(0)
middle = (low + high) / 2
centre = centre + side * (middle[0] - centre @ side) + up * (middle[1] - centre @ up)
plot.camera.position = centre + 6 * radius * view
plot.camera.focal_point = centre
plot.camera.up = (0, 0, 1)
plot.camera.parallel_projection = True
plot.camera.parallel_scale = 0.53 * (high - low).max()
plot.enable_anti_aliasing("ssaa")
plot.screenshot(sys.argv[2])
"""


def thumbnail(
    mesh: TriangleMesh,
    path: Path,
    *,
    view: Sequence[float] = DEFAULT_VIEW,
    size: int = 480,
) -> str:
    """Draw the shaded surface into a PNG; which of "pyvista", "matplotlib" drew it?

    `view` is the direction from the surface to the eye, z up; `size` in pixels.
    """
    with tempfile.TemporaryDirectory() as folder:
        data, drawn = Path(folder) / "mesh.npz", Path(folder) / "drawn.png"
        np.savez(data, V=mesh.V, F=mesh.F, view=np.asarray(view, dtype=float), size=size)
        done = subprocess.run(
            [sys.executable, "-c", _DRAW, str(data), str(drawn)], capture_output=True, timeout=300
        )
        if done.returncode == 0 and drawn.is_file():
            write_bytes(path, drawn.read_bytes())
            return "pyvista"
    _draw_with_matplotlib(mesh, path, view, size)
    return "matplotlib"


def _draw_with_matplotlib(mesh: TriangleMesh, path: Path, view: Sequence[float], size: int) -> None:
    """The same by scattering shaded vertices, the nearest last."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    eye = np.asarray(view, dtype=float) / np.linalg.norm(view)
    side = np.cross((0, 0, 1.0), eye)
    side /= np.linalg.norm(side) + 1e-12
    up = np.cross(eye, side)
    N = vertex_normals(mesh.V, mesh.F)
    light = eye + 0.9 * up + 0.9 * side
    facing = N @ eye > 0
    shade = 0.25 + 0.75 * np.clip(N @ (light / np.linalg.norm(light)), 0, 1)
    order = np.flatnonzero(facing)[np.argsort(mesh.V[facing] @ eye)]
    figure = Figure(figsize=(size / 100, size / 100), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 1, 1))
    dot = max(1.0, 2 * 72 / 100 * size * np.sqrt(2 / max(len(mesh.V), 1)))
    axes.scatter(
        mesh.V[order] @ side,
        mesh.V[order] @ up,
        c=shade[order, None] * np.array([[0.79, 0.72, 0.61]]),
        s=dot**2,
        linewidths=0,
    )
    axes.set_aspect("equal")
    axes.set_axis_off()
    write(path, lambda file: figure.savefig(file, format="png"))


def contact_sheet(
    meshes: Mapping[str, TriangleMesh], path: Path, *, columns: int = 5, size: int = 420
) -> Path:
    """Draw all `meshes` on one sheet, their names and counts below them; the path of the PNG."""
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
