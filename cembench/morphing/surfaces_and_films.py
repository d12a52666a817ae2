"""Inputs and outputs of `cembench morph`: surfaces with landmarks, checked maps, films."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.core.errors import AlgorithmFailed, ParameterError
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.morphing import writers
from cembench.morphing.drawing import Film, draw_film
from cembench.morphing.morph import Morph
from cembench.registry import Registry
from cembench.running.local import map_once
from cembench.running.options import Options
from cembench.running.plan import MeasurementSettings, plan_cells, provenances
from cembench.running.surfaces import SurfaceInput, is_generated, load_surface

#: Called with a text at each step.
Tell = Callable[[str], object]


def disk_with_landmarks(
    registry: Registry, surface: SurfaceInput, faces: int | None = None
) -> tuple[DiskMesh, Mapping[str, int]]:
    """Return a disk, and its landmarks by name if it is a registered surface.

    Raises
    ------
    MeshError
        There is no such surface, or it is not a disk.

    """
    mesh = load_surface(surface, (DiskMesh,), faces=faces, registry=registry)
    find = registry.surface(surface).landmarks if is_generated(surface, registry) else None
    return mesh, find(mesh) if find else {}


def checked_maps(
    registry: Registry,
    meshes: Sequence[DiskMesh],
    algorithm: str,
    parameters: Mapping[str, Any],
    plugins: Sequence[str],
    timeout: float,
    tell: Tell,
) -> list[NDArray[np.complex128]]:
    """Map each surface to the disk in its own process, and check the maps.

    Raises
    ------
    AlgorithmFailed
        A surface has no valid map.
    ParameterError
        The algorithm's target is not the disk.

    """
    chosen = registry.algorithm(algorithm)
    if chosen.target != "disk":
        able = ", ".join(a.name for a in registry.algorithms.values() if a.target == "disk")
        raise ParameterError(
            f"{algorithm} maps to the target {chosen.target!r}; a morph needs the disk: {able}."
        )
    maps = []
    for mesh in meshes:
        (task,) = plan_cells([chosen], [mesh], parameters, MeasurementSettings(repeats=1), plugins)
        tell(f"{chosen.title} on {mesh.name}")
        record, uv = map_once(task, Options(timeout=timeout))
        if record.outcome.status != "ok" or uv is None:
            raise AlgorithmFailed(f"{mesh.name}: {record.outcome.status}: {record.outcome.cause}")
        maps.append(uv)
    return maps


def write_path(
    found: Morph, outputs: Sequence[Path], frames: int, tell: Tell = lambda words: None
) -> None:
    """Write the meshes or arrays of a path to the outputs that are not films."""
    times, first = np.linspace(0, 1, frames), found.meshes[0]
    for path in outputs:
        if path.suffix.lower() in writers.ARRAYS and not path.is_dir():
            writers.write_arrays(path, first, times, found.at)
        else:
            writers.write_meshes(path, first, times, found.at, _frame_of(frames, tell))


def write_films(
    found: Morph,
    outputs: Sequence[Path],
    frames: int,
    views: Sequence[str],
    size: int,
    tell: Tell = lambda words: None,
) -> None:
    """Draw a path once, and write it to every output that is a film."""
    film = Film.of(found.meshes[0], found.stops, np.linspace(0, 1, frames), views, size)
    pictures = draw_film(film, _frame_of(frames, tell))
    for path in outputs:
        writers.write_film(path, pictures)


def _frame_of(frames: int, tell: Tell) -> Callable[[int], object]:
    return lambda frame: tell(f"frame {frame + 1} of {frames}")


def rows_of_paper(registry: Registry, surfaces: Sequence[str]) -> tuple[str, ...]:
    """Return the model of the paper that each surface stands in for; "" for none."""
    roles = provenances(registry, [name for name in surfaces if name in registry.surfaces])
    return tuple(roles[name].paper_row if name in roles else "" for name in surfaces)
