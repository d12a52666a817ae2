"""Seconds and quality of the algorithms, and seconds of shared steps, at any commit.

It uses only what all commits have: ``cembench.DiskMesh`` and the entry points of the group
``cembench.algorithms``; steps are functions whose modules have moved. Quality is computed here, by
the same code for all commits, on the same bytes: files that ``make history`` writes beforehand.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from functools import lru_cache
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import numpy as np

import cembench

ALGORITHMS = ["cem", "fdm", "ldm", "qiem", "lscm", "direct-cem"]
#: Where the files are; and their names, which are those of the surfaces.
FOLDER = Path(__file__).parents[3] / ".asv/history/surfaces"
SURFACES = sorted(one.stem for one in FOLDER.glob("*.npz"))
#: Modules of the steps; the first two have been `geometry` at early commits.
ROOMS = ("conformal", "linear_algebra", "geometry")


@lru_cache(maxsize=2)
def surface(name: str) -> Any:
    """The checked mesh of a file."""
    with np.load(FOLDER / f"{name}.npz") as arrays:
        return cembench.DiskMesh.from_arrays(arrays["V"], arrays["F"], name=name)


for _entry in entry_points(group="cembench.algorithms"):
    if _entry.name in ALGORITHMS:
        _entry.load()  # once; processes that measure are forked


def algorithm(name: str) -> Callable[..., Any]:
    """The installed algorithm of this name; a commit without it is left out."""
    found = [one for one in entry_points(group="cembench.algorithms") if one.name == name]
    if not found:
        raise NotImplementedError(f"there is no algorithm {name} yet")
    function: Callable[..., Any] = found[0].load()
    return function


def quality(V: Any, F: Any, uv: Any) -> dict[str, float]:
    """Mean angle error in degrees, conformal energy (Dirichlet energy less area) and folds."""
    P = np.column_stack([uv.real, uv.imag])
    angles, cotangents = [], []
    for X in (V, P):
        A, B = (X[F[:, [1, 2, 0]]] - X[F], X[F[:, [2, 0, 1]]] - X[F])
        dot = (A * B).sum(-1)
        across = np.sqrt(np.maximum((A * A).sum(-1) * (B * B).sum(-1) - dot**2, 0))
        angles.append(np.arctan2(across, dot))
        cotangents.append(dot / across)
    edges = uv[F[:, [1, 2, 0]]] - uv[F[:, [2, 0, 1]]]  # each opposite to its corner
    areas = ((uv[F[:, 1]] - uv[F[:, 0]]).conj() * (uv[F[:, 2]] - uv[F[:, 0]])).imag / 2
    return {
        "angle": float(np.degrees(np.abs(angles[0] - angles[1])).mean()),
        "energy": float((cotangents[0] * np.abs(edges) ** 2).sum() / 4 - areas.sum()),
        "folds": float((areas <= 0).sum()),
    }


class _Cached:
    """Makes all maps once a commit: their quality, or why there is none."""

    version = "1"

    def setup_cache(self) -> dict[tuple[str, str], dict[str, float] | str]:
        found: dict[tuple[str, str], dict[str, float] | str] = {}
        for name in ALGORITHMS:
            for place in SURFACES:
                try:
                    mesh = surface(place)
                    found[name, place] = quality(mesh.V, mesh.F, algorithm(name)(mesh).uv)
                except Exception as error:
                    found[name, place] = f"{type(error).__name__}: {error}"
        return found


class Maps(_Cached):
    """An algorithm with its defaults on a surface, from arrays in memory to the map."""

    params = (ALGORITHMS, SURFACES)
    param_names = ("algorithm", "surface")
    number, rounds, repeat, warmup_time = 1, 1, (3, 9, 0.8), 0.01
    timeout = 120.0

    def setup(self, found: Any, name: str, place: str) -> None:
        """Skip what a commit does not have, and begin each sample with a fresh mesh."""
        if isinstance(found[name, place], str):
            raise NotImplementedError(found[name, place])
        self.call, self.mesh = algorithm(name), surface(place).fresh()

    def time_map(self, found: Any, name: str, place: str) -> None:
        self.call(self.mesh)


class Quality(_Cached):
    """Figures of an algorithm's maps of all surfaces."""

    params = ALGORITHMS
    param_names = ("algorithm",)

    def setup(self, found: Any, name: str) -> None:
        """Skip an algorithm that has no map of a surface."""
        self.known = [found[name, place] for place in SURFACES]
        if missing := [one for one in self.known if isinstance(one, str)]:
            raise NotImplementedError(missing[0])

    def track_angle_error(self, found: Any, name: str) -> float:
        return float(np.mean([one["angle"] for one in self.known]))

    def track_conformal_energy(self, found: Any, name: str) -> float:
        return sum(one["energy"] for one in self.known)

    def track_folds(self, found: Any, name: str) -> float:
        return sum(one["folds"] for one in self.known)


def step(module: str, name: str) -> Any:
    """A shared step, wherever this commit has it."""
    for room in ROOMS:
        try:
            return getattr(importlib.import_module(f"cembench.{room}.{module}"), name)
        except (ImportError, AttributeError):
            continue
    raise NotImplementedError(f"there is no {name}")


class Steps:
    """A step that all algorithms share, on the first surface."""

    version = "1"
    params = ("boundary", "laplacian", "factorisation", "solve", "beltrami_coefficients")
    param_names = ("step",)
    rounds, repeat, warmup_time = 1, (5, 15, 0.5), 0.05

    def setup(self, name: str) -> None:
        """Prepare the arguments of all steps."""
        mesh = surface(SURFACES[0])
        laplacian, Cholesky = step("laplacian", "laplacian"), step("cholesky", "Cholesky")
        beltrami, extension = (
            step("beltrami", "beltrami_coefficients"),
            step("harmonic", "harmonic_extension"),
        )
        L, inside = laplacian(mesh), mesh.interior
        L_ii = L[inside][:, inside]
        factor = Cholesky(L_ii)
        right = np.random.default_rng(0).standard_normal((len(inside), 2)) @ [1, 1j]
        uv = extension(L, mesh.boundary, step("harmonic", "arc_length_circle")(mesh))
        self.call = {
            "boundary": lambda: mesh.fresh().loops,
            "laplacian": lambda: laplacian(mesh.fresh()),
            "factorisation": lambda: Cholesky(L_ii),
            "solve": lambda: factor.solve(right),
            "beltrami_coefficients": lambda: beltrami(uv, mesh.F, mesh.V),
        }[name]

    def time_step(self, name: str) -> None:
        self.call()
