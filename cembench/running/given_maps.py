"""Maps that somebody made, one file a surface, as an algorithm that a run measures.

A file belongs to the surface of the run that it holds: the same triangles with the same positions,
in whatever order, with vertices that occur several times along seams, in single precision or with
few digits (:mod:`cembench.mesh.uvs`). Its name plays no part.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import get_args

import numpy as np

from cembench.conformal.metrics import circle_of
from cembench.core.arrays import Complex
from cembench.core.errors import MeshError, ParameterError
from cembench.core.program import MapFiles
from cembench.core.reporter import Reporter
from cembench.core.wording import counted
from cembench.mesh.files import is_named_like_a_mesh
from cembench.mesh.soup import Soup
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
from cembench.mesh.uvs import SAME_PLACE, OtherSurfaceError, read_with_uv, uv_of_corners
from cembench.registry import MAPS, Algorithm, Target, maps_from
from cembench.running.external.exchange import ProgramFault, of_vertices


def given_maps(
    called: str, folder: Path, meshes: Sequence[TriangleMesh], reporter: Reporter
) -> tuple[Algorithm, str]:
    """Return the algorithm whose maps are in a folder, and the plug-in that declares it.

    It is called NAME or NAME:TARGET.

    Without a target the files say what they are: atlases if one of them is cut along seams, maps to
    the disk if all boundaries are circles, and else maps with a free boundary.

    Raises
    ------
    ParameterError
        The folder cannot be listed, no file in it is a map of one of these surfaces, two of them
        are maps of the same one, or the target is unknown.
    """
    name, _, target = called.partition(":")
    where = f"maps={called}={str(folder)!r}"
    if target and target not in get_args(Target):
        raise ParameterError(
            f"{where}: {target!r} is not a target; allowed: {', '.join(get_args(Target))}."
        )
    try:
        paths = sorted(path for path in folder.iterdir() if is_named_like_a_mesh(path))
    except OSError as error:
        raise ParameterError(f"{where} cannot be listed: {error.strerror or error}.") from None
    files: dict[str, Path] = {}
    kinds: dict[Path, Target] = {}
    strangers = []
    for path in paths:
        try:
            mesh, corners = surface_of(read_with_uv(path), meshes)
        except MeshError as error:
            strangers.append(f"{path} is left out: {str(error).removeprefix(f'{path}: ')}")
            continue
        if mesh.hash in files:
            raise ParameterError(
                f"{where}: {files[mesh.hash].name} and {path.name} are both maps of {mesh.name}; "
                "keep one of them."
            )
        files[mesh.hash] = path.absolute()
        kinds[path] = kind_of(mesh, corners)
    if not files:
        why = strangers[0] if strangers else "It has no file of a mesh with UVs."
        raise ParameterError(f"{where} has no map of a surface of this run. {why}")
    for text in strangers:
        reporter.warn(text)
    kind = target or _common(name, kinds, reporter)
    maps = MapFiles(str(folder), {key: str(path) for key, path in files.items()})
    declared = {"name": name, "target": kind, **vars(maps)}
    return maps_from(declared), MAPS + json.dumps(declared)


def surface_of(file: Soup, meshes: Sequence[TriangleMesh]) -> tuple[TriangleMesh, Complex]:
    """Return the surface that a file holds, and the UVs of its corners (m, 3).

    Raises
    ------
    MeshError
        It is none of these, or a corner has no UV.
    """
    count = len(file.triangles)
    why = f"no surface of this run has its {count:,} triangles"
    for mesh in meshes:
        if mesh.m != count:
            continue
        used = file.V[file.triangles.ravel()]
        box, own = (np.array([V.min(axis=0), V.max(axis=0)]) for V in (used, mesh.V))
        away = float(np.abs(box - own).max())
        if away > SAME_PLACE * float(np.ptp(own, axis=0).max()):
            why = (
                f"{mesh.name} has as many triangles, but its bounding box differs by {away:.3g}. "
                "Write files with the positions of that surface: not moved, scaled or turned "
                "(in Blender: Forward Y, Up Z)"
            )
            continue
        try:
            return mesh, uv_of_corners(file, mesh.V, mesh.F)
        except OtherSurfaceError as error:
            why = f"{mesh.name} has as many triangles, but {error}"
    raise OtherSurfaceError(f"{why}.")


def kind_of(mesh: TriangleMesh, corners: Complex) -> Target:
    """Return what a map is by its looks: whether it is cut, and which boundaries are circles."""
    try:
        uv = of_vertices(corners, mesh)
    except ProgramFault:
        return "atlas"
    if not mesh.loops:
        return "atlas"
    circles = [circle_of(loop, uv[loop]) for loop in mesh.loops]
    round_ones = [circle.circularity <= MapFiles.circle for circle in circles]
    outer = int(np.argmax([np.ptp(uv[loop].real) for loop in mesh.loops]))
    if isinstance(mesh, HoledMesh) and round_ones[outer]:
        return "circular holes" if all(round_ones) else "disk with holes"
    return "disk" if isinstance(mesh, DiskMesh) and round_ones[0] else "free boundary"


def _common(name: str, kinds: dict[Path, Target], reporter: Reporter) -> Target:
    """Return the target of all maps in a folder; a note names those that look like others."""
    several = set(kinds.values())
    if len(several) == 1:
        return several.pop()
    kind: Target = "atlas" if "atlas" in several else "free boundary"
    others = [f"{path.name} ({one})" for path, one in kinds.items() if one != kind]
    reporter.note(
        f"{name}: maps of the target {kind!r}, although {counted(len(others), 'file')} could be "
        f"more: {', '.join(others[:5])}{' ...' if len(others) > 5 else ''}. Name one as "
        f"{name}:TARGET=FOLDER to choose"
    )
    return kind
