"""Repair a map's folds, unless that costs the map too much."""

from __future__ import annotations

from typing import Any

import scipy

from cembench.conformal.folds import interior_without_folds, without_folds
from cembench.conformal.metrics import angle_errors, dirichlet_energy, flipped_triangles, image_area
from cembench.core.arrays import Complex
from cembench.core.clock import phase
from cembench.mesh.triangle_mesh import DiskMesh, TriangleMesh

#: A repair that multiplies one of these metrics by more is rejected. The mean angle error flatters
#: a folded map, since a reflected triangle has the right angles; E_C does not.
MAX_COST = {"conformal_energy": 1.25, "angle_error_mean_deg": 1.5}


def accepted_repair(
    mesh: TriangleMesh,
    own: Complex,
    L: scipy.sparse.csc_array | None = None,
    *,
    repair: bool = True,
) -> tuple[Complex, dict[str, Any]]:
    """Repair a map's folds, and return the repaired map, or `own` if that costs too much.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface; a disk if L is given.
    own : complex (n,)
        Its map as the method made it.
    L : sparse (n, n), optional
        The Laplacian, if the boundary lies on the unit circle and may be put in order too
        (:func:`cembench.conformal.folds.without_folds`). By default the boundary stays
        (:func:`cembench.conformal.folds.interior_without_folds`).
    repair : bool
        Whether to repair; if not, `own` is returned.

    Returns
    -------
    z : complex (n,)
        The accepted map.
    extras : dict
        ``folded_before_repair``, the number of folded triangles of `own`, and ``fold_repairs``, the
        number of rounds of repair. If there were any, ``before_repair`` has the metrics of `own`;
        if the repair was rejected, ``refused_repair`` has those of the repaired map.
    """
    with phase("folds"):
        folded = flipped_triangles(mesh, own)
    extras: dict[str, Any] = {"fold_repairs": 0, "folded_before_repair": folded}
    if not (folded and repair):
        return own, extras
    if L is not None and isinstance(mesh, DiskMesh):
        after, rounds = without_folds(mesh, L, own)
    else:
        after, rounds = interior_without_folds(mesh, own)
    if not rounds:
        return own, extras
    with phase("folds"):
        old = figures(mesh, own, folded)
        new = figures(mesh, after, flipped_triangles(mesh, after))
    extras |= {"fold_repairs": rounds, "before_repair": old}
    if all(new[name] <= most * max(old[name], 0) for name, most in MAX_COST.items()):
        return after, extras
    return own, extras | {"refused_repair": new}


def figures(mesh: TriangleMesh, uv: Complex, folded: int) -> dict[str, float | int]:
    """Return the metrics that decide on a repair."""
    return {
        "flipped_triangles": folded,
        "conformal_energy": dirichlet_energy(mesh, uv) - image_area(mesh, uv),
        "angle_error_mean_deg": float(angle_errors(mesh, uv).mean()),
    }
