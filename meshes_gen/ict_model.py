"""The files of the ICT face model, read once and kept as small arrays.

The model (Li et al., "Learning formation of physically-based face attributes", CVPR 2020; MIT) is
published as OBJ files with one topology: a neutral face, 100 identities and 53 expressions, each
the neutral face moved by one mode. `CEMBENCH_ICT_FACE` names a folder with all or some of these
files; otherwise they are where ``cembench fetch --group ict-face`` puts them.
"""

from __future__ import annotations

import functools
import hashlib
import io
import os
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from cembench.core.arrays import Indices, Real
from cembench.core.atomic import write_bytes
from cembench.core.errors import DatasetError, MeshError, RecordError
from cembench.mesh.datasets import cache_directory
from cembench.mesh.formats import obj

#: Environment variable for the folder of the model's files.
FOLDER_VARIABLE = "CEMBENCH_ICT_FACE"
NEUTRAL = "generic_neutral_mesh"
IDENTITIES = tuple(f"identity{k:03d}" for k in range(100))
_PAIRS = (
    "browDown browInnerUp browOuterUp cheekPuff cheekSquint eyeBlink eyeLookDown eyeLookIn "
    "eyeLookOut eyeLookUp eyeSquint eyeWide mouthDimple mouthFrown mouthLowerDown mouthPress "
    "mouthSmile mouthStretch mouthUpperUp noseSneer"
)
_SINGLE = (
    "jawForward jawLeft jawOpen jawRight mouthClose mouthFunnel mouthLeft mouthPucker mouthRight "
    "mouthRollLower mouthRollUpper mouthShrugLower mouthShrugUpper"
)
#: Published names; those of one side end with _L or _R, the person's own left and right.
EXPRESSIONS = tuple(
    sorted([f"{name}_{side}" for name in _PAIRS.split() for side in "LR"] + _SINGLE.split())
)
#: Counts of every published file, and those that are kept: skin with mouth and eye sockets.
VERTICES, POLYGONS = 26_719, 26_384
KEPT_VERTICES, KEPT_POLYGONS = 14_062, 14_034


@dataclass(frozen=True)
class FaceModel:
    """The neutral face, and the displacement of each available mode.

    Parameters
    ----------
    V : float64 (14062, 3)
        Vertices of the neutral face; y is up, z to the front.
    corners, sizes : int64
        Its polygons, as in a :class:`cembench.mesh.soup.Soup`.
    identities, expressions : mapping of str to float64 (14062, 3)
        Displacement for a coefficient of 1; only modes whose files are available.
    """

    V: Real
    corners: Indices
    sizes: Indices
    identities: Mapping[str, Real]
    expressions: Mapping[str, Real]


def model_folder() -> Path:
    """Return the folder of the model's files: `CEMBENCH_ICT_FACE`, or the cache."""
    return Path(os.environ.get(FOLDER_VARIABLE) or cache_directory() / "ict-face")


def load_model() -> FaceModel:
    """Return the model with the available modes.

    Raises
    ------
    DatasetError
        The neutral face or all identities are missing, or a file is damaged.
    """
    folder = model_folder()
    there = sorted((p.name, p.stat().st_mtime_ns) for p in folder.glob("*.[no][pb][zj]"))
    return _loaded(folder.absolute(), tuple(there))


@functools.lru_cache(maxsize=2)
def _loaded(folder: Path, there: tuple[tuple[str, int], ...]) -> FaceModel:
    """Load the available files, given as names with modification times."""
    stems = {Path(name).stem for name, _ in there}

    def found(names: tuple[str, ...]) -> list[str]:
        return [name for name in names if name in stems]

    if not found((NEUTRAL,)) or not found(IDENTITIES):
        raise DatasetError(
            f"the ICT face model is not in {folder}: {NEUTRAL}.obj and at least one of "
            f"{IDENTITIES[0]}.obj to {IDENTITIES[-1]}.obj are needed. Run `cembench fetch --group "
            f"ict-face` (405 MB, kept as 27 MB), or set {FOLDER_VARIABLE} to a folder that holds "
            "files of FaceXModel/ from github.com/ICT-VGL/ICT-FaceKit."
        )
    neutral, corners, sizes = _arrays(folder, NEUTRAL)

    def modes(names: tuple[str, ...]) -> Mapping[str, Real]:
        moved = {name: _arrays(folder, name) for name in found(names)}
        for name, (_, other, _) in moved.items():
            if not np.array_equal(other, corners):
                raise DatasetError(
                    f"{folder / name} has other polygons than {NEUTRAL}; take both from one "
                    "version of the model."
                )
        return MappingProxyType({name: V - neutral for name, (V, _, _) in moved.items()})

    return FaceModel(neutral, corners, sizes, modes(IDENTITIES), modes(EXPRESSIONS))


def _arrays(folder: Path, name: str) -> tuple[Real, Indices, Indices]:
    """Return the kept vertices, corners and sizes of a file, small or as published."""
    small = folder / f"{name}.npz"
    if small.is_file():
        arrays = read_small(small)
        if arrays is None:
            raise DatasetError(f"{small} is damaged; delete it, and fetch the model again.")
        return arrays
    published = folder / f"{name}.obj"
    key = hashlib.sha256(published.read_bytes()).hexdigest()
    copy = cache_directory() / "ict-face" / "read" / f"{key}.npz"
    arrays = read_small(copy)
    if arrays is None:
        content = small_arrays(published)
        with suppress(RecordError):  # the cache cannot be written to
            write_bytes(copy, content)
        arrays = _of_bytes(content)
    return arrays


def small_arrays(published: Path) -> bytes:
    """Return the kept part of a published file: an NPZ of 0.4 MB for 2.6 MB of text.

    Raises
    ------
    DatasetError
        The file is not part of the model, or is incomplete.
    """
    try:
        soup = obj.read(published)
    except MeshError as error:
        raise DatasetError(f"{published.name} is not a file of the ICT face model: {error}") from (
            error
        )
    if (len(soup.V), len(soup.sizes)) != (VERTICES, POLYGONS):
        raise DatasetError(
            f"{published.name} has {len(soup.V)} vertices and {len(soup.sizes)} polygons; a file "
            f"of the ICT face model has {VERTICES} and {POLYGONS}. Download it again."
        )
    sizes = soup.sizes[:KEPT_POLYGONS]
    corners = soup.corners[: sizes.sum()]
    if corners.max() >= KEPT_VERTICES:
        raise DatasetError(f"{published.name} numbers its vertices otherwise than the model.")
    buffer = io.BytesIO()
    np.savez_compressed(
        buffer,
        V=soup.V[:KEPT_VERTICES].astype(np.float32),
        corners=corners.astype(np.int16),
        sizes=sizes.astype(np.int8),
    )
    return buffer.getvalue()


def read_small(path: Path) -> tuple[Real, Indices, Indices] | None:
    """Return the arrays of a kept file; None if it is missing, incomplete or another file."""
    try:
        return _of_bytes(path.read_bytes())
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def _of_bytes(content: bytes) -> tuple[Real, Indices, Indices]:
    with np.load(io.BytesIO(content), allow_pickle=False) as data:
        V = data["V"].astype(np.float64)
        corners, sizes = data["corners"].astype(np.int64), data["sizes"].astype(np.int64)
    if V.shape != (KEPT_VERTICES, 3) or sizes.shape != (KEPT_POLYGONS,):
        raise ValueError("arrays of other shapes")
    return V, corners, sizes
