"""Do the errors of each disk algorithm fall with refinement, and how fast?

h is 1 over the number of rings of the mesh; the observed order is the slope of log(error) against
log(h), here -log(rings). Linear elements promise 1 for angles and 2 for energies and positions.
Run pytest with -s to read the orders.
"""

from functools import cache

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.spherical_cap import exact_map, spherical_cap

from cembench.conformal.metrics import all_metrics
from cembench.registry import load_registry
from cembench.validation.alignment import distance

RINGS = (8, 16, 32)
FINE = 128
DISK = {name: spec for name, spec in load_registry().algorithms.items() if spec.target == "disk"}
#: Other weights, or the graph of the mesh alone: no limit on curved surfaces is promised.
NOT_HARMONIC = {"harmonic-tutte", "mean-value", "circle-packing"}
#: Explicit steps: too slow to converge on fine meshes within its iterations.
SLOW = {"gu-yau"}
DISK = {name: spec for name, spec in DISK.items() if name not in NOT_HARMONIC | SLOW}
#: `harmonic-circle` is not: only where symmetry makes its boundary right.
CONFORMAL = sorted(name for name, spec in DISK.items() if spec.conformal)
#: Its fixed point converges more slowly on finer meshes: what its 20 iterations leave undone grows.
TO_THE_END = {"cem": {"max_iterations": 2000, "tolerance": 1e-12}}
#: What it holds while it corrects one pole is as far off as its start, so positions stay so.
HOLDS_ITS_START = {"ldm"}


def faces(rings):
    return 6 * rings**2


@cache
def surface(kind, rings):
    make = {
        "cap": lambda n: spherical_cap(n, angle=120.0),
        "disk": flat_disk,
        "ellipse": lambda n: flat_disk(n, stretch=1.5),
        "ellipsoid": hemi_ellipsoid,
    }[kind]
    return make(faces(rings))


@cache
def mapped(name, kind, rings):
    spec = DISK[name]
    return spec.function(surface(kind, rings), **spec.arguments(TO_THE_END.get(name, {}))).uv


def assert_order(what, errors, at_least, negligible=1e-12):
    """Assert the order of the errors, without those that are rounding alone."""
    seen = [
        (rings, error) for rings, error in zip(RINGS, errors, strict=True) if error > negligible
    ]
    said = f"{what}: {', '.join(f'{e:.2e}' for e in errors)} at {RINGS} rings"
    print(said)
    if seen:
        rings, left = np.log(np.array(seen)).T
        assert len(seen) > 1, said
        assert -np.polyfit(rings, left, 1)[0] > at_least, said


def distances(name, kind, exact):
    return [
        distance(mapped(name, kind, r), exact(surface(kind, r), r), moebius=True) for r in RINGS
    ]


@pytest.mark.parametrize("kind", ["cap", "ellipse", "ellipsoid"])
@pytest.mark.parametrize("name", CONFORMAL)
def test_angles_are_of_first_order_and_energy_of_second(name, kind):
    figures = [all_metrics(surface(kind, r), mapped(name, kind, r)) for r in RINGS]
    assert_order(
        f"{name} on {kind}, mean angle error", [f["angle_error_mean_deg"] for f in figures], 0.9
    )
    assert_order(f"{name} on {kind}, E_C", [f["conformal_energy"] for f in figures], 1.8)


@pytest.mark.parametrize("name", sorted(set(DISK) - HOLDS_ITS_START))
def test_positions_on_a_spherical_cap_are_of_second_order(name):
    errors = distances(name, "cap", lambda mesh, _: exact_map(mesh.V, 120.0))
    assert_order(f"{name} on cap, distance to the exact map", errors, 1.7)


@pytest.mark.parametrize("name", sorted(set(DISK) - HOLDS_ITS_START))
def test_a_flat_disk_comes_out_as_it_is(name):
    errors = distances(name, "disk", lambda mesh, _: mesh.V[:, 0] + 1j * mesh.V[:, 1])
    assert_order(f"{name} on disk, distance to the identity", errors, 1.4)


@pytest.mark.parametrize("name", sorted(set(CONFORMAL) - HOLDS_ITS_START))
def test_positions_on_an_ellipsoid_approach_a_fine_reference(name):
    errors = distances(name, "ellipsoid", lambda mesh, r: reference()[nested(r)])
    assert_order(f"{name} on ellipsoid, distance to {FINE} rings", errors, 1.4)


@pytest.mark.parametrize("kind", ["cap", "disk", "ellipsoid"])
@pytest.mark.parametrize("name", sorted(HOLDS_ITS_START))
def test_positions_stay_within_the_error_of_what_was_held(name, kind):
    exact = {
        "cap": lambda mesh, _: exact_map(mesh.V, 120.0),
        "disk": lambda mesh, _: mesh.V[:, 0] + 1j * mesh.V[:, 1],
        "ellipsoid": lambda mesh, r: reference()[nested(r)],
    }[kind]
    errors = distances(name, kind, exact)
    print(f"{name} on {kind}: {', '.join(f'{e:.2e}' for e in errors)} at {RINGS} rings")
    assert max(errors) < 1e-2


@cache
def reference():
    return DISK["fdm"].function(hemi_ellipsoid(faces(FINE)), tolerance=0.0, max_iterations=10).uv


def nested(rings):
    """Which vertices of the mesh with FINE rings are those of the mesh with fewer?"""
    ratio = FINE // rings
    k = np.repeat(np.arange(1, rings + 1), 6 * np.arange(1, rings + 1))
    j = np.arange(len(k)) - 3 * k * (k - 1)
    K = ratio * k
    return np.concatenate([[0], 1 + 3 * K * (K - 1) + ratio * j])
