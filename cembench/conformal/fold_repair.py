"""Accept or reject a repair of folds by what it costs the map."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cembench.conformal.metrics import angle_errors, dirichlet_energy, flipped_triangles, image_area
from cembench.core.clock import phase
from cembench.mesh.triangle_mesh import TriangleMesh

Complex = NDArray[np.complex128]

#: A repair that multiplies one of these metrics by more is rejected. The mean angle error flatters
#: a folded map, since a reflected triangle has the right angles; E_C does not.
MOST_COST = {"conformal_energy": 1.25, "angle_error_mean_deg": 1.5}


def accepted_repair(
    mesh: TriangleMesh, before: Complex, repair: tuple[Complex, int]
) -> tuple[Complex, dict[str, Any]]:
    """Return a repaired map, or the original map if the repair costs too much, and its metrics.

    Parameters
    ----------
    mesh : TriangleMesh
        The surface.
    before : complex (n,)
        Its map before the repair.
    repair : complex (n,) and int
        The map after it and the number of rounds, as returned by
        :func:`cembench.conformal.folds.without_folds`.

    Returns
    -------
    z : complex (n,)
        The accepted map.
    extras : dict
        ``fold_repairs``, the number of rounds. If there were any, ``before_repair`` has the metrics
        of the original map; if the repair was rejected, ``refused_repair`` has those of the
        repaired map.

    """
    after, rounds = repair
    if not rounds:
        return before, {"fold_repairs": 0}
    with phase("folds"):
        old, new = _figures(mesh, before), _figures(mesh, after)
    extras = {"fold_repairs": rounds, "before_repair": old}
    if all(new[name] <= most * max(old[name], 0) for name, most in MOST_COST.items()):
        return after, extras
    return before, extras | {"refused_repair": new}


def _figures(mesh: TriangleMesh, uv: Complex) -> dict[str, float | int]:
    """Return the metrics that decide on a repair."""
    return {
        "flipped_triangles": flipped_triangles(mesh, uv),
        "conformal_energy": dirichlet_energy(mesh, uv) - image_area(mesh, uv),
        "angle_error_mean_deg": float(angle_errors(mesh, uv).mean()),
    }
