"""VTK: `.vtk` and `.vtu` read through meshio, PolyData (`.vtp`) through VTK; `.vtp` written.

PolyData is what ParaView and PyVista write and read, in full precision.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import MeshError
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.soup import Soup, columns, damaged

#: meshio's names of planar cells with corners in cyclic order.
_POLYGONS = ("triangle", "quad", "polygon")
_TYPES = {"float64": "Float64", "int64": "Int64"}


def read(path: Path) -> Soup:
    """Read the planar cells of a file; others, such as lines and tetrahedra, give a notice."""
    import meshio

    try:
        with redirect_stderr(StringIO()):  # it prints what its error says as well
            mesh = meshio.read(path)
    except MemoryError:
        raise
    except (SystemExit, Exception) as error:  # meshio calls sys.exit on some damaged files
        raise damaged(
            f"it cannot be read as {path.suffix[1:].upper()}: {type(error).__name__}: {error}"
        ) from None
    return soup_of_cells(mesh.points, mesh.cells)


def soup_of_cells(points: Any, cells: Sequence[Any]) -> Soup:
    """Return the planar cells of a meshio mesh; others give a notice."""
    blocks = [b for b in cells if b.type.rstrip("0123456789") in _POLYGONS and len(b.data)]
    curved = [b.type for b in blocks if b.type not in _POLYGONS]
    if curved:
        raise MeshError(
            f"it has cells of type {curved[0]}, whose edges are curved; export it with straight "
            "triangles."
        )
    others = {f"of type {b.type}": len(b.data) for b in cells if b not in blocks}
    V = np.asarray(points, dtype=np.float64)
    if V.ndim != 2 or V.shape[1] not in (2, 3):
        raise damaged(f"its points have shape {V.shape}")
    if V.shape[1] == 2:
        V = np.column_stack([V, np.zeros(len(V))])
    faces = [np.asarray(face, dtype=np.int64) for block in blocks for face in block.data]
    corners = np.concatenate(faces) if faces else np.empty(0, dtype=np.int64)
    return Soup.from_arrays(V, corners, [len(face) for face in faces], notices=_ignored(others))


def read_vtp(path: Path) -> Soup:
    """Read the polygons of a file; vertices and lines of it give a notice.

    Raises
    ------
    MeshError
        The file is damaged, or holds triangle strips.

    """
    from vtkmodules.util.numpy_support import vtk_to_numpy

    data = _poly_data(path)
    if data.GetNumberOfStrips():
        raise MeshError(
            "it holds triangle strips; export it with separate triangles (in ParaView and "
            "PyVista: the filter Triangulate)."
        )
    points, polygons = data.GetPoints(), data.GetPolys()
    if points is None or not points.GetNumberOfPoints():
        raise damaged("it holds no points")
    V = vtk_to_numpy(points.GetData()).astype(np.float64)
    corners = vtk_to_numpy(polygons.GetConnectivityArray()).astype(np.int64)
    sizes = np.diff(vtk_to_numpy(polygons.GetOffsetsArray()))
    counts = {"points": data.GetNumberOfVerts(), "lines": data.GetNumberOfLines()}
    return Soup.from_arrays(V, corners, sizes.tolist(), notices=_ignored(counts))


def _ignored(cells: Mapping[str, int]) -> tuple[Notice, ...]:
    """Return a notice of the cells that are not faces, if there are any."""
    others = ", ".join(f"{count} {kind}" for kind, count in cells.items() if count)
    text = f"cells that are not faces were ignored: {others}"
    return (Notice(NoticeKind.LINES_IGNORED, text),) if others else ()


def _poly_data(path: Path) -> Any:
    """Return what VTK reads; what it would print on the terminal becomes an error."""
    from vtkmodules.vtkCommonCore import vtkLogger
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    messages: list[str] = []

    def keep(_source: Any, _event: str, text: str) -> None:
        messages.append(text.strip().splitlines()[-1].rpartition("): ")[2].rstrip("."))

    keep.CallDataType = "string0"  # type: ignore[attr-defined]  # so VTK passes its text
    reader = vtkXMLPolyDataReader()
    for event in ("ErrorEvent", "WarningEvent"):
        reader.AddObserver(event, keep)
    reader.SetFileName(str(path))
    shown = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        if not reader.CanReadFile(str(path)):
            raise damaged("it cannot be read as VTP: it is no XML file of VTK PolyData")
        reader.Update()
    finally:
        vtkLogger.SetStderrVerbosity(shown)
    if messages or reader.GetErrorCode():
        why = messages[0] if messages else "VTK says no more"
        raise damaged(f"it cannot be read as VTP: {why}")
    return reader.GetOutput()


def write_vtp(surface: Soup) -> bytes:
    """Return a PolyData file; texture coordinates are its `TCoords`. Seams are cut open."""
    flat = surface.cut_at_seams()
    m = len(flat.sizes)
    coordinates = _element("Points", [_array("Points", flat.V)])
    polygons = [_array("connectivity", flat.corners), _array("offsets", np.cumsum(flat.sizes))]
    point_data = ""
    if flat.uv is not None:
        point_data = _element("PointData", [_array("uv", columns(flat.uv))], ' TCoords="uv"')
    piece = _element(
        "Piece",
        [coordinates, _element("Polys", polygons), point_data],
        f' NumberOfPoints="{len(flat.V)}" NumberOfPolys="{m}"',
    )
    head = '<?xml version="1.0"?>\n'
    about = ' type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64"'
    return (head + _element("VTKFile", [_element("PolyData", [piece])], about)).encode()


def _element(name: str, content: Sequence[str], attributes: str = "") -> str:
    return f"<{name}{attributes}>\n{''.join(content)}</{name}>\n"


def _array(name: str, values: NDArray[Any]) -> str:
    """Return an array as a binary DataArray element."""
    little = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<"))
    content = np.uint64(little.nbytes).astype("<u8").tobytes() + little.tobytes()
    components = f' NumberOfComponents="{values.shape[1]}"' if values.ndim > 1 else ""
    kind = _TYPES[values.dtype.name]
    return (
        f'<DataArray type="{kind}" Name="{name}"{components} format="binary">'
        f"{base64.b64encode(content).decode()}</DataArray>\n"
    )
