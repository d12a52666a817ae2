"""A picture in which a person sees at a glance whether a map keeps squares square.

On the left the surface under a checkerboard that was pulled back by the map, on the right the image
under the same checkerboard. The board has 18 squares across the image; in regions where they would
be large on the surface every square is divided into 3 x 3, as often as needed, in both panels alike
(the conformal factor of one map can range over a factor of thousands).

pyvista draws if it can, in a process of its own because without a display or EGL it dies; else a
rasterizer in numpy draws, and matplotlib puts the page together in either case.
"""

from __future__ import annotations

import io
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.image import imsave
from numpy.typing import NDArray

from cembench.core.atomic import write_bytes
from cembench.core.errors import ParameterError, RenderError
from cembench.drawing import compose, draw_numpy
from cembench.drawing.own_pictures import SOFTWARE
from cembench.drawing.scene import FINER, Scene, image_in_window
from cembench.mesh.triangle_mesh import TriangleMesh

Complex = NDArray[np.complex128]
Picture = NDArray[np.uint8]
Renderer = Literal["pyvista", "matplotlib"]

#: Width and height in pixels, and the smallest that can hold two panels and words.
SIZE, LEAST = (1600, 940), (240, 150)
#: Side in pixels of a picture of the surface alone.
THUMBNAIL = 480
#: Seconds after which pyvista is given up.
TIMEOUT = 90.0
#: What a user can do where pyvista dies or draws nothing.
SYSTEM_LIBRARIES = (
    "it needs EGL (or OSMesa) from the system; on Debian or Ubuntu: "
    "apt-get install libegl1 libgl1-mesa-dri"
)


@dataclass(frozen=True)
class RendererUsed:
    """How a picture came about.

    Parameters
    ----------
    renderer : "pyvista" or "matplotlib"
        Which one drew it.
    notice : str
        Why it was not pyvista, although that was to be tried first; else empty.

    """

    renderer: Renderer
    notice: str = ""


class _PyvistaFailed(Exception):  # noqa: N818 - a reason to go another way, not an error
    """Pyvista did not draw; the message says why and what to do."""


def write_preview(
    mesh: TriangleMesh,
    uv: Complex,
    path: Path,
    *,
    title: str = "",
    caption: str = "",
    size: tuple[int, int] = SIZE,
    renderer: Renderer = "pyvista",
) -> RendererUsed:
    """Draw a surface and its image under one checkerboard into a PNG file; which renderer did it?

    Triangles that the map folds over are red in both panels, and ringed where they are small.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface; holes are no matter.
    uv : complex128 (n,)
        Image of each vertex, in a disk or not.
    path : Path
        Where to write; an older file is replaced in one step, or left alone on failure.
    title, caption : str
        Words below the picture; broken into two lines where they are long.
    size : tuple of int
        Width and height of the picture in pixels.
    renderer : "pyvista" or "matplotlib"
        Which one to try first; "matplotlib" is always there.

    Raises
    ------
    ParameterError
        A map of the wrong shape or with values that are not finite; a size that is too small.
    RenderError
        The file cannot be written, or no renderer works.

    """
    png, drawn = _page(mesh, uv, (title, caption), size, renderer)
    write_bytes(path, png, error=RenderError, parents=False)
    return drawn


def preview_png(mesh: TriangleMesh, uv: Complex, *, title: str = "", caption: str = "") -> bytes:
    """Return the picture of :func:`write_preview` as PNG, drawn in this process."""
    return _page(mesh, uv, (title, caption), SIZE, "matplotlib")[0]


def _page(
    mesh: TriangleMesh, uv: Complex, words: tuple[str, str], size: tuple[int, int], first: Renderer
) -> tuple[bytes, RendererUsed]:
    _check(mesh, uv, size)
    scene = Scene.of(mesh, uv)
    (surface, image), drawn = _draw(scene, compose.side_of(size), first)
    outline = image_in_window(uv)[:, :2]
    overlay = compose.Overlay(tuple(outline[loop] for loop in mesh.loops), scene.small_folds)
    return compose.page(surface, image, overlay, (*words, _note(scene)), size), drawn


def write_thumbnail(
    mesh: TriangleMesh, uv: Complex, path: Path, *, side: int = THUMBNAIL
) -> RendererUsed:
    """Draw a surface under the checkerboard of its map into a PNG file; which renderer did it?

    `side` in pixels; the rest, errors too, as in :func:`write_preview`.
    """
    _check(mesh, uv, SIZE)
    (surface, _), drawn = _draw(Scene.of(mesh, uv), side, "pyvista")
    file = io.BytesIO()
    imsave(file, surface, format="png", metadata={"Software": SOFTWARE})
    write_bytes(path, file.getvalue(), error=RenderError, parents=False)
    return drawn


