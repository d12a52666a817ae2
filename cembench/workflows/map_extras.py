"""Extra outputs of `map`: a geometry image, a remeshed surface, and an interactive page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.resample import regular_remesh
from cembench.core.errors import MeshError, ParameterError
from cembench.core.extras import Extra, require
from cembench.core.notices import Notice
from cembench.mesh.files import check_writable_format
from cembench.mesh.triangle_mesh import TriangleMesh
from cembench.results.records import Record
from cembench.workflows.geometry_images import check_image_format, write_geometry_image
from cembench.workflows.map_files import FileOptions, check_file_options, save_map
from cembench.workflows.places import Place


@dataclass(frozen=True)
class Extras:
    """Extra files to write with a map.

    Parameters
    ----------
    samples : Path, optional
        Path of a geometry image: NPY, EXR or PNG.
    remeshed : Path, optional
        Path of the surface remeshed through the map.
    side : int
        Samples along a side, for both files.
    place : Place
        Placement of the texture coordinates of the new mesh.
    page : Path, optional
        Path of an interactive page with surface and map.

    """

    samples: Path | None = None
    remeshed: Path | None = None
    side: int = 129
    place: Place = Place.unit
    page: Path | None = None

    @property
    def files(self) -> list[Path]:
        """The files to write."""
        return list(self.named.values())

    @property
    def named(self) -> dict[str, Path]:
        """The files to write, by kind."""
        named = {"geometry_image": self.samples, "remeshed": self.remeshed, "html": self.page}
        return {what: path for what, path in named.items() if path is not None}


def write_extras(
    extras: Extras, mesh: TriangleMesh, z: NDArray[np.complex128], record: Record
) -> tuple[Notice, ...]:
    """Write the files; return notices about triangles that rounding folds in the new mesh."""
    told: tuple[Notice, ...] = ()
    if extras.samples is not None:
        write_geometry_image(extras.samples, mesh, z, extras.side)
    if extras.remeshed is not None:
        new, new_z = regular_remesh(mesh, z, extras.side)
        told = save_map(extras.remeshed, new, new_z, FileOptions(extras.place))
    if extras.page is not None:
        from cembench.report.render.view_page import write_view_page
        from cembench.workflows.view import map_page

        notes = [*map(str, mesh.notices), *map(str, record.outcome.notes)]
        write_view_page(extras.page, map_page(mesh, z, record.outcome, record.title, notes))
    return told


def check_extras(
    meshes: Sequence[Path],
    outputs: Sequence[Path | None],
    file_options: FileOptions,
    extras: Extras,
) -> None:
    """Raise the errors of textures and extra files before anything is mapped."""
    check_file_options(meshes, file_options)
    if file_options.textured and None in outputs:
        raise ParameterError("--checker and --bake need a file that uses the texture: add -o.")
    if len(set(outputs)) < len(outputs) and outputs[0] and file_options.place is not Place.unit:
        raise ParameterError("surfaces in one file share the unit square: leave out --uv.")
    if extras.files and len(meshes) > 1:
        raise ParameterError(
            "--geometry-image, --remesh and --html take one surface; map them one by one."
        )
    if extras.page is not None:
        require(Extra.REPORT, "map --html", "jinja2", "markupsafe")
    if extras.page is not None and extras.page.suffix.lower() not in (".html", ".htm"):
        raise ParameterError(f"{extras.page}: --html writes a web page; use the suffix .html.")
    if extras.page is not None and not extras.page.parent.is_dir():
        raise MeshError(f"{extras.page}: there is no folder {extras.page.parent}. Make it first.")
    if extras.samples is not None:
        check_image_format(extras.samples)
    if extras.remeshed is not None:
        check_writable_format(extras.remeshed, with_uv=True)


def check_shells(surfaces: int, path: Path, file_options: FileOptions, extras: Extras) -> None:
    """Raise :class:`ParameterError` for options that a file of several surfaces cannot have."""
    if surfaces < 2:
        return
    if extras.files:
        raise ParameterError(
            f"{path} holds {surfaces} surfaces; --geometry-image, --remesh and --html take one. "
            "`cembench repair --components all` writes each to its own file."
        )
    if file_options.place is not Place.unit:
        raise ParameterError(
            f"{path} holds {surfaces} surfaces, which share the unit square: leave out --uv."
        )
