"""Output paths of `cembench map`, and its pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.metrics import caption
from cembench.core.errors import MeshError, ParameterError
from cembench.core.names import file_name
from cembench.drawing.preview import write_preview
from cembench.mesh.files import check_writable_format
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh
from cembench.registry import Algorithm
from cembench.results.records import Record
from cembench.workflows.shells import Shells


def check_takes_disks(candidates: Sequence[Algorithm]) -> None:
    """Raise :class:`ParameterError` if no algorithm takes the disk that a cut makes."""
    if not any(issubclass(DiskMesh, algorithm.mesh_type) for algorithm in candidates):
        raise ParameterError(
            f"--cut makes a disk, which {candidates[0].name} does not take; name an algorithm for "
            "disks (see `cembench list algorithms`)."
        )


def picture_files(
    sources: Sequence[Path], chosen: Sequence[Algorithm], outputs: Sequence[Path | None]
) -> list[Path]:
    """Return the path of each surface's picture: beside its output, or in the current folder.

    Raises
    ------
    ParameterError
        Two pictures would have the same path.

    """
    pictures = [
        Path(f"{file_name(f'{source.stem}_{algorithm.name}')}.png")
        if target is None
        else target.with_suffix(".png")
        for source, algorithm, target in zip(sources, chosen, outputs, strict=True)
    ]
    twice = [picture for picture in pictures if pictures.count(picture) > 1]
    if twice:
        raise ParameterError(
            f"two pictures would be written to {twice[0]}; draw them one at a time."
        )
    return pictures


def output_files(meshes: Sequence[Path], output: Path | None) -> list[Path | None]:
    """Return the output path of each surface: a file, or files in a folder for several.

    If several surfaces go to one file, it is returned once for each.

    Raises
    ------
    MeshError
        The format cannot hold UVs, or the folder does not exist.
    ParameterError
        Two surfaces have the same name.

    """
    if output is None:
        return [None] * len(meshes)
    if not output.is_dir() and (len(meshes) == 1 or output.suffix):
        check_writable_format(output, with_uv=True)
        return [output] * len(meshes)
    if output.is_file():
        raise ParameterError(
            f"{output} is a file, but there are {len(meshes)} surfaces; name a folder with -o."
        )
    if not output.parent.is_dir():
        raise MeshError(f"{output}: there is no folder {output.parent}. Make it first.")
    files = [
        output / f"{path.stem}{'.ply' if path.suffix.lower() == '.ply' else '.obj'}"
        for path in meshes
    ]
    twice = [file for file in files if files.count(file) > 1]
    if twice:
        raise ParameterError(
            f"two surfaces would be written to {twice[0]}; write them to different folders."
        )
    return list(files)


def draw_map(mesh: TriangleMesh, uv: NDArray[np.complex128], picture: Path, record: Record) -> None:
    """Draw a surface and its map as a PNG, with the recorded figures."""
    title = f"{record.cell.mesh}: {record.title}"
    write_preview(mesh, uv, picture, title=title, caption=caption(record.outcome.metrics))


def draw_shells(shells: Shells, maps: Sequence[NDArray[np.complex128]], picture: Path) -> None:
    """Draw the surfaces of a file and their maps, placed as in its UVs, as a PNG."""
    starts = np.cumsum([0, *(part.mesh.n for part in shells.parts)])
    V = np.concatenate([part.mesh.V for part in shells.parts])
    F = np.concatenate([p.mesh.F + k for p, k in zip(shells.parts, starts, strict=False)])
    mesh = TriangleMesh.trusted(V, F, shells.path.stem)
    title = f"{shells.path.stem}: {len(maps)} surfaces"
    write_preview(mesh, np.concatenate(shells.packed(maps)), picture, title=title, turned=False)
