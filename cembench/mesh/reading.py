"""Read mesh files as polygon soups: OBJ, OFF, PLY (ASCII and binary), STL, MATLAB and others.

Every vertex is kept, in the file's order and in float64, and nothing but geometry. No face is lost
silently: the content must match what the file declares, and invalid statements give an error or a
notice. Every reader of ours goes through the file once, so none can hang, and compares what a file
unpacks to with memory first; libraries read in a process whose memory is bounded.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable
from pathlib import Path

from cembench.core.errors import MeshError
from cembench.core.extras import Extra
from cembench.core.loading import TooLargeError
from cembench.mesh.apart import apart
from cembench.mesh.gii_reader import read_gii
from cembench.mesh.gltf_reader import read_gltf
from cembench.mesh.mat_reader import read_mat
from cembench.mesh.npz_reader import read_npz
from cembench.mesh.obj_reader import read_obj
from cembench.mesh.off_reader import read_off
from cembench.mesh.ply_reader import read_ply
from cembench.mesh.soup import Soup
from cembench.mesh.stl_reader import read_stl
from cembench.mesh.vtk_reader import read_vtk
from cembench.mesh.vtp_reader import read_vtp

READERS: dict[str, Callable[[Path], Soup]] = {
    ".obj": read_obj,
    ".off": read_off,
    ".ply": read_ply,
    ".stl": read_stl,
    ".mat": read_mat,
    ".npz": read_npz,
    ".vtk": apart(read_vtk, Extra.FORMATS, "meshio"),
    ".vtu": apart(read_vtk, Extra.FORMATS, "meshio"),
    ".vtp": apart(read_vtp, Extra.VTP, "vtk"),
    ".glb": apart(read_gltf, Extra.FORMATS, "trimesh"),
    ".gltf": apart(read_gltf, Extra.FORMATS, "trimesh"),
    ".gii": apart(read_gii, Extra.FORMATS, "nibabel"),
}
#: Formats of named arrays.
_OF_ARRAYS: dict[str, Callable[[Path, tuple[str, str] | None], Soup]] = {
    ".mat": read_mat,
    ".npz": read_npz,
}
_SPECIAL_FILES = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def is_named_like_a_mesh(path: Path) -> bool:
    """Whether the suffix of a file is a readable mesh format."""
    return path.suffix.lower() in READERS


def read_soup(
    path: str | os.PathLike[str],
    *,
    arrays: tuple[str, str] | None = None,
    polygons: tuple[int, int] | None = None,
) -> Soup:
    """Read the vertices and polygons of a file without checking the surface.

    `arrays` names the vertices and the triangles of a MAT or NPZ file; `polygons` is the first and
    last polygon to read, counted from 0.

    Raises
    ------
    MeshError
        The file is missing, empty, damaged, of unknown format or not a regular file, or it has no
        faces.

    """
    path = Path(path)
    try:
        _check_file(path)
        suffix = path.suffix.lower()
        if arrays and suffix not in _OF_ARRAYS:
            raise MeshError(
                f"arrays can be named only for {', '.join(_OF_ARRAYS)} files, not for {suffix}."
            )
        soup = _OF_ARRAYS[suffix](path, arrays) if arrays else READERS[suffix](path)
        return (soup.subset(*polygons) if polygons else soup).named(path.stem)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from error.__cause__
    except TooLargeError as error:
        raise MeshError(
            f"{path}: {error}. Use a machine with more memory, or a smaller surface."
        ) from error
    except MemoryError as error:
        raise MeshError(f"{path}: the file is too large for this machine's memory.") from error
    except OSError as error:
        raise MeshError(
            f"{path}: the file cannot be read ({error.strerror or error}). Check its permissions "
            "and the disk."
        ) from error


def _check_file(path: Path) -> None:
    """Raise for a path that is not a non-empty regular file, before anything blocks on a pipe."""
    if str(path) == "-":
        raise MeshError(
            "standard input cannot be read as a mesh. Save it to a file and name the file."
        )
    try:
        found = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        what = "there is no such file"
        if path.is_symlink():
            what = f"this is a symbolic link to {path.readlink()}, which does not exist"
        raise MeshError(f"{what}. Check the path; paths are relative to {Path.cwd()}.") from None
    except ValueError:
        raise MeshError("this cannot be a file name. Check the path.") from None
    for is_special, what in _SPECIAL_FILES:
        if is_special(found.st_mode):
            raise MeshError(
                f"this is {what}, not a file. Name a mesh file; save the output of a pipe or a "
                "device to a file first."
            )
    if not is_named_like_a_mesh(path):
        raise MeshError(
            f"unknown mesh format {path.suffix!r}; allowed: {', '.join(READERS)}. "
            "Convert the file to one of these."
        )
    if found.st_size == 0:
        raise MeshError("the file is empty (0 bytes). Export or download it again.")
