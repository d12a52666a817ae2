"""VTK PolyData (`.vtp`), read by ParaView and PyVista, in full precision."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.mesh.writers.textured import Textured

_TYPES = {"float64": "Float64", "int64": "Int64"}


def vtp_bytes(surface: Textured) -> bytes:
    """Return a PolyData file; texture coordinates are its `TCoords`. Seams are cut open."""
    flat = surface.cut_at_seams()
    m = len(flat.F)
    coordinates = _element("Points", [_array("Points", flat.V)])
    polygons = [_array("connectivity", flat.F.ravel()), _array("offsets", 3 * np.arange(1, m + 1))]
    point_data = ""
    if flat.uv is not None:
        point_data = _element("PointData", [_array("uv", flat.uv)], ' TCoords="uv"')
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
