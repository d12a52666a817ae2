"""VTK: surfaces of legacy and XML files; `.vtp` written.

Unstructured grids are read through meshio, everything else, and what meshio refuses, through VTK.
PolyData is what ParaView and PyVista write and read, in full precision.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping, Sequence
from contextlib import redirect_stderr
from dataclasses import replace
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.core.arrays import Indices
from cembench.core.errors import MeshError
from cembench.core.extras import Extra, command
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.soup import Soup, columns, complex_of, damaged, reading_as

#: meshio's names of planar cells with corners in cyclic order.
_POLYGONS = ("triangle", "quad", "polygon")
_TYPES = {"float64": "Float64", "int64": "Int64"}
#: VTK's cell types: planar with corners in cyclic order; strips of triangles; quads by rows; those
#: with curved edges.
_PLANAR, _STRIP, _PIXEL, _CURVED = (5, 7, 9), 6, 8, (22, 23, 28, 30, 34, 36)
#: VTK's readers of XML files.
_XML = {
    ".vtp": "vtkXMLPolyDataReader",
    ".vtu": "vtkXMLUnstructuredGridReader",
    ".vts": "vtkXMLStructuredGridReader",
    ".vtr": "vtkXMLRectilinearGridReader",
    ".vti": "vtkXMLImageDataReader",
}
#: Its readers of legacy files.
_LEGACY = {
    "POLYDATA": "vtkPolyDataReader",
    "STRUCTURED_GRID": "vtkStructuredGridReader",
    "UNSTRUCTURED_GRID": "vtkUnstructuredGridReader",
    "STRUCTURED_POINTS": "vtkStructuredPointsReader",
    "RECTILINEAR_GRID": "vtkRectilinearGridReader",
}
#: What other data sets are, and how a surface is made of them in PyVista and ParaView.
_GRID_OF_VALUES = (
    "a grid of values, not a surface. Extract one: `pyvista.read(file).contour([value])`, or "
    "`warp_by_scalar()` of heights, then `.extract_surface().save('surface.vtp')`; in ParaView, "
    "the filters Contour, Warp By Scalar and Extract Surface"
)
_PARTS = (
    "several data sets in one. Save its surface: `pyvista.read(file).combine().extract_surface()"
    ".save('surface.vtp')`; in ParaView, the filters Merge Blocks and Extract Surface"
)
_SOLID = (
    "a solid, not a surface. Save its surface: "
    "`pyvista.read(file).extract_surface().save('surface.vtp')`; in ParaView, the filter Extract "
    "Surface"
)


def read(path: Path, *, uv: bool = False) -> Soup:
    """Read the faces of a file; other cells, such as lines and tetrahedra, give a notice.

    With `uv` the texture coordinates of points are read, too, by VTK.


    Raises
    ------
    MeshError
        The file is damaged, or holds no surface.
    """
    kind = _data_set(path)
    refused: MeshError | None = None
    if (
        not uv
        and find_spec("meshio")
        and (path.suffix.lower() == ".vtu" or kind == "UNSTRUCTURED_GRID")
    ):
        try:
            return read_by_meshio(path)
        except MeshError as error:
            refused = error
    if find_spec("vtk"):
        return _by_vtk(path)
    if refused is not None:
        raise refused
    raise MeshError(f"{kind} data are read by vtk, which is not installed: {command(Extra.VTP)}.")


def _data_set(path: Path) -> str:
    """Return the kind of data set of a legacy file; "VTK" if none is declared."""
    with path.open("rb") as file:
        kind = re.search(rb"\bDATASET\s+(\w+)", file.read(4096))
    return kind[1].decode() if kind else "VTK"


def read_by_meshio(path: Path) -> Soup:
    """Read the faces of a file of any format that meshio knows."""
    import meshio

    # What its error says it prints as well.
    with reading_as(path.suffix[1:].upper()), redirect_stderr(StringIO()):
        mesh = meshio.read(path)
    return soup_of_cells(mesh.points, mesh.cells)


def _by_vtk(path: Path) -> Soup:
    data = _data_of(path)
    name = data.GetClassName().removeprefix("vtk")
    if data.IsA("vtkCompositeDataSet"):
        raise MeshError(f"it holds {name}, which is {_PARTS}.")
    if data.IsA("vtkImageData") or data.IsA("vtkRectilinearGrid"):
        raise MeshError(f"it holds {name}, which is {_GRID_OF_VALUES}.")
    if not data.IsA("vtkPointSet"):
        raise MeshError(
            f"it holds {name}, which has no triangles. Name a file of a surface, such as PolyData."
        )
    from vtkmodules.util.numpy_support import vtk_to_numpy

    if not data.GetNumberOfPoints():
        raise damaged("it holds no points")
    V = vtk_to_numpy(data.GetPoints().GetData()).astype(np.float64)
    if data.IsA("vtkStructuredGrid"):
        sides = [0, 0, 0]
        data.GetDimensions(sides)
        return Soup.from_arrays(V, *_structured(sides))
    kinds = np.array([data.GetCellType(k) for k in range(data.GetNumberOfCells())], dtype=np.int64)
    if len(curved := np.intersect1d(kinds, _CURVED)):
        raise _curved(_type_name(int(curved[0])))
    faces: list[list[int]] = []
    for k in np.flatnonzero(np.isin(kinds, (*_PLANAR, _STRIP, _PIXEL))).tolist():
        ids = data.GetCell(k).GetPointIds()
        faces += _faces([ids.GetId(i) for i in range(ids.GetNumberOfIds())], int(kinds[k]))
    others = kinds[~np.isin(kinds, (*_PLANAR, _STRIP, _PIXEL))]
    ignored = {f"of type {_type_name(k)}": int((others == k).sum()) for k in np.unique(others)}
    if not faces and ignored:
        raise MeshError(f"it holds only cells {', '.join(ignored)}: {_SOLID}.")
    corners = np.concatenate([*faces, []]).astype(np.int64)
    sizes = [len(face) for face in faces]
    soup = Soup.from_arrays(V, corners, sizes, notices=_ignored(ignored))
    given = data.GetPointData().GetTCoords()
    return soup if given is None else replace(soup, uv=complex_of(vtk_to_numpy(given)[:, :2]))


def _faces(corners: list[int], kind: int) -> list[list[int]]:
    """Return the polygons of a planar cell; a strip has a triangle for each corner after two."""
    if kind == _PIXEL:
        return [[corners[k] for k in (0, 1, 3, 2)]]
    if kind != _STRIP:
        return [corners]
    threes = zip(corners, corners[1:], corners[2:], strict=False)
    return [[b, a, c] if k % 2 else [a, b, c] for k, (a, b, c) in enumerate(threes)]


def _structured(dimensions: Sequence[int]) -> tuple[Indices, Indices]:
    """Return corners and sizes of the quadrilaterals of a structured grid, which must be flat."""
    sides = [side for side in dimensions if side > 1]
    if len(sides) != 2:
        raise MeshError(
            f"it holds a StructuredGrid of {' x '.join(map(str, dimensions))} points, which is "
            f"{_SOLID if len(sides) > 2 else 'a curve, not a surface'}."
        )
    corner = np.arange(sides[0] * sides[1]).reshape(sides[1], sides[0])
    around = corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]
    quads = np.stack([side.ravel() for side in around], axis=1)
    return quads.ravel(), np.full(len(quads), 4)


def _type_name(kind: int) -> str:
    from vtkmodules.vtkCommonDataModel import vtkCellTypes

    return str(vtkCellTypes.GetClassNameFromTypeId(int(kind))).removeprefix("vtk").lower()


def _curved(kind: str) -> MeshError:
    return MeshError(
        f"it has cells of type {kind}, whose edges are curved; export it with straight triangles."
    )


def soup_of_cells(points: Any, cells: Sequence[Any]) -> Soup:
    """Return the planar cells of a meshio mesh; others give a notice."""
    blocks = [b for b in cells if b.type.rstrip("0123456789") in _POLYGONS and len(b.data)]
    curved = [b.type for b in blocks if b.type not in _POLYGONS]
    if curved:
        raise _curved(curved[0])
    others = {f"of type {b.type}": len(b.data) for b in cells if b not in blocks}
    if others and not blocks:
        raise MeshError(f"it holds only cells {', '.join(others)}: {_SOLID}.")
    V = np.asarray(points, dtype=np.float64)
    if V.ndim != 2 or V.shape[1] not in (2, 3):
        raise damaged(f"its points have shape {V.shape}")
    if V.shape[1] == 2:
        V = np.column_stack([V, np.zeros(len(V))])
    faces = [np.asarray(face, dtype=np.int64) for block in blocks for face in block.data]
    corners = np.concatenate(faces) if faces else np.empty(0, dtype=np.int64)
    return Soup.from_arrays(V, corners, [len(face) for face in faces], notices=_ignored(others))


def _ignored(cells: Mapping[str, int]) -> tuple[Notice, ...]:
    """Return a notice of the cells that are not faces, if there are any."""
    others = ", ".join(f"{count} {kind}" for kind, count in cells.items() if count)
    text = f"cells that are not faces were ignored: {others}"
    return (Notice(NoticeKind.LINES_IGNORED, text),) if others else ()


def _data_of(path: Path) -> Any:
    """Return what VTK reads; what it would print on the terminal becomes an error."""
    from vtkmodules import vtkIOLegacy, vtkIOXML
    from vtkmodules.vtkCommonCore import vtkLogger

    messages: list[str] = []

    def keep(_source: Any, _event: str, text: str) -> None:
        messages.append(text.strip().splitlines()[-1].rpartition("): ")[2].rstrip("."))

    keep.CallDataType = "string0"  # type: ignore[attr-defined]  # so VTK passes its text
    suffix = path.suffix.lower()
    is_xml = suffix in _XML
    # The generic reader of legacy files hides the errors of those that it calls.
    legacy = _LEGACY.get(_data_set(path), "vtkGenericDataObjectReader")
    reader = getattr(vtkIOXML, _XML[suffix])() if is_xml else getattr(vtkIOLegacy, legacy)()
    for event in ("ErrorEvent", "WarningEvent"):
        reader.AddObserver(event, keep)
    reader.SetFileName(str(path))
    shown = vtkLogger.GetCurrentVerbosityCutoff()
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    kind = suffix[1:].upper()
    try:
        if is_xml and not reader.CanReadFile(str(path)):
            raise damaged(f"it cannot be read as {kind}: it is no XML file of such VTK data")
        reader.Update()
        data = reader.GetOutputDataObject(0)
    finally:
        vtkLogger.SetStderrVerbosity(shown)
    if messages or reader.GetErrorCode() or data is None:
        why = messages[0] if messages else "VTK says no more"
        raise damaged(f"it cannot be read as {kind}: {why}")
    if not is_xml and data.IsA("vtkPointSet"):
        _check_counts(path, data)
    return data


#: Numbers of a legacy file: points, cells with their corners, and in version 5 these apart.
_NUMBERS = re.compile(
    rb"(?m)^(POINTS|POLYGONS|TRIANGLE_STRIPS)[ ]+(\d+)[ ]+(\w+)\s*\n"
    rb"(?:OFFSETS[ ]+(?:vtktype)?(\w+)\n)?"
)


def _check_counts(path: Path, data: Any) -> None:
    """Raise if a legacy file declares other numbers of points or cells than were read.

    VTK does not notice that a binary file was cut short within its last array.
    """
    content = path.read_bytes()
    read = {b"POINTS": data.GetNumberOfPoints()}
    if data.IsA("vtkPolyData"):
        read |= {b"POLYGONS": data.GetNumberOfPolys(), b"TRIANGLE_STRIPS": data.GetNumberOfStrips()}
    binary = re.search(rb"(?m)^BINARY\s*$", content[:1024]) is not None
    for match in _NUMBERS.finditer(content):
        word, declared, size, offsets = match.groups()
        number = int(declared) - (offsets is not None)  # which count one more
        if number != read.get(word, number):
            raise damaged(f"{number:,} {word.decode()} are declared, but {read[word]:,} were found")
        end = match.end()
        if word == b"POINTS":
            end += 3 * number * (8 if size == b"double" else 4)
        elif offsets is None:
            end += 4 * int(size)
        else:
            width = 8 if offsets == b"int64" else 4
            end += int(declared) * width + int(size) * width
        if binary and end > len(content):
            raise damaged(f"the {word.decode()} take {end:,} bytes, the file has {len(content):,}")


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
