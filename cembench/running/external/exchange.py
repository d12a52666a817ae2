"""Files exchanged with a program, the mesh it reads and the UVs it writes, and its faults."""

from __future__ import annotations

import stat
from pathlib import Path

import numpy as np

from cembench.conformal.planar import fitted_circle, polygon_area
from cembench.core.arrays import Complex
from cembench.core.errors import CembenchError, MeshError, NotThere
from cembench.core.parameterization import Atlas, Parameterization
from cembench.mesh.files import write_mesh
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.mesh.uvs import OtherSurfaceError, read_flat, read_uv, read_with_uv, uv_of_corners
from cembench.registry import Algorithm
from cembench.results.records import FaultKind, Status
from cembench.running.map_promises import WITH_HOLES

#: Size limit of a file with UVs: bytes, and bytes per vertex and triangle.
LARGEST_OUTPUT, LARGEST_SHARE = 2**24, 4096


class ProgramFault(CembenchError):  # noqa: N818 - it is a result's status, not a mistake
    """An external program did not do what was expected; the message is the cause."""

    def __init__(
        self, kind: FaultKind, detail: str, *, status: Status = "failed", said: str = ""
    ) -> None:
        super().__init__(detail)
        self.kind, self.status, self.said = kind, status, said

    @property
    def gave_up(self) -> bool:
        """Whether the program ended with a nonzero code, which counts as giving up."""
        return self.kind is FaultKind.GAVE_UP


def write_input(path: Path, mesh: TriangleMesh) -> None:
    """Write a mesh for a program, in the format of the suffix.

    MAT files hold ``v`` and ``f``, counted from 1, NPZ files ``V`` and ``F``, counted from 0.
    """
    if path.suffix == ".npz":
        np.savez(path, V=mesh.V, F=mesh.F)
    elif path.suffix == ".mat":
        from scipy.io import savemat

        savemat(path, {"v": mesh.V, "f": (mesh.F + 1).astype(np.float64)})
    else:
        write_mesh(path, mesh)


def largest_output(mesh: TriangleMesh) -> int:
    """Return the size limit, in bytes, of the file with the UVs of a mesh."""
    return LARGEST_OUTPUT + LARGEST_SHARE * (mesh.n + mesh.m)


def read_output(path: Path, algorithm: Algorithm, mesh: TriangleMesh) -> Parameterization | Atlas:
    """Read a file that a program, or somebody, wrote as a map to the algorithm's target.

    Raises
    ------
    ProgramFault
        There is no such file, it is too large or damaged, or it holds a different surface.
    """
    _check_output(path, mesh)
    try:
        program = algorithm.program
        read = read_uv if program is not None else read_with_uv
        if program is not None and program.flat:
            read = read_flat
        corners = uv_of_corners(read(path), mesh.V, mesh.F)
    except OtherSurfaceError as error:
        message = f"{path.name} is not a map of the surface that it was given: {error}"
        raise ProgramFault(FaultKind.OTHER_SURFACE, message, status="invalid") from None
    except MeshError as error:
        message = f"{path.name}: {error}"
        raise ProgramFault(FaultKind.UNREADABLE_OUTPUT, message) from None
    if algorithm.target == "atlas":
        return Atlas(corners)
    uv = of_vertices(corners, mesh)
    if program.fit if program is not None else algorithm.target in ("disk", *WITH_HOLES):
        uv = _in_unit_circle(uv, mesh)
    return Parameterization(uv)


def read_map(algorithm: Algorithm, mesh: TriangleMesh) -> Parameterization | Atlas:
    """Read the map of a surface that somebody made; raise :class:`NotThere` without a file."""
    assert algorithm.maps is not None
    path = algorithm.maps.files.get(mesh.hash)
    if path is None:
        raise NotThere(f"no file in {algorithm.maps.folder} holds a map of this surface")
    return read_output(Path(path), algorithm, mesh)


def _check_output(path: Path, mesh: TriangleMesh) -> None:
    try:
        about = path.stat()
    except OSError:
        beside = sorted(p.name for p in path.parent.iterdir())
        message = (
            f"it wrote no file {path.name}; its folder holds: {', '.join(beside[:8]) or 'none'}"
        )
        raise ProgramFault(FaultKind.NO_OUTPUT, message) from None
    if not stat.S_ISREG(about.st_mode):
        raise ProgramFault(FaultKind.NO_OUTPUT, f"{path.name} is not a regular file")
    if not about.st_size:
        raise ProgramFault(FaultKind.UNREADABLE_OUTPUT, f"{path.name} is empty (0 bytes)")
    if about.st_size > largest_output(mesh):
        message = (
            f"{path.name} has {about.st_size:,} bytes; for {mesh.n:,} vertices and {mesh.m:,} "
            f"triangles at most {largest_output(mesh):,} are read"
        )
        raise ProgramFault(FaultKind.OUTPUT_TOO_LARGE, message)


def of_vertices(corners: Complex, mesh: TriangleMesh) -> Complex:
    """Return the UV of each vertex (n,); raise if its corners have different ones."""
    uv = np.empty(mesh.n, dtype=np.complex128)
    uv[mesh.F] = corners
    finite = np.isfinite(corners)
    apart = np.unique(mesh.F[finite & (uv[mesh.F] != corners)])
    if len(apart):
        message = (
            f"{len(apart)} vertices have several UVs, the first being {apart[0]}: the surface was "
            'cut. Declare the target "atlas" for such maps'
        )
        raise ProgramFault(FaultKind.CUT_SURFACE, message, status="invalid")
    return uv


def _in_unit_circle(uv: Complex, mesh: TriangleMesh) -> Complex:
    """Return an image shifted and scaled to fit its outer boundary to the unit circle."""
    if not (mesh.loops and np.isfinite(uv).all()):
        return uv
    outer = max(mesh.loops, key=lambda loop: abs(polygon_area(uv[loop])))
    centre, radius = fitted_circle(uv[outer])
    return (uv - centre) / radius if np.isfinite(radius) and radius > 0 else uv
