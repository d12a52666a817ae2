"""Read mesh files as polygon soups or checked surfaces, and write surfaces and maps to files.

Every vertex is kept, in the file's order and in float64. No face is lost silently: the content must
match what the file declares, and invalid statements give an error or a notice. Every reader of ours
goes through the file once, so none can hang, and compares what a file unpacks to with memory first;
libraries read in a process whose memory is bounded. Polygons are cut into triangles, with a notice.
"""

from __future__ import annotations

import codecs
import os
import stat
from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from cembench.core.arrays import Complex
from cembench.core.atomic import write_bytes
from cembench.core.errors import MeshError
from cembench.core.extras import Extra
from cembench.core.loading import TooLargeError
from cembench.core.names import did_you_mean
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.defects import array_of, check_finite, located, representatives
from cembench.mesh.formats import gii, gltf, mat, npz, obj, off, ply, stl, vtk
from cembench.mesh.formats.isolated import isolated
from cembench.mesh.repair import Repaired, repair
from cembench.mesh.soup import Soup, Texture, complex_of
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh

M = TypeVar("M", bound=TriangleMesh)

READERS: dict[str, Callable[..., Soup]] = {
    ".obj": obj.read,
    ".off": off.read,
    ".ply": ply.read,
    ".stl": stl.read,
    ".mat": isolated(mat.read, Extra.FORMATS, "scipy"),
    ".npz": npz.read,
    ".vtk": isolated(vtk.read, Extra.FORMATS, "meshio", "vtk"),
    ".vtu": isolated(vtk.read, Extra.FORMATS, "meshio", "vtk"),
    ".vtp": isolated(vtk.read, Extra.VTP, "vtk"),
    ".vts": isolated(vtk.read, Extra.VTP, "vtk"),
    ".glb": isolated(gltf.read, Extra.FORMATS, "trimesh"),
    ".gltf": isolated(gltf.read, Extra.FORMATS, "trimesh"),
    ".gii": isolated(gii.read, Extra.FORMATS, "nibabel"),
}
#: How FreeSurfer geometry begins, whose file names have endings of any kind, and FreeSurfer values.
_FREESURFER, _VALUES = (b"\xff\xff\xfe", b"\xff\xff\xfd"), b"\xff\xff\xff"
_read_freesurfer = isolated(gii.read_freesurfer, Extra.FORMATS, "nibabel")
#: Files of other kinds, by the end of their names, and how a surface is made of them.
_NO_SURFACES = {
    (".nii", ".nii.gz", ".mgz", ".mgh"): (
        "it holds a volume, not a surface. Extract one: `V, F, *_ = skimage.measure.marching_cubes("
        "nibabel.load(file).get_fdata(), level)`, then `cembench.parameterize(V, F)`"
    ),
    (".vti", ".vtr"): (
        "it holds a grid of values, not a surface. Extract one: `pyvista.read(file)"
        ".contour([value]).save('surface.vtp')`; of heights, `.warp_by_scalar().extract_surface()`"
    ),
    (".vtm", ".vtmb", ".pvd", ".pvtp", ".pvtu", ".pvts"): (
        "it names other files, one for each part. Save them as one: "
        "`pyvista.read(file).combine().extract_surface().save('surface.vtp')`, or, for a parallel "
        "file, `pyvista.read(file).save('surface.vtp')`"
    ),
    (".gz", ".bz2", ".xz", ".zip", ".7z"): "it is compressed. Unpack it first",
}
#: Formats of named arrays.
_OF_ARRAYS = (".mat", ".npz")
_WRITERS: dict[str, Callable[[Soup], bytes]] = {
    ".obj": obj.write,
    ".ply": ply.write,
    ".glb": gltf.write,
    ".vtp": vtk.write_vtp,
    ".npz": npz.write,
    ".off": off.write,
    ".stl": stl.write,
}
#: Those that can hold a texture, or name its file.
_OF_TEXTURES: dict[str, Callable[..., bytes]] = {".ply": ply.write, ".glb": gltf.write}
#: Formats that hold texture coordinates.
WITH_UV = (".obj", ".ply", ".glb", ".vtp", ".npz")
#: Those whose texture coordinates are read with the surface.
READ_WITH_UV = (".obj", ".off", ".ply", ".glb", ".gltf", ".vtp")
#: Those of which one for each vertex needs copies of vertices.
_WITH_UV_OF_VERTICES = (".obj", ".off", ".ply")
#: Those that hold texture coordinates in single precision.
SINGLE = (".ply", ".glb")
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


