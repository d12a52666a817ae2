"""The map to the plane with the least angle errors that neither folds nor overlaps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, TypeVar

from pydantic import Field

from cembench.conformal.fold_repair import accepted_repair
from cembench.conformal.free_boundary import with_area_pi
from cembench.conformal.planar import bounds_once
from cembench.core.arrays import Complex
from cembench.core.parameterization import Parameterization
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
from cembench.registry import algorithm

from ..abf.linear import abf_linear, linear_angles
from ..bff.free import bff_free
from ..direct_cem.disk import direct_cem
from ..direct_cem.holes import direct_cem_holes
from ..lscm import least_energy, lscm
from ..scp import scp
from .choice import Candidate, best_of

M = TypeVar("M", DiskMesh, HoledMesh)

#: Repair is tried if at most this share of the triangles fold: it is slow, and hopeless with more.
MAX_FOLDED = 0.01


def _few_folds(method: Callable[..., Parameterization], cost: float = 1.0) -> Candidate:
    """Return the candidate whose folds are repaired if they are few and nothing overlaps."""

    def repaired(mesh: DiskMesh | HoledMesh, *, repair: bool) -> Parameterization:
        made = method(mesh, repair=False)
        folded = made.extras["folded_before_repair"]
        if not (repair and 0 < folded <= MAX_FOLDED * mesh.m) or _overlap(mesh, made.uv):
            return made
        uv, extras = accepted_repair(mesh, made.uv)
        return replace(made, uv=uv, extras=made.extras | extras)

    return Candidate(repaired, cost)


#: A later tier is tried if no map of an earlier one is valid and good.
DISKS = (
    {"bff-free": _few_folds(bff_free), "abf-linear": _few_folds(abf_linear, cost=4)},
    {"scp": _few_folds(scp), "lscm": _few_folds(lscm, cost=2)},
    {"direct-cem": Candidate(direct_cem)},
)
HOLED = (
    {"lscm": _few_folds(least_energy), "abf-linear": _few_folds(linear_angles, cost=3)},
    {"direct-cem-holes": Candidate(direct_cem_holes)},
)
#: Up to 50,000 triangles both algorithms of the first tier are tried.
USUAL_WORK = 2.5e5

Work = Annotated[float, Field(gt=0, allow_inf_nan=False)]


@algorithm(
    "plane",
    title="Best in the plane",
    target="free boundary",
    source="This suite: docs/algorithms.md",
    usual=False,
)
def plane(mesh: DiskMesh, *, work: Work = USUAL_WORK, repair: bool = True) -> Parameterization:
    """Map to the plane with a free boundary: the least angle error without folds or overlaps.

    For textures: a free boundary has smaller angle errors than the disk, and much more even areas.
    The map is that of bff-free or abf-linear, whichever has the smaller mean angle error; if they
    are within 1 %, the one with the more even texel density. Where each has folds, a boundary that
    overlaps itself, or more than 10 degrees, scp and lscm are tried, and at last direct-cem, whose
    map to the disk is always valid (`instead_of`). `chosen`, `tried` and `work` are as in best: on
    larger surfaces bff-free is tried alone first.
    """
    return _in_the_plane(mesh, DISKS, work, repair=repair)


@algorithm(
    "plane-holes",
    title="Best in the plane, holes",
    target="free boundary",
    source="This suite: docs/algorithms.md",
    usual=False,
)
def plane_holes(
    mesh: HoledMesh, *, work: Work = USUAL_WORK, repair: bool = True
) -> Parameterization:
    """Map a surface with holes to the plane with all boundaries free, as plane does disks.

    The maps are those of lscm and abf-linear with the boundaries of the holes free too; the last
    one is direct-cem-holes' to a disk.
    """
    return _in_the_plane(mesh, HOLED, work, repair=repair)


def _in_the_plane(
    mesh: M, tiers: Sequence[Mapping[str, Candidate]], work: float, *, repair: bool
) -> Parameterization:
    made = best_of(mesh, tiers, work, _overlap, repair=repair)
    if made.extras["chosen"] not in tiers[-1]:
        return made
    uv, folds = with_area_pi(mesh, made.uv, repair=repair)  # rounding folds what is thin
    extras = made.extras | folds | {"instead_of": "a map with a free boundary"}
    return replace(made, uv=uv, energy_history=(), extras=extras)  # at another scale


def _overlap(mesh: TriangleMesh, z: Complex) -> str:
    """Return what is wrong with a map without folds whose image overlaps itself; else ""."""
    overlaps = not bounds_once([z[loop] for loop in mesh.loops])
    return "overlaps itself" if overlaps else ""
