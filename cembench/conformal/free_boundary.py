"""Common parts of maps with a free boundary: the energy form, the two pins, the scale."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy

from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.metrics import corner_angles
from cembench.conformal.planar import polygon_area
from cembench.core.arrays import Complex, Indices
from cembench.core.clock import phase
from cembench.core.errors import AlgorithmFailed
from cembench.core.parameterization import Parameterization
from cembench.linear_algebra.cholesky import Cholesky
from cembench.mesh.gluing import twins_of_half_edges
from cembench.mesh.side_lengths import side_lengths
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh


def conformal_energy_form(L: scipy.sparse.csc_array, *loops: Indices) -> scipy.sparse.csc_array:
    """Return Q with E_C = x^T Q x / 2, x = (u, v): diag(L, L) minus the area's Hessian (Eq. 8).

    L (n, n) is the Laplacian; `loops` are all boundaries, with the surface on their left.
    """
    b = np.concatenate(loops)
    after = np.concatenate([np.roll(loop, -1) for loop in loops])
    half = np.full(len(b), 0.5)
    D = scipy.sparse.coo_array(
        (np.r_[half, -half], (np.r_[b, after], np.r_[after, b])), shape=L.shape
    )
    return scipy.sparse.block_array([[L, -D], [D, L]], format="csc")


def two_distant_vertices(mesh: DiskMesh | HoledMesh) -> Indices:
    """Return two boundary vertices (2,): the farthest from the mean vertex and from the first."""
    boundary = np.concatenate(mesh.loops)
    at = mesh.V[boundary]
    first = int(np.argmax(np.linalg.norm(at - mesh.V.mean(axis=0), axis=1)))
    second = int(np.argmax(np.linalg.norm(at - at[first], axis=1)))
    return boundary[[first, second]]


def pinned_map(L: scipy.sparse.csc_array, loops: Sequence[Indices], pins: Indices) -> Complex:
    """Return the map (n,) of least E_C with two vertices `pins` (2,) at -1 and 1.

    L (n, n) is the Laplacian; `loops` are all boundaries.
    """
    n = L.shape[0]
    with phase("assembly"):
        Q = scipy.sparse.csr_array(conformal_energy_form(L, *loops))
        fixed = np.concatenate([pins, pins + n])
        free = np.delete(np.arange(2 * n), fixed)
        x = np.zeros(2 * n)
        x[fixed] = [-1.0, 1.0, 0.0, 0.0]
        rows = Q[free]
        Q_ff, Q_fp = rows[:, free], rows[:, fixed]
    x[free] = Cholesky(Q_ff).solve(-(Q_fp @ x[fixed]))
    return x[:n] + 1j * x[n:]


def is_strip(mesh: DiskMesh | HoledMesh) -> bool:
    """Whether a mesh is a disk without interior vertices, whose triangles form a tree."""
    return len(mesh.loops) == 1 and not len(mesh.interior)


def unrolled(mesh: DiskMesh) -> Parameterization:
    """Return the exact map of a disk without interior vertices, which is flat, scaled to area pi.

    Its triangles form a tree: each is laid out in the plane beside the one before, so that no angle
    changes. Far triangles may overlap, as in any map with a free boundary.
    """
    twin = twins_of_half_edges(mesh.F).reshape(-1, 3)
    lengths = np.roll(side_lengths(mesh.V, mesh.F), 1, axis=1)  # side c starts at corner c
    turn = np.exp(1j * np.deg2rad(corner_angles(mesh.V, mesh.F)))
    uv = np.zeros(mesh.n, dtype=np.complex128)
    _, second, third = mesh.F[0]
    uv[second] = lengths[0, 0]
    uv[third] = lengths[0, 2] * turn[0, 0]
    waiting = [(0, int(h)) for h in twin[0] if h >= 0]
    while waiting:
        before, h = waiting.pop()
        t, c = divmod(h, 3)
        i, j, k = mesh.F[t, [c, (c + 1) % 3, (c + 2) % 3]]
        along = (uv[j] - uv[i]) / abs(uv[j] - uv[i])
        uv[k] = uv[i] + lengths[t, (c + 2) % 3] * along * turn[t, c]
        waiting += [(t, int(g)) for g in twin[t] if g >= 0 and g // 3 != before]
    uv *= np.sqrt(np.pi / polygon_area(uv[mesh.boundary]))
    return Parameterization(uv, extras={"unrolled": True, "folded_before_repair": 0})


def with_area_pi(
    mesh: DiskMesh | HoledMesh, uv: Complex, *, repair: bool = True
) -> tuple[Complex, dict[str, Any]]:
    """Scale a map so that its boundaries enclose pi, as a disk does, and `repair` interior folds.

    Returns
    -------
    uv : complex (n,)
        The map.
    extras : dict
        As returned by :func:`cembench.conformal.fold_repair.accepted_repair`.

    Raises
    ------
    AlgorithmFailed
        The boundaries enclose no positive area.
    """
    area = sum(polygon_area(uv[loop]) for loop in mesh.loops)
    if not area > 0:
        raise AlgorithmFailed(
            f"the image of the boundary encloses an area of {area:.3g}, which is not positive: "
            "the map has collapsed or crosses itself. Use a disk map, such as direct-cem"
        )
    uv = uv * np.sqrt(np.pi / area)
    return accepted_repair(mesh, uv, repair=repair)
