"""Pictures and angle distributions of a surface and its maps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path, PurePosixPath

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.curvature import mean_curvature
from cembench.conformal.metrics import angle_errors
from cembench.core.atomic import write_bytes
from cembench.core.names import digest, distinct_slugs
from cembench.drawing import painter
from cembench.drawing.scene import Board, folded_by, surface_in_window
from cembench.drawing.view_scene import (
    ViewedMap,
    rotated_to_match,
    triangles_per_surface,
    upright,
    view_scene,
)
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.report.content.evidence import DISK, AlgorithmSeries, Evidence, MeasuredSurface
from cembench.report.document import Figure
from cembench.results.records import Record

#: Pixels of one panel of a picture.
SIDE = 420
#: Width of a histogram bin and its upper end, in degrees.
BIN, LAST = 0.1, 10.0
#: Tolerance of recomputed angles relative to the record's mean, for rounding.
ROUNDING = 1e-9


@dataclass(frozen=True)
class Angles:
    """The distribution of a map's angular distortions.

    Parameters
    ----------
    shares : float64 (k,)
        Share of the corners in each bin of :data:`BIN` degrees from 0 to :data:`LAST`.
    below_one : float
        Share of the corners that change by less than one degree.
    corners : int
        Number of corners.
    agrees : bool
        Whether their mean agrees with the record.
    """

    shares: NDArray[np.float64]
    below_one: float
    corners: int
    agrees: bool


@dataclass(frozen=True)
class Inspection:
    """Pictures and angles of a surface; empty if the run did not save it.

    `checkerboards` and `angles` are by the label of the series.
    """

    surface: MeasuredSurface
    kept: bool
    checkerboards: Mapping[str, Figure] = field(default_factory=dict)
    curvature: Figure | None = None
    mesh: Figure | None = None
    angles: Mapping[str, Angles] = field(default_factory=dict)
    #: The interactive scene of the surface and its maps; empty without maps.
    scene: bytes = b""

    @property
    def missing_reason(self) -> str:
        """Why there are no pictures."""
        return (
            f"the run does not hold the surface {self.surface.name}: it was measured before runs "
            "stored their surfaces"
        )


def inspect_surface(evidence: Evidence, folder: Path, surface: MeasuredSurface) -> Inspection:
    """Draw a surface with every map that ended ok, and compute its angles."""
    mesh = evidence.mesh(surface)
    if mesh is None:
        return Inspection(surface, kept=False)
    slugs = distinct_slugs({digest(s.label): s.label for s in evidence.series})
    write = partial(_write, folder, evidence.name_of(surface))
    points = surface_in_window(mesh)
    space = painter.surface_panel(mesh.F, points, SIDE)
    checkerboards: dict[str, Figure] = {}
    angles: dict[str, Angles] = {}
    shown: tuple[AlgorithmSeries, painter.Panel, NDArray[np.bool_]] | None = None
    viewed: list[ViewedMap] = []
    for series in evidence.series:
        record = evidence.find(surface, series)
        kept_uv = evidence.uv(record)
        if record is None or kept_uv is None:
            continue
        uv = rotated_to_match(kept_uv, viewed[0].z) if viewed else upright(mesh, kept_uv)
        about = _about(series, record)
        viewed.append(ViewedMap(series.label, uv, about))
        folded, board = folded_by(uv, mesh.F), Board.of(mesh.F, points, uv)
        image = painter.image_panel(mesh.F, points, uv, folded, SIDE)
        checkerboards[series.label] = write(
            f"{slugs[digest(series.label)]}-checkerboard",
            [painter.paint(p, painter.checkerboard(p, board), folded) for p in (space, image)],
            title=series.label,
            caption=f"{surface.full_title}, {about}",
            alternative=f"{surface.full_title} and its image by {series.label} under one "
            "checkerboard",
            record=record.cell.key,
        )
        angles[series.label] = _angles(mesh, uv, record)
        if shown is None or (series.algorithm == evidence.reference and series.main):
            shown = (series, image, folded)
    if shown is None:
        return Inspection(surface, kept=True)
    of = f"{surface.full_title} and its image by {shown[0].label}"
    panels, H = ((space, None), shown[1:]), mean_curvature(mesh)
    curved = write(
        "curvature",
        [painter.paint(p, painter.curvature(p, H), folded) for p, folded in panels],
        title="mean curvature",
        caption=f"{of}, coloured by the mean curvature of the surface: orange where it bulges "
        "outwards, blue where it bulges inwards.",
        alternative=f"{of}, coloured by mean curvature",
    )
    meshed = write(
        "mesh",
        [painter.paint(p, painter.edges(p), folded) for p, folded in panels],
        title="mesh",
        caption=f"The mesh of {of}.",
        alternative=f"{of}, with their edges",
    )
    most = triangles_per_surface([s.faces for s in evidence.surfaces])
    scene = view_scene(mesh, viewed, surface.full_title, most)
    return Inspection(surface, True, checkerboards, curved, meshed, angles, scene)


def _write(
    folder: Path,
    surface: str,
    what: str,
    pictures: list[NDArray[np.uint8]],
    *,
    title: str,
    caption: str,
    alternative: str,
    record: str = "",
) -> Figure:
    """Write pictures beside each other to a file, and return its figure."""
    name = f"{surface}-{what}"
    path = PurePosixPath("figures", f"{name}.jpg")
    write_bytes(folder / path, painter.jpeg(painter.beside(pictures)))
    return Figure(name, title, (path,), caption, alternative=alternative, record=record)


def _about(series: AlgorithmSeries, record: Record) -> str:
    """Return a line about a map, to show below its view."""
    metrics = record.outcome.metrics
    error, folds = metrics.get("angle_error_mean_deg"), metrics.get("flipped_triangles")
    target = "" if series.target == DISK else f" (not a map to the disk: {series.target})"
    off = "" if error is None else f"; mean angle error {error:.2f} degrees"
    return f"{series.label}{target}{off}; {folds} folded triangles."


def _angles(mesh: TriangleMesh, uv: NDArray[np.complex128], record: Record) -> Angles:
    errors = angle_errors(mesh, uv).ravel()
    counts, _ = np.histogram(errors, bins=round(LAST / BIN), range=(0.0, LAST))
    recorded = record.outcome.metrics.get("angle_error_mean_deg")
    agrees = recorded is not None and bool(np.isclose(errors.mean(), recorded, rtol=ROUNDING))
    return Angles(counts / len(errors), float((errors < 1).mean()), len(errors), agrees)


def angles_of(evidence: Evidence, record: Record) -> Angles | None:
    """Return the angles of a record's map; None if the run did not save it."""
    uv = evidence.uv(record)
    mesh = None if uv is None else evidence.mesh(evidence.by_hash[record.cell.mesh_hash])
    return None if mesh is None or uv is None else _angles(mesh, uv, record)