def mesh_names(folder: Path) -> list[str]:
    """Return the names of the mesh files in a folder; none if it cannot be listed."""
    try:
        return sorted(p.name for p in folder.iterdir() if is_named_like_a_mesh(p) and p.is_file())
    except OSError:
        return []


def read_soup(
    path: str | os.PathLike[str],
    *,
    arrays: tuple[str, str] | None = None,
    polygons: tuple[int, int] | None = None,
    uv: bool = False,
) -> Soup:
    """Read the vertices and polygons of a file without checking the surface.

    `arrays` names the vertices and the triangles of a MAT or NPZ file; `polygons` is the first and
    last polygon to read, counted from 0; with `uv` texture coordinates of an OBJ, OFF or PLY file
    are read, too.

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
        options: dict[str, Any] = {"arrays": arrays} if arrays else {}
        if uv:
            options["uv"] = True
        read = READERS.get(suffix) or _library_reader(suffix) or _read_freesurfer
        soup = read(path, **options)
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


def _library_reader(suffix: str) -> Callable[..., Soup] | None:
    """Return the reader of a format that only an installed library knows, or None."""
    if suffix in (".3mf", ".dae") and find_spec("trimesh"):
        return isolated(gltf.read, Extra.FORMATS, "trimesh")
    if suffix in (".msh", ".mesh", ".inp") and find_spec("meshio"):
        return isolated(vtk.read_by_meshio, Extra.FORMATS, "meshio")
    return None


def _check_file(path: Path) -> None:
    """Raise for a path that is not a non-empty regular file, before anything blocks on a pipe."""
    if str(path) == "-":
        raise MeshError(
            "standard input cannot be read as a mesh. Save it to a file and name the file."
        )
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError):
        what = "there is no such file"
        if path.is_symlink():
            what = f"this is a symbolic link to {path.readlink()}, which does not exist"
        raise MeshError(
            f"{what}. Check the path; paths are relative to {Path.cwd()}."
            + did_you_mean(path.name, mesh_names(path.parent))
        ) from None
    except ValueError:
        raise MeshError("this cannot be a file name. Check the path.") from None
    for is_special, what in _SPECIAL_FILES:
        if is_special(status.st_mode):
            raise MeshError(
                f"this is {what}, not a file. Name a mesh file; save the output of a pipe or a "
                "device to a file first."
            )
    for ends, what in _NO_SURFACES.items():
        if path.name.lower().endswith(ends):
            raise MeshError(f"{what}.")
    with path.open("rb") as file:
        begin = file.read(3)
    if not is_named_like_a_mesh(path):
        if begin == _VALUES:
            raise MeshError(
                "it holds FreeSurfer values of vertices, such as a thickness; name the file of the "
                "surface, such as lh.pial."
            )
        if begin not in _FREESURFER and _library_reader(path.suffix.lower()) is None:
            raise MeshError(
                f"unknown mesh format {path.suffix!r}; allowed: {', '.join(READERS)}, and geometry "
                "of FreeSurfer. Convert the file to one of these."
            )
    if status.st_size == 0:
        raise MeshError("the file is empty (0 bytes). Export or download it again.")
    if begin.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise MeshError(
            "it is text in UTF-16, as `>` of Windows PowerShell 5 writes it. Save it as UTF-8."
        )


def read_mesh(
    path: str | os.PathLike[str],
    mesh_type: type[M] | None = None,
    *,
    arrays: tuple[str, str] | None = None,
    polygons: tuple[int, int] | None = None,
) -> M:
    """Read a file as a checked surface, named after the file's stem.

    :func:`cembench.load_surface` also takes names and arrays, repairs and cuts.

    Parameters
    ----------
    path : path
        OBJ, OFF, PLY, STL, MAT or NPZ; with the extra "formats" also VTK, VTU, GLB, GLTF and GII.
    mesh_type : type, optional
        The required class: `DiskMesh`, `HoledMesh`, or `TriangleMesh` for any surface; default: a
        disk, or a surface with holes.
    arrays : tuple of two str, optional
        For MAT and NPZ files: the names of the vertices and of the triangles (default: found
        automatically).
    polygons : tuple of two int, optional
        The first and the last polygon to read, counted from 0 (default: all). Vertices of other
        polygons are dropped.

    Returns
    -------
    DiskMesh, HoledMesh or TriangleMesh
        The surface.

    Raises
    ------
    MeshError
        The file is missing, empty, damaged or of unknown format, or its mesh fails a check.

    Examples
    --------
    >>> import cembench
    >>> cembench.write_mesh("disk.obj", cembench.surface("flat-disk", 600))
    >>> mesh = cembench.read_mesh("disk.obj")
    >>> mesh.name, mesh.m
    ('disk', 600)
    """
    soup = read_soup(path, arrays=arrays, polygons=polygons)
    kinds: Any = (DiskMesh, HoledMesh) if mesh_type is None else (mesh_type,)
    return most_special(soup, kinds, Path(path))


def most_special(soup: Soup, kinds: Sequence[type[M]], path: Path | None = None) -> M:
    """Check polygons as the most special of these classes that fits.

    Raises
    ------
    MeshError
        None fits; the message says why it is not of the first.
    """
    refused: dict[type[M], MeshError] = {}
    for kind in sorted(kinds, key=lambda kind: len(kind.mro()), reverse=True):
        try:
            return checked(soup, kind, path)
        except MeshError as error:
            refused[kind] = error
    raise refused[kinds[0]]


def repaired_soup(soup: Soup, path: Path | None = None) -> tuple[Soup, Repaired]:
    """Repair the content of a file; return its largest surface and a summary of the repair.

    Raises
    ------
    MeshError
        Nothing is left of its mesh.
    """
    repaired = repair_soup(soup, path)
    notices = soup.notices + repaired.notices
    return Soup.of_triangles(*repaired.surfaces[0], name=soup.name, notices=notices), repaired


def repair_soup(soup: Soup, path: Path | None = None, **options: Any) -> Repaired:
    """Repair the content of a file, as :func:`cembench.mesh.repair.repair` does.

    Whether coincident vertices are copies is known where the surface was cut by us, and where an
    OBJ, OFF or PLY file has a texture coordinate for each vertex.
    """
    copies = False if any(n.kind is NoticeKind.CUT_OPEN for n in soup.notices) else None
    if path is not None and copies is None and path.suffix.lower() in _WITH_UV_OF_VERTICES:
        with suppress(MeshError):  # of texture coordinates, which a repair can do without
            copies = _has_uv_of_vertices(read_soup(path, uv=True)) or None
    with located(path):
        return repair(soup.V, soup.corners, soup.sizes, copies=copies, **options)


def _has_uv_of_vertices(soup: Soup) -> bool:
    """Whether vertices at one position have different texture coordinates, one each."""
    if (
        soup.uv is None
        or len(soup.uv) != len(soup.V)
        or (soup.uv_triangles != soup.triangles).any()
    ):
        return False
    first = representatives(soup.V)
    return bool((np.abs(soup.uv - soup.uv[first]) > 0).any())


def checked(soup: Soup, mesh_type: type[M], path: Path | None = None) -> M:
    """Cut the polygons of a file into triangles and check them as a surface of this class.

    Vertices in no polygon of a file are left out, with a notice; arrays must not have any, since
    their rows would get other numbers.

    Raises
    ------
    MeshError
        A check fails.
    """
    if path is not None:
        soup, _ = soup.without_isolated()
    polygons = int((soup.sizes > 3).sum())
    notices = soup.notices
    if polygons:
        text = f"{polygons} polygons were cut into triangles"
        notices += (Notice(NoticeKind.POLYGONS_CUT, text),)
    try:
        with located(path):
            return mesh_type.from_arrays(soup.V, soup.triangles, name=soup.name, notices=notices)
    except MemoryError as error:
        raise MeshError(
            f"{path or soup.name}: memory does not suffice to check {len(soup.V):,} vertices and "
            f"{len(soup.sizes):,} polygons. Use a machine with more, or a smaller surface."
        ) from error


def write_mesh(
    path: str | os.PathLike[str], mesh: TriangleMesh, uv: ArrayLike | None = None
) -> None:
    """Write a surface, with a map as its texture coordinates if one is given.

    The file is written completely or not at all. OBJ, VTP and NPZ hold texture coordinates in full
    precision; PLY and GLB in single precision, as their readers expect, so that triangles fold
    where the map shrinks the surface strongly.

    Parameters
    ----------
    path : path
        OBJ, PLY, GLB, VTP or NPZ; without a map also OFF and STL.
    mesh : TriangleMesh
        The surface.
    uv : complex (n,) or float (n, 2), optional
        Image of each vertex, written unchanged. :func:`cembench.mesh.unit_square.to_unit_square`
        moves it to the unit square, where engines expect textures.

    Raises
    ------
    MeshError
        The format is unknown or cannot hold UVs (OFF, STL), `uv` is not one finite value for each
        vertex, or the folder cannot be written to.

    Examples
    --------
    >>> import cembench
    >>> disk = cembench.surface("flat-disk", 600)
    >>> cembench.write_mesh("disk_uv.obj", disk, disk.V[:, 0] + 1j * disk.V[:, 1])
    """
    path, n = Path(path), mesh.n
    allowed = f"one value for each of the {n} vertices: complex, shape ({n},), or real, ({n}, 2)"
    with located(path):
        z = None if uv is None else complex_images(uv, [(n,)], allowed)
    write_soup(path, Soup.of_triangles(mesh.V, mesh.F, z, name=mesh.name))


def complex_images(uv: ArrayLike, shapes: Sequence[tuple[int, ...]], allowed: str) -> Complex:
    """Return images as finite complex numbers of one of the `shapes`.

    Real ones have two columns more. The error says in the words `allowed` what is.
    """
    z = array_of("UVs", uv, 2)
    if z.shape in [(*shape, 2) for shape in shapes] and z.dtype.kind in "fiu":
        z = complex_of(z).reshape(z.shape[:-1])
    if z.shape not in shapes or z.dtype.kind != "c":
        raise MeshError(f"uv is of type {z.dtype} and shape {z.shape}; allowed is {allowed}.")
    check_finite("uv is", z.ravel())
    return z.astype(np.complex128)


def write_soup(path: Path, surface: Soup, texture: Texture | None = None) -> None:
    """Write a surface with its texture coordinates and a texture; as :func:`write_mesh`."""
    check_writable_format(path, with_uv=surface.uv is not None)
    suffix = path.suffix.lower()
    if suffix in _OF_TEXTURES:
        content = _OF_TEXTURES[suffix](surface, texture=texture)
    else:
        content = _WRITERS[suffix](surface)
    write_bytes(path, content, error=MeshError, parents=False)


def check_writable_format(path: Path, *, with_uv: bool) -> None:
    """Raise :class:`MeshError` if :func:`write_mesh` cannot write a file of this name."""
    suffix = path.suffix.lower()
    allowed = WITH_UV if with_uv else tuple(_WRITERS)
    if suffix not in allowed:
        readable = "can be read but not written" if suffix in READERS else "is unknown"
        why = "cannot hold texture coordinates" if suffix in _WRITERS else readable
        raise MeshError(
            f"{path}: mesh format {suffix!r} {why}; allowed here: {', '.join(allowed)}."
        )
    if not path.parent.is_dir():
        raise MeshError(f"{path}: there is no folder {path.parent}. Make it first.")
