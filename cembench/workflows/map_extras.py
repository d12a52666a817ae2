"""What `map` writes of a surface beside its map: samples, a new mesh, a page to turn it on."""

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
from cembench.workflows.map_files import Wishes, check_wishes, save_map
from cembench.workflows.places import Place


@dataclass(frozen=True)
class Extras:
    """Files that are wanted beside a map.

    Parameters
    ----------
    samples : Path, optional
        A geometry image: NPY, EXR or PNG.
    remeshed : Path, optional
        The surface meshed anew through the map.
    side : int
        Samples along a side, for both.
    place : Place
        Where the texture coordinates of the new mesh lie.
    page : Path, optional
        A page on which to turn surface and map.

    """

    samples: Path | None = None
    remeshed: Path | None = None
    side: int = 129
    place: Place = Place.unit
    page: Path | None = None

    @property
    def files(self) -> list[Path]:
        """Those that are wanted."""
        return list(self.named.values())

    @property
    def named(self) -> dict[str, Path]:
        """Those that are wanted, by what they are."""
        named = {"geometry_image": self.samples, "remeshed": self.remeshed, "html": self.page}
        return {what: path for what, path in named.items() if path is not None}


def write_extras(
    extras: Extras, mesh: TriangleMesh, z: NDArray[np.complex128], record: Record
) -> tuple[Notice, ...]:
    """Write the files; return what rounding folded in the new mesh."""
    told: tuple[Notice, ...] = ()
    if extras.samples is not None:
        write_geometry_image(extras.samples, mesh, z, extras.side)
    if extras.remeshed is not None:
        new, new_z = regular_remesh(mesh, z, extras.side)
        told = save_map(extras.remeshed, new, new_z, Wishes(extras.place))
    if extras.page is not None:
        from cembench.report.render.view_page import write_view_page
        from cembench.workflows.view import map_page

        notes = [*map(str, mesh.notices), *map(str, record.outcome.notes)]
        write_view_page(extras.page, map_page(mesh, z, record.outcome, record.title, notes))
    return told


def check_extras(
    meshes: Sequence[Path], outputs: Sequence[Path | None], wishes: Wishes, extras: Extras
) -> None:
    """Raise what would be raised for a texture or an extra file, before anything is mapped."""
    check_wishes(meshes, wishes)
    if wishes.textured and None in outputs:
        raise ParameterError("--checker and --bake need a file that uses the texture: add -o.")
    if len(set(outputs)) < len(outputs) and outputs[0] and wishes.place is not Place.unit:
        raise ParameterError("surfaces that share one file share the unit square: leave --uv away.")
    if extras.files and len(meshes) > 1:
        raise ParameterError(
            "--geometry-image, --remesh and --html take one surface; map them one by one."
        )
    if extras.page is not None:
        require(Extra.REPORT, "map --html", "jinja2", "markupsafe")
    if extras.page is not None and extras.page.suffix.lower() not in (".html", ".htm"):
        raise ParameterError(f"{extras.page}: --html writes a page; name it with .html.")
    if extras.page is not None and not extras.page.parent.is_dir():
        raise MeshError(f"{extras.page}: there is no folder {extras.page.parent}. Make it first.")
    if extras.samples is not None:
        check_image_format(extras.samples)
    if extras.remeshed is not None:
        check_writable_format(extras.remeshed, with_uv=True)


def check_shells(surfaces: int, path: Path, wishes: Wishes, extras: Extras) -> None:
    """Raise :class:`ParameterError` where a file of several surfaces cannot have what is wished."""
    if surfaces < 2:
        return
    if extras.files:
        raise ParameterError(
            f"{path} holds {surfaces} surfaces; --geometry-image, --remesh and --html take one. "
            "`cembench repair --components all` makes a file of each."
        )
    if wishes.place is not Place.unit:
        raise ParameterError(
            f"{path} holds {surfaces} surfaces, which share the unit square: leave --uv away."
        )
