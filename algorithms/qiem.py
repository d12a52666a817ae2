"""Quasi-implicit Euler method: harmonic heat flow of the doubled surface on the sphere."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import scipy
from pydantic import Field

from cembench.conformal.balancing import moebius_centred
from cembench.conformal.doubling import doubled_surface
from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.harmonic import harmonic_extension
from cembench.conformal.last_resort import with_last_resort
from cembench.conformal.planar import fitted_circle, polygon_area
from cembench.conformal.spherical import balanced_planar_map
from cembench.conformal.stereographic import to_plane, to_sphere
from cembench.core.arrays import Complex, Real
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed, NotPositiveDefinite
from cembench.core.parameterization import Parameterization
from cembench.linear_algebra.cholesky import Cholesky, factor_like
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import algorithm

#: The time step: its initial value, its factors after a step and after a failed step, its limit as
#: a share of its theoretical bound, and the value below which it counts as zero.
FIRST, GROWTH, CUT, SHARE, LEAST = 0.1, 1.5, 0.5, 0.9, 1e-6


@algorithm(
    "qiem",
    title="QIEM",
    target="disk",
    source="Huang, Gu, Huang, Lin, Lin & Yau, Geom. Imag. Comput. 1 (2014), 223-258",
)
@with_last_resort
def qiem(
    mesh: DiskMesh,
    *,
    tolerance: Annotated[float, Field(gt=0, le=1, allow_inf_nan=False)] = 1e-6,
    max_iterations: Annotated[int, Field(ge=1, le=1_000_000)] = 200,
    delaunay: bool = False,
    repair: bool = True,
    last_resort: bool = False,
) -> Parameterization:
    """Map a disk by half of the limit of the heat flow of the doubled surface on the sphere.

    A quasi-implicit heat flow in the manner of Huang et al.: the surface is glued to its mirror
    copy and mapped to the sphere, df/dt = -(L f)_tangential, by steps (I + dt (L - D)) f_new =
    f_old with D the diagonal of <L f, f> at the old map. The matrix changes in every step, its
    pattern does not. The start is the planar map that is harmonic except at the most regular
    triangle, on the sphere with balanced poles.

    Decided here: the mass matrix is the identity. dt starts at 0.1 and grows by half after each
    step. If the energy would rise or the matrix is not positive definite, dt is halved and the step
    repeated. dt stays below 0.9 n / sum(D), above which the matrix is never positive definite. The
    flow has converged when, after dt has met such a limit, a step lowers the energy by less than
    a relative `tolerance`. After each step the points are projected to the sphere and their mean is
    moved to the centre by a Moebius map; subtracting the mean and dividing by the norm does so to
    first order, but raises the energy of uneven maps. The circle between the copies is turned to a
    parallel, its half is projected from the far pole and scaled to the unit disk, the boundary is
    put on the circle and the interior is solved for once more, which settles the crowded regions
    that the flow reaches slowly. Remaining folds are repaired as in FDM (`fold_repairs`). The
    recorded energies are half of the sphere's, minus 2 pi. `delaunay` takes the weights of the
    intrinsic Delaunay triangulation.
    """
    L, double, L_double, V = doubled_surface(mesh, delaunay=delaunay)
    z = balanced_planar_map(L_double, V, double.F)
    S, energies = _flow(L_double, to_sphere(z, "north"), tolerance, max_iterations)
    z = harmonic_extension(L, mesh.boundary, boundary_on_circle(mesh, S))
    z, folds = accepted_repair(mesh, z, L, repair=repair)
    return Parameterization(
        z,
        len(energies) - 1,
        tuple(energy / 2 - 2 * np.pi for energy in energies),
        {**folds, "energy_of": "half of the sphere's, less 2 pi"},
    )


def _flow(
    L: scipy.sparse.csc_array, S: Real, tolerance: float, max_iterations: int
) -> tuple[Real, list[float]]:
    """Run the heat flow to its limit; return the map S (n, 3) and the energy of every step."""
    step = _Step(L)
    mass = np.ones(len(S))
    S = moebius_centred(S, mass)
    LS = L @ S
    energies = [0.5 * float((S * LS).sum())]
    dt, limited = FIRST, False
    while len(energies) <= max_iterations:
        D = np.einsum("nd,nd->n", LS, S)
        bound = SHARE * len(S) / D.sum()
        dt, limited = min(dt, bound), limited or dt >= bound
        trial = _centred(step(S, D, dt), mass)
        if trial is not None:
            L_trial = L @ trial
            energy = 0.5 * float((trial * L_trial).sum())
        if trial is None or not energy <= energies[-1]:
            dt, limited = CUT * dt, True
            if dt >= LEAST:
                continue
            if len(energies) > 1:
                return S, energies
            raise AlgorithmFailed(
                "the heat flow cannot start: every time step down to "
                f"{LEAST:g} raises the energy, {energies[0]:.6g}"
            )
        S, LS, dt = trial, L_trial, GROWTH * dt
        energies.append(energy)
        if limited and energies[-2] - energies[-1] < tolerance * abs(energies[-1]):
            return S, energies
    raise AlgorithmFailed(
        f"the heat flow has not converged after {max_iterations} steps: the last one lowered the "
        f"energy by {1 - energies[-1] / energies[-2]:.2g} of it, tolerance {tolerance:g}; "
        "allow more with max_iterations, or raise the tolerance"
    )


class _Step:
    """One quasi-implicit Euler step; the matrix's pattern is analysed once."""

    def __init__(self, L: scipy.sparse.csc_array) -> None:
        self._L = L
        self._A = L.copy()
        columns = np.repeat(np.arange(L.shape[1]), np.diff(L.indptr))
        self._diagonal = np.flatnonzero(L.indices == columns)
        self._cholesky: Cholesky | None = None

    def __call__(self, S: Real, D: Real, dt: float) -> Real | None:
        """Return x with (I + dt (L - D)) x = S; None if the matrix is not positive definite."""
        with phase("assembly"):
            self._A.data[:] = dt * self._L.data
            self._A.data[self._diagonal] += 1 - dt * D
        try:
            self._cholesky = factor_like(self._cholesky, self._A)
            return self._cholesky.solve(S)
        except NotPositiveDefinite:
            return None


def _centred(S: Real | None, mass: Real) -> Real | None:
    """Project to the sphere with the centre of mass at its centre; None if that fails."""
    if S is None:
        return None
    norms = np.linalg.norm(S, axis=1, keepdims=True)
    if not norms.min() > 0:
        return None
    try:
        return moebius_centred(S / norms, mass)
    except AlgorithmFailed:
        return None


def boundary_on_circle(mesh: DiskMesh, S: Real) -> Complex:
    """Turn the boundary's circle to a parallel, project from the opposite pole, and scale."""
    loop = S[mesh.boundary]
    turn = np.linalg.svd(loop - loop.mean(axis=0), full_matrices=False)[2].T
    loop = loop @ turn
    # The half that is mapped to the disk lies on the other side of the parallel.
    in_south = (S[mesh.interior] @ turn[:, 2]).mean() < loop[:, 2].mean()
    z = to_plane(loop, "north" if in_south else "south")
    centre, _ = fitted_circle(z)
    z = z - centre
    if polygon_area(z) < 0:
        z = np.conj(z)
    modulus = np.abs(z)
    if not (np.isfinite(modulus).all() and modulus.min() > 0):
        raise AlgorithmFailed("the boundary's image on the sphere is not a simple closed curve")
    return z / modulus
