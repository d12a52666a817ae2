"""Write a path as a film (GIF, MP4), numbered meshes (OBJ, PLY), or arrays (NPZ), by suffix."""

from __future__ import annotations

import errno
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np
from numpy.typing import NDArray

from cembench.core import atomic
from cembench.core.arrays import Real
from cembench.core.errors import ParameterError
from cembench.core.extras import Extra, require
from cembench.mesh.files import write_mesh
from cembench.mesh.triangle_mesh import TriangleMesh

from .drawing import draw_film

if TYPE_CHECKING:
    from .morph import Morph

Pictures = NDArray[np.uint8]

#: Frames per second.
RATE = 24
FILMS, MESHES, ARRAYS = (".gif", ".mp4"), (".obj", ".ply"), (".npz",)


def check_output(path: Path) -> None:
    """Raise :class:`ParameterError` if a path cannot be written here; called before any work."""
    if path.is_dir():
        return
    suffix = path.suffix.lower()
    if suffix not in (*FILMS, *MESHES, *ARRAYS, ""):
        raise ParameterError(
            f"{path}: {suffix!r} is unknown; allowed: .gif or .mp4 for a film, .obj or .ply for "
            "numbered meshes, a folder for PLY meshes, .npz for arrays."
        )
    if suffix == ".mp4":
        require(Extra.VIDEO, f"{path}: MP4, unlike GIF,")
    if suffix and not path.parent.is_dir():
        raise ParameterError(f"{path}: there is no folder {path.parent}. Make it first.")
    if not suffix and path.is_file():
        raise ParameterError(f"{path} is a file, not a folder; name another place.")


def is_film(path: Path) -> bool:
    """Whether an output is a film."""
    return path.suffix.lower() in FILMS and not path.is_dir()


def files_of(path: Path, frames: int) -> list[Path]:
    """Return the files that are written for this output."""
    if path.suffix.lower() in (*FILMS, *ARRAYS) and not path.is_dir():
        return [path]
    return mesh_files(path, frames)


def write_path(
    morph: Morph,
    outputs: Sequence[Path],
    frames: int,
    views: Sequence[str],
    size: int,
    tell: Callable[[str], object] = lambda words: None,
) -> None:
    """Write a path to every output; a film is drawn once for all.

    `size` is the side of a view in pixels; `tell` is called with each frame.
    """
    for path in outputs:
        check_output(path)
    times, first = np.linspace(0, 1, frames), morph.meshes[0]

    def tell_frame(frame: int) -> None:
        tell(f"frame {frame + 1} of {frames}")

    if any(map(is_film, outputs)):
        pictures = draw_film(first, morph.stops, times, views, size, tell_frame)
    for path in outputs:
        if is_film(path):
            write_film(path, pictures)
        elif path.suffix.lower() in ARRAYS and not path.is_dir():
            write_arrays(path, first, times, morph.at)
        else:
            write_meshes(path, first, times, morph.at, tell_frame)


def write_film(path: Path, pictures: Pictures) -> None:
    """Write pictures, uint8 (frames, rows, columns, 3), as GIF or MP4 at 24 frames per second.

    Raises
    ------
    RecordError
        The file cannot be written, or the encoder failed.
    """
    if path.suffix.lower() == ".gif":
        atomic.write(path, lambda file: _save_gif(file, pictures))
        return
    atomic.write_by(
        path,
        lambda draft: _encode_mp4(draft, pictures),
        check=lambda draft: _check_mp4(draft, len(pictures)),
    )


def _save_gif(file: BinaryIO, pictures: Pictures) -> None:
    from PIL import Image

    # One palette for all, so that colours do not flicker.
    some = pictures[:: max(len(pictures) // 6, 1)]
    palette = Image.fromarray(np.concatenate(some)).quantize(256, method=Image.Quantize.MEDIANCUT)
    images = [
        Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE)
        for picture in pictures
    ]
    # GIF delays are in hundredths of a second: 4, 4, 4, 5, ... average to 24 per second.
    ends = np.round(np.arange(len(images) + 1) * 100 / RATE).astype(int)
    durations = [int(10 * d) for d in np.diff(ends)]
    images[0].save(
        file, format="GIF", save_all=True, append_images=images[1:], duration=durations, loop=0
    )


def _encode_mp4(path: Path, pictures: Pictures) -> None:
    import imageio_ffmpeg

    rows, columns = (side - side % 2 for side in pictures.shape[1:3])  # the codec needs even sides
    encoder = imageio_ffmpeg.write_frames(
        str(path),
        (columns, rows),
        fps=RATE,
        quality=8,
        macro_block_size=2,
        ffmpeg_log_level="error",
    )
    encoder.send(None)
    for picture in pictures:
        encoder.send(np.ascontiguousarray(picture[:rows, :columns]))
    encoder.close()


def _check_mp4(path: Path, frames: int) -> None:
    """Raise OSError if frames are missing, since the encoder does not report a full disk."""
    import imageio_ffmpeg

    try:
        count, _ = imageio_ffmpeg.count_frames_and_secs(str(path))
    except RuntimeError:
        count = 0
    if count != frames:
        raise OSError(
            errno.EIO, f"only {count} of {frames} frames were written; the disk may be full"
        )


def mesh_files(path: Path, frames: int) -> list[Path]:
    """Return the numbered files: a_000.obj for ``a.obj``, f/frame_000.ply for a folder f."""
    digits = max(3, len(str(frames - 1)))
    if path.suffix and not path.is_dir():
        return [path.with_stem(f"{path.stem}_{k:0{digits}d}") for k in range(frames)]
    return [path / f"frame_{k:0{digits}d}.ply" for k in range(frames)]


def write_meshes(
    path: Path,
    mesh: TriangleMesh,
    times: Sequence[float] | Real,
    at: Callable[[float], Real],
    tell: Callable[[int], object] = lambda frame: None,
) -> list[Path]:
    """Write a mesh for each time, with the triangles of `mesh` and the vertices `at` that time.

    All files are renamed at the end, so that no partial sequence is left.

    Raises
    ------
    RecordError
        The files cannot be written.
    """
    files = mesh_files(path, len(times))
    place = files[0].parent
    try:
        place.mkdir(parents=True, exist_ok=True)
        with atomic.draft_folder(files[0]) as folder:
            for k, (file, time) in enumerate(zip(files, times, strict=True)):
                write_mesh(folder / file.name, mesh.moved(at(time)))
                tell(k)
            for file in files:
                (folder / file.name).replace(file)
    except OSError as error:
        raise atomic.unwritable(files[0], error) from error
    return files


def write_arrays(path: Path, mesh: TriangleMesh, times: Real, at: Callable[[float], Real]) -> None:
    """Write `frames` (frames, n, 3), `times` (frames,) and `F` (m, 3) as NPZ."""
    frames = np.empty((len(times), mesh.n, 3))
    for k, time in enumerate(times):
        frames[k] = at(time)
    atomic.write(path, lambda file: np.savez(file, frames=frames, times=times, F=mesh.F))
