"""Heat flow of the doubled surface on the sphere by explicit steps."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from cembench.conformal.balancing import moebius_centred
from cembench.conformal.doubling import doubled_surface
from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.harmonic import harmonic_extension
from cembench.conformal.laplacian import by_rows
from cembench.conformal.spherical import balanced_planar_map
from cembench.conformal.stereographic import to_sphere
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

from .qiem import boundary_on_circle

#: The step as a share of the largest stable step of explicit diffusion.
SHARE = 0.9


@algorithm(
    "gu-yau",
    title="Gu-Yau",
    target="disk",
    source="Gu & Yau, Global conformal surface parameterization, 2003; Gu et al. 2004",
    usual=False,
)
def gu_yau(
    mesh: DiskMesh,
    *,
    tolerance: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] = 1e-7,
    max_iterations: Annotated[int, Field(ge=0, le=10_000_000)] = 1_000,
    delaunay: bool = False,
    repair: bool = True,
) -> Parameterization:
    """Map a disk by explicit diffusion of the doubled surface on the sphere.

    The surface is glued to its mirror copy and mapped to the sphere. Each step moves every vertex
    against the tangential part of the Laplacian, f - dt (L f)_tangential / m, and projects it back
    to the sphere, with the mean moved to the centre. The method is slow by nature, since the
    smallest triangles limit dt: the quasi-implicit method (qiem) exists for that reason, and shares
    its start, centring and final steps with this one.

    Decided here: m is half of the diagonal of L, so that all frequencies are equally close to their
    limit, and dt is 0.9 of the stable limit 1. The iteration ends when a step lowers the energy by
    less than a relative `tolerance` (`stopped`: "energy") or after `max_iterations` ("iterations"),
    with the map reached so far: on fine meshes that is the start, slightly smoothed. The circle
    between the copies is put on the unit circle and the interior is solved for once more, as in
    QIEM. Remaining folds are repaired as in CEM (`fold_repairs`).
    """
    L, double, L_double, V = doubled_surface(mesh, delaunay=delaunay)
    S = to_sphere(balanced_planar_map(L_double, V, double.F), "north")
    rows, mass = by_rows(L_double), np.ones(len(S))
    diagonal = L_double.diagonal()
    if not diagonal.min() > 0:
        raise AlgorithmFailed(
            f"{int((diagonal <= 0).sum())} vertices have a nonpositive diagonal entry in the "
            "Laplacian, so explicit steps are unstable; delaunay=true makes it positive"
        )
    dt = SHARE / diagonal[:, None]
    with phase("diffusion"):
        S = moebius_centred(S, mass)
        LS = rows @ S
        energies = [0.5 * float((S * LS).sum())]
        stopped = "iterations"
        for _ in range(max_iterations):
            normal = np.einsum("nd,nd->n", LS, S)[:, None]
            moved = S - dt * (LS - normal * S)
            moved /= np.linalg.norm(moved, axis=1, keepdims=True)
            moved = moebius_centred(moved, mass)
            L_moved = rows @ moved
            energy = 0.5 * float((moved * L_moved).sum())
            fallen = energies[-1] - energy
            if fallen >= 0:
                S, LS = moved, L_moved
                energies.append(energy)
            if fallen <= tolerance * abs(energy):
                stopped = "energy"
                break
    z = harmonic_extension(L, mesh.boundary, boundary_on_circle(mesh, S))
    z, folds = accepted_repair(mesh, z, L, repair=repair)
    extras = {"stopped": stopped, "energy_of": "half of the sphere's, less 2 pi"}
    history = tuple(energy / 2 - 2 * np.pi for energy in energies)
    return Parameterization(z, len(history) - 1, history, {**extras, **folds})
