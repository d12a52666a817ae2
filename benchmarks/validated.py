"""What the checks of `cembench validate` find of the algorithms of the suite."""

from __future__ import annotations

from collections.abc import Sequence
from math import log
from statistics import linear_regression
from typing import Any

import cembench
from benchmarks.measuring import progress
from benchmarks.pages import Section, Table
from cembench.conformal.certificate import certify
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import Registry, load_registry
from cembench.validation.surfaces import refined
from cembench.validation.verdict import sentence

LAYOUT = """
| name | verdict | order of E_C: cap | half ellipsoid | of the angles: cap | half ellipsoid \
| modulus off: cap | half ellipsoid |
|---|---|---:|---:|---:|---:|---:|---:|
| `{name}` | {verdict} | {energy0:.2f} | {energy1:.2f} | {angle0:.2f} | {angle1:.2f} \
| {off0:+.1e} | {off1:+.1e} |"""


def validated(names: Sequence[str] = ()) -> Section:
    """Tabulate what ``cembench validate NAME --checks-only`` finds of each algorithm of disks.

    Orders are those of E_C over the area and of the mean angle error in the triangle size, on its
    two surfaces in three triangulations; the modulus is that of the finest one.
    """
    registry = load_registry()
    chosen = names or [
        name for name, one in registry.algorithms.items() if one.mesh_type is DiskMesh
    ]
    rows = [row(registry, name) for name in progress(chosen)]
    return Section([Table(rows, LAYOUT)], "docs/algorithms.md")


def row(registry: Registry, name: str) -> dict[str, Any]:
    """Return an algorithm's verdict, orders and errors of the modulus."""
    validation = cembench.validate(name, checks_only=True)
    verdict = sentence(validation.model_copy(update={"looked_at": {}}))  # the same for all
    found: dict[str, Any] = {"name": name, "verdict": verdict}
    for k, surface in enumerate(refined(registry, DiskMesh)):
        maps = [cembench.parameterize(mesh, name) for mesh in surface.meshes]
        sizes = [log(mesh.m) / -2 for mesh in surface.meshes]
        energies = [one.metrics["conformal_energy"] / one.metrics["image_area"] for one in maps]
        angles = [one.metrics["angle_error_mean_deg"] for one in maps]
        found[f"energy{k}"] = linear_regression(sizes, list(map(log, energies))).slope
        found[f"angle{k}"] = linear_regression(sizes, list(map(log, angles))).slope
        exact = certify(surface.meshes[-1])
        on_disk = registry.algorithm(name).target == "disk"
        found[f"off{k}"] = exact.off(maps[-1].z[exact.corners]) if on_disk else None
    return found
