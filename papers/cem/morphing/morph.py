"""Compute a morph from conformal maps and landmarks: alignment, registration, transport."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.resample import interpolated, locate
from cembench.core.arrays import Complex, Real
from cembench.mesh.triangle_mesh import DiskMesh

from .align import aligned, best_turn, centred, vertex_areas
from .landmarks import Landmarks, check_order
from .metrics import registration_metrics, size_of
from .path import largest_acceleration, largest_step, pose_of, position
from .registration import LAMBDA, REACH, Registration, register

#: How the later surfaces are moved before the path is drawn through them.
Pose = Literal["similarity", "rigid", "keep"]


@dataclass(frozen=True)
class Morph:
    """Registered surfaces, with the first one's vertices carried onto all of them.

    Parameters
    ----------
    meshes : tuple of DiskMesh
        The s surfaces.
    landmarks : Landmarks
        The corresponding places.
    maps : tuple of complex128 arrays
        Conformal maps f_k of the surfaces, as the algorithm returned them.
    aligned : tuple of complex128 arrays
        The same after Moebius maps: m_1 f_1, and the others aligned with it.
    registrations : tuple of Registration
        Maps r_2, r_3, ... of the later surfaces to the disk of m_1 f_1.
    carried : tuple of float64 (n, 3)
        The first surface's vertices on each surface; the first entry is the first surface itself.
    stops : tuple of float64 (n, 3)
        The same after posing: the stops of the path.
    """

    meshes: tuple[DiskMesh, ...]
    landmarks: Landmarks
    maps: tuple[Complex, ...]
    aligned: tuple[Complex, ...]
    registrations: tuple[Registration, ...]
    carried: tuple[Real, ...]
    stops: tuple[Real, ...]
    #: Seconds of the maps and of the registration.
    seconds: Mapping[str, float] = field(default_factory=dict)

    def at(self, time: float) -> Real:
        """Return the first surface's vertices, float64 (n, 3), at a time from 0 to 1."""
        return position(self.stops, time)

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        frames: int = 48,
        views: Sequence[str] = ("front", "side", "three-quarter"),
        size: int = 480,
    ) -> list[Path]:
        """Write the path as a film, as numbered meshes, or as arrays.

        Parameters
        ----------
        path : path
            A film (GIF or MP4, 24 frames a second), a mesh file (OBJ or PLY) whose name gets a
            number for each frame, a folder for PLY meshes, or NPZ for all frames as arrays.
        frames : int
            Number of frames.
        views : sequence of {"front", "side", "three-quarter"}
            Views of a film.
        size : int
            Side of a view of a film, in pixels.

        Returns
        -------
        list of Path
            The files.

        Raises
        ------
        ParameterError
            The suffix or a view is unknown, or the folder does not exist.
        RecordError
            A file cannot be written.
        MissingExtra
            MP4 needs a package that is not installed.
        """
        from .writers import files_of, write_path

        write_path(self, [Path(path)], frames, views, size)
        return files_of(Path(path), frames)

    def metrics(self, frames: int) -> dict[str, Any]:
        """Return the metrics of the registrations and of the path with this many frames.

        `largest_acceleration_share` is in sizes of the first surface over the whole time squared;
        `largest_step_share` is the largest movement of a vertex between two frames, in sizes.
        """
        first, places = self.meshes[0], self.landmarks.vertices
        size = size_of(first.V)
        times = np.linspace(0, 1, frames)
        rows = [
            {"surface": mesh.name}
            | registration_metrics(mesh, registration, carried, first.F, places[:, 0], places[:, k])
            for k, (mesh, registration, carried) in enumerate(
                zip(self.meshes[1:], self.registrations, self.carried[1:], strict=True), start=1
            )
        ]
        return {
            "registrations": rows,
            "largest_acceleration_share": largest_acceleration(self.stops) / size,
            "largest_step_share": largest_step(self.stops, times) / size,
        }


def morph(
    meshes: Sequence[DiskMesh],
    maps: Sequence[Complex],
    landmarks: Landmarks,
    *,
    lam: float = LAMBDA,
    reach: float = REACH,
    pose: Pose = "similarity",
    upright: Complex | None = None,
    tell: Callable[[str], object] = lambda step: None,
) -> Morph:
    """Register surfaces to the first one, and carry its vertices onto them.

    Parameters
    ----------
    meshes : sequence of DiskMesh
        Two or more surfaces.
    maps : sequence of complex128 arrays
        A conformal map of each to the unit disk, without folds.
    landmarks : Landmarks
        Which places correspond; perhaps none.
    lam, reach : float
        See :func:`cembench.morphing.registration.register`.
    pose : "similarity", "rigid" or "keep"
        How the later surfaces are fitted to the first before the path is drawn;
        the maps and the metrics of registrations do not depend on it.
    upright : complex128 (n,), optional
        The first surface as seen by the viewer, right + i up; its map is rotated to match.
    tell : callable
        Called with a text at each step.

    Raises
    ------
    ParameterError
        The orders of the landmarks around the first one contradict each other.
    AlgorithmFailed
        A registration without folds cannot be found.
    """
    places = landmarks.vertices
    first = meshes[0]
    z = centred(first, maps[0], places[:, 0])
    if upright is not None:
        z = z * np.exp(1j * best_turn(z, upright - upright.mean()))
    moved, registrations, carried = [z], [], [np.array(first.V)]
    stops = [carried[0]]
    for k in range(1, len(meshes)):
        mesh, there = meshes[k], places[:, k]
        tell(f"registering {mesh.name}")
        fitted = aligned(mesh, maps[k], there, first, z, places[:, 0])
        check_order(landmarks.names, z[places[:, 0]], fitted[there], (first.name, mesh.name))
        registration = register(mesh, fitted, there, z[places[:, 0]], lam=lam, reach=reach)
        tell(f"carrying {first.name} onto {mesh.name}")
        face, weights = locate(registration.uv, mesh.F, z, nearest=True)
        on = interpolated(weights, mesh.V[mesh.F[face]])
        moved.append(fitted)
        registrations.append(registration)
        carried.append(on)
        stops.append(on if pose == "keep" else _posed(on, first, places[:, 0], pose))
    return Morph(
        tuple(meshes),
        landmarks,
        tuple(maps),
        tuple(moved),
        tuple(registrations),
        tuple(carried),
        tuple(stops),
    )


def _posed(on: Real, first: DiskMesh, landmarks: NDArray[np.int64], pose: Pose) -> Real:
    """Return the surface fitted to the first, by three or more landmarks, else by all vertices."""
    scale = pose == "similarity"
    if len(landmarks) >= 3:
        even = np.ones(len(landmarks))
        return pose_of(on[landmarks], first.V[landmarks], even, scale=scale)(on)
    return pose_of(on, first.V, vertex_areas(first), scale=scale)(on)
