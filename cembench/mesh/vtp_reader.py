"""VTK PolyData (`.vtp`), as ParaView and PyVista write it, read through VTK itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from cembench.core.errors import MeshError
from cembench.core.notices import Notice, NoticeKind
from cembench.mesh.soup import Soup, damaged


def read_vtp(path: Path) -> Soup:
    """Read the polygons of a file; vertices and lines of it give a notice.

    Raises
    ------
    MeshError
        The file is damaged, or holds triangle strips.

    """
    from vtkmodules.util.numpy_support import vtk_to_numpy

    found = _poly_data(path)
    if found.GetNumberOfStrips():
        raise MeshError(
            "it holds triangle strips; export it with separate triangles (in ParaView and "
            "PyVista: the filter Triangulate)."
        )
    points, polygons = found.GetPoints(), found.GetPolys()
    if points is None or not points.GetNumberOfPoints():
        raise damaged("it holds no points")
    V = vtk_to_numpy(points.GetData()).astype(np.float64)
    corners = vtk_to_numpy(polygons.GetConnectivityArray()).astype(np.int64)
    sizes = np.diff(vtk_to_numpy(polygons.GetOffsetsArray()))
    counts = {"points": found.GetNumberOfVerts(), "lines": found.GetNumberOfLines()}
    others = ", ".join(f"{count} {kind}" for kind, count in counts.items() if count)
    notices: tuple[Notice, ...] = ()
    if others:
        text = f"cells that are not faces were ignored: {others}"
        notices = (Notice(NoticeKind.LINES_IGNORED, text),)
    return Soup.from_arrays(V, corners, sizes.tolist(), notices=notices)


def _poly_data(path: Path) -> Any:
    """Return what VTK reads; what it would print on the terminal becomes an error."""
    from vtkmodules.vtkCommonCore import vtkLogger
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    told: list[str] = []

    def keep(_source: Any, _event: str, words: str) -> None:
        told.append(words.strip().splitlines()[-1].rpartition("): ")[2].rstrip("."))

    keep.CallDataType = "string0"  # type: ignore[attr-defined]  # so VTK hands over its words
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
    if told or reader.GetErrorCode():
        raise damaged(f"it cannot be read as VTP: {told[0] if told else 'VTK says no more'}")
    return reader.GetOutput()