def draw_panels(mesh: TriangleMesh, uv: Complex, side: int) -> tuple[Picture, Picture]:
    """How do a surface and its image look under one checkerboard? uint8 (side, side, 3) each.

    Raises what :func:`write_preview` raises, except for files.
    """
    _check(mesh, uv, SIZE)
    return _draw(Scene.of(mesh, uv), side, "pyvista")[0]


def renderer_status() -> tuple[bool, str]:
    """Does pyvista draw here, and if not, why, and what can the user do?"""
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])
    mesh = TriangleMesh.from_arrays(corners, [[0, 1, 2]])
    try:
        _by_pyvista(Scene.of(mesh, corners[:, 0] + 1j * corners[:, 1]), 32)
    except _PyvistaFailed as reason:
        return False, f"{reason}. Pictures are drawn by matplotlib instead."
    return True, "pyvista draws surfaces"


def _check(mesh: TriangleMesh, uv: Complex, size: tuple[int, int]) -> None:
    if uv.shape != (mesh.n,):
        raise ParameterError(
            f"the map has shape {uv.shape}; allowed is ({mesh.n},), one image a vertex."
        )
    bad = np.flatnonzero(~np.isfinite(uv))
    if len(bad):
        raise ParameterError(
            f"the map is NaN or infinite at {len(bad)} of {mesh.n} vertices, the first being "
            f"{bad[0]} (counted from 0); a picture needs finite values."
        )
    if size[0] < LEAST[0] or size[1] < LEAST[1] or compose.side_of(size) < 64:
        raise ParameterError(
            f"size {size[0]} x {size[1]} leaves no room for two panels and words; allowed is "
            f"{LEAST[0]} x {LEAST[1]} and above."
        )


def _note(scene: Scene) -> str:
    if not scene.refined:
        return ""
    return (
        f"Where squares would be large on the surface they are divided {FINER} by {FINER}, "
        "repeatedly where needed, in both panels alike."
    )


def _draw(
    scene: Scene, side: int, renderer: Renderer
) -> tuple[tuple[Picture, Picture], RendererUsed]:
    notice = ""
    if renderer == "pyvista":
        try:
            return _by_pyvista(scene, side), RendererUsed("pyvista")
        except _PyvistaFailed as reason:
            notice = f"drawn by matplotlib: {reason}"
    try:
        return draw_numpy.draw(scene, side), RendererUsed("matplotlib", notice)
    except (MemoryError, ArithmeticError, ValueError, IndexError) as error:
        raise RenderError(
            f"the picture could not be drawn: {type(error).__name__}: {error}"
            + (f" (and before that, not {notice})" if notice else "")
        ) from error


def _by_pyvista(scene: Scene, side: int) -> tuple[Picture, Picture]:
    """Both panels, from a process that may die without harm to this one."""
    try:
        with tempfile.TemporaryDirectory(prefix="cembench-") as folder:
            source, target = Path(folder, "scene.npz"), Path(folder, "pictures.npz")
            scene.save(source)
            _run(_command(source, target, side), folder)
            with np.load(target) as pictures:
                surface, image = pictures["surface"], pictures["image"]
    except OSError as error:
        raise _PyvistaFailed(f"no picture came back from pyvista ({error})") from None
    if (surface == 255).all() or (image == 255).all():
        raise _PyvistaFailed(f"pyvista drew an empty picture; {SYSTEM_LIBRARIES}")
    return surface, image


def _command(source: Path, target: Path, side: int) -> list[str]:
    module = "cembench.drawing.draw_pyvista"
    return [sys.executable, "-m", module, str(source), str(target), str(side)]


def _run(command: list[str], folder: str) -> None:
    """Run to the end in a folder; :class:`_PyvistaFailed` tells why it did not get there."""
    try:
        done = subprocess.run(
            command,
            cwd=folder,  # a core file would be left there
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise _PyvistaFailed(f"pyvista took more than {TIMEOUT:g} s") from None
    except OSError as error:
        raise _PyvistaFailed(f"the process for pyvista did not start: {error}") from None
    if done.returncode < 0:
        name = _signal_name(-done.returncode)
        raise _PyvistaFailed(f"pyvista died of signal {name}; {SYSTEM_LIBRARIES}")
    if done.returncode:
        raise _PyvistaFailed(_explained(done.stderr))


def _signal_name(number: int) -> str:
    with suppress(ValueError):
        return signal.Signals(number).name
    return str(number)


def _explained(stderr: str) -> str:
    last = next((line for line in reversed(stderr.splitlines()) if line.strip()), "no message")
    if "No module named 'pyvista'" in last:
        return "pyvista is not installed; pip install 'cembench[render]'"
    if last.startswith("ImportError"):
        return f"pyvista cannot be loaded ({last}); {SYSTEM_LIBRARIES}"
    return f"pyvista failed ({last})"
