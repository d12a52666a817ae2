"""Geometry images: a surface sampled on the grid of its map, as a file."""

from __future__ import annotations

import io
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from cembench.core.arrays import Real
from cembench.core.atomic import write_by, write_bytes
from cembench.core.errors import ParameterError, RenderError
from cembench.mesh.triangle_mesh import TriangleMesh

#: File formats of geometry images.
IMAGES = (".npy", ".exr", ".png")


def write_geometry_image(path: Path, mesh: TriangleMesh, samples: Real) -> None:
    """Write the samples of a surface.

    NPY and EXR hold coordinates, NaN off the surface. PNG has 16 bits per channel, with the
    surface's bounding box scaled to 0 ... 1, and is transparent off the surface.

    Raises
    ------
    ParameterError
        The format is unknown.
    RenderError
        The file cannot be written, or OpenEXR is not installed.
    """
    check_image_format(path)
    if path.suffix.lower() == ".exr":
        _write_exr(path, samples)
        return
    content = _npy(samples) if path.suffix.lower() == ".npy" else _png_16_bits(samples, mesh.V)
    write_bytes(path, content, error=RenderError, parents=False)


def check_image_format(path: Path) -> None:
    """Raise if a geometry image cannot be written to this path."""
    if path.suffix.lower() not in IMAGES:
        raise ParameterError(
            f"{path}: {path.suffix!r} is not a format for geometry images; allowed: "
            f"{', '.join(IMAGES)}."
        )
    if path.suffix.lower() == ".exr":
        _openexr()
    if not path.parent.is_dir():
        raise RenderError(f"{path}: there is no folder {path.parent}. Make it first.")


def _npy(samples: Real) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, samples)
    return buffer.getvalue()


def _png_16_bits(samples: Real, V: Real) -> bytes:
    """Return a PNG file with 16 bits per channel, which Pillow cannot write."""
    low, high = V.min(axis=0), V.max(axis=0)
    extent = float((high - low).max()) or 1.0
    known = np.asarray(np.isfinite(samples).all(axis=2))
    stretched = np.where(known[:, :, None], (samples - low) / extent, 0.0).clip(0, 1)
    pixels = np.concatenate([stretched, known[:, :, None]], axis=2)
    rows = (65535 * pixels).round().astype(">u2").reshape(len(samples), -1)
    lines = b"".join(b"\0" + row.tobytes() for row in rows)
    header = struct.pack(">IIBBBBB", samples.shape[1], samples.shape[0], 16, 6, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", zlib.compress(lines, 9)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(content))
        + kind
        + content
        + struct.pack(">I", zlib.crc32(kind + content))
        for kind, content in chunks
    )


def _openexr() -> Any:
    try:
        import OpenEXR
    except ImportError:
        raise RenderError(
            "writing EXR needs the package OpenEXR: pip install 'cembench[formats]'. Or write .npy "
            "or .png."
        ) from None
    return OpenEXR


def _write_exr(path: Path, samples: Real) -> None:
    library = _openexr()
    channels = {"RGB": samples.astype(np.float32)}
    header = {"compression": library.ZIP_COMPRESSION, "type": library.scanlineimage}
    write_by(
        path,
        lambda draft: library.File(header, channels).write(str(draft)),
        error=RenderError,
        parents=False,
    )
