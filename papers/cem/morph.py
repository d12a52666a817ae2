"""Morph surfaces into each other."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cembench.api.settings import AnyPath, Faces, Timeout, registry_with
from cembench.core.arguments import Range, checked
from cembench.core.errors import AlgorithmFailed, ParameterError
from cembench.core.reporter import SILENT, Reporter

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.registry import Algorithm
    from cembench.running.options import Options
    from cembench.running.surfaces import SurfaceInput

    from .morphing.landmarks import Landmarks
    from .morphing.morph import Morph


__all__ = ["morph"]


@checked
def morph(
    surfaces: Sequence[SurfaceInput],
    landmarks: Mapping[str, Sequence[int]] | AnyPath | None = None,
    *,
    algorithm: str = "direct-cem",
    parameters: Mapping[str, Any] | None = None,
    lam: Annotated[float, Range(1e-6, 1e12)] = 100.0,
    reach: Annotated[float, Range(0, 1)] = 0.4,
    pose: Literal["similarity", "rigid", "keep"] = "similarity",
    faces: Faces | None = None,
    plugins: Sequence[str] = (),
    timeout: Timeout = 600.0,
    reporter: Reporter = SILENT,
) -> Morph:
    """Morph surfaces into each other through conformal maps (Section 6 of the paper).

    The first landmark goes to the centre of the disk, the others are registered by Eq. 34, and the
    first surface's vertices are carried onto all others. By default, the named landmarks that all
    surfaces have are used, such as those of the generated faces. Without any landmarks, curvature
    aligns the surfaces.

    Parameters
    ----------
    surfaces : sequence of meshes, paths, names or pairs of arrays (V, F)
        Two or more topological disks: mesh files, or names from :func:`cembench.list_surfaces`.
    landmarks : mapping or path, optional
        For each landmark name, its vertex on every surface, counted from 0; or a CSV file with a
        row for each; or none.
    algorithm : str
        An algorithm with target disk.
    parameters : mapping, optional
        Parameters of the algorithm.
    lam : float
        Weight of the landmarks in Eq. 34.
    reach : float
        Landmark radius, as a share of the distance to the next; 0: the vertex alone.
    pose : {"similarity", "rigid", "keep"}
        Fit the later surfaces to the first by rotation, shift and scale, without scale, or keep
        them.
    faces : int, optional
        Number of triangles of generated surfaces.
    plugins : sequence of str
        Python files or ``module:name`` with more algorithms.
    timeout : float
        Time limit of a call, in seconds.
    reporter : Reporter
        Receives what is being done.

    Returns
    -------
    Morph
        ``morph.at(t)`` returns the first surface's vertices, float64 (n, 3), at a time from 0 to 1,
        and ``morph.save("film.gif")`` writes the path.

    Raises
    ------
    MeshError
        A surface is damaged or not a disk.
    ParameterError
        There are fewer than two surfaces, or the landmarks are inconsistent.
    AlgorithmFailed
        No map or no registration without folds was found.

    Examples
    --------
    >>> import cembench
    >>> face = cembench.surface("hemi-ellipsoid", 300)
    >>> path = cembench.morph([face, (face.V * [1, 1, 2], face.F)])
    >>> path.at(0.5).shape == (face.n, 3)
    True
    """
    from dataclasses import replace
    from time import perf_counter

    from cembench.drawing.camera import viewpoints
    from cembench.mesh.triangle_mesh import DiskMesh
    from cembench.running.options import Options
    from cembench.running.surfaces import is_generated, load_surface

    from .morphing.morph import morph as register_all

    if len(surfaces) < 2:
        raise ParameterError("a morph needs two surfaces or more; name at least one more.")
    registry = registry_with(plugins, reporter)
    chosen = registry.algorithm(algorithm)
    if chosen.target != "disk":
        able = ", ".join(a.name for a in registry.algorithms.values() if a.target == "disk")
        raise ParameterError(
            f"{algorithm} maps to the target {chosen.target!r}; a morph needs the disk: {able}."
        )
    meshes: list[DiskMesh] = []
    known: list[Mapping[str, int]] = []
    for surface in surfaces:
        what = os.fspath(surface) if isinstance(surface, str | os.PathLike) else "a surface"
        with reporter.busy(f"reading {what}"):
            mesh = load_surface(surface, (DiskMesh,), faces=faces, registry=registry)
        find = registry.surface(surface).landmarks if is_generated(surface, registry) else None
        for notice in mesh.notices:
            reporter.note(f"{mesh.name}: {notice}")
        meshes.append(mesh)
        known.append(find(mesh) if find else {})
    places = _places(landmarks, meshes, known)
    first, started = meshes[0], perf_counter()
    right, up, _ = viewpoints(first)["front"]
    with reporter.busy("mapping") as tell:
        options = Options(timeout=timeout)
        maps = [_mapped(chosen, mesh, parameters or {}, plugins, options, tell) for mesh in meshes]
        mapped = perf_counter()
        registrations = register_all(
            meshes,
            maps,
            places,
            lam=lam,
            reach=reach,
            pose=pose,
            upright=first.V @ right + 1j * (first.V @ up),
            tell=tell,
        )
    seconds = {"maps": mapped - started, "registration": perf_counter() - mapped}
    return replace(registrations, seconds=seconds)


def _mapped(
    algorithm: Algorithm,
    mesh: DiskMesh,
    parameters: Mapping[str, Any],
    plugins: Sequence[str],
    options: Options,
    tell: Callable[[str], object],
) -> NDArray[np.complex128]:
    """Map a surface to the disk in a process of its own; raise if the map is not valid."""
    from cembench.running.local import map_once
    from cembench.running.plan import MeasurementSettings, plan_cells

    (task,) = plan_cells([algorithm], [mesh], parameters, MeasurementSettings(repeats=1), plugins)
    tell(f"{algorithm.title} on {mesh.name}")
    record, uv = map_once(task, options)
    if record.outcome.status != "ok" or uv is None:
        raise AlgorithmFailed(f"{mesh.name}: {record.outcome.status}: {record.outcome.cause}")
    return uv


def _places(
    landmarks: Mapping[str, Sequence[int]] | AnyPath | None,
    meshes: Sequence[DiskMesh],
    known: Sequence[Mapping[str, int]],
) -> Landmarks:
    """Return the landmarks that were given, else the named ones that all surfaces have."""
    from pathlib import Path

    import numpy as np

    from .morphing.landmarks import (
        Landmarks,
        check_landmarks,
        common_landmarks,
        read_landmarks,
    )

    if landmarks is None:
        return common_landmarks(meshes, known)
    if isinstance(landmarks, str | os.PathLike):
        if os.fspath(landmarks) == "none":
            return common_landmarks(meshes, [{} for _ in known])
        return read_landmarks(Path(landmarks), meshes, known)
    rows = [list(row) for row in landmarks.values()]
    for name, row in zip(landmarks, rows, strict=True):
        if len(row) != len(meshes):
            raise ParameterError(
                f"landmark {name!r} has {len(row)} vertices; it needs one for each of "
                f"the {len(meshes)} surfaces."
            )
    vertices = np.array(rows, dtype=np.int64).reshape(len(rows), len(meshes))
    places = Landmarks(tuple(landmarks), vertices)
    check_landmarks(places, meshes)
    return places


def add_command() -> None:
    """Add the command of this verb, which takes more than one surface."""
    from . import morph_command  # noqa: F401 - it registers itself
