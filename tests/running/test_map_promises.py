"""A map is judged by whether it is a homeomorphism onto its target."""

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk

from cembench import DiskMesh, HoledMesh, Parameterization, algorithm
from cembench.conformal.planar import orientations
from cembench.results.records import FaultKind
from cembench.running.map_promises import faults, remarks
from tests import gallery

DISK = flat_disk(600)
FLAT = DISK.V[:, 0] + 1j * DISK.V[:, 1]
HOLED = gallery.three_holes()
HOLED_FLAT = HOLED.V[:, 0] + 1j * HOLED.V[:, 1]


def solver(target):
    @algorithm("any", title="Any", target=target)
    def any_(mesh: DiskMesh) -> Parameterization:
        raise NotImplementedError

    return any_.__cembench__


def kinds(uv, mesh=DISK, target="disk"):
    return [fault.kind for fault in faults(solver(target), mesh, uv)]


def doubled(z):
    return z * np.exp(1j * np.angle(z))


def test_a_double_cover_of_the_disk_is_refused():
    assert np.count_nonzero(orientations(doubled(FLAT), DISK.F) <= 0) == 0
    (fault,) = faults(solver("disk"), DISK, doubled(FLAT))
    assert fault.kind is FaultKind.WINDING
    assert fault.detail == (
        "the boundary goes around the circle twice, counter-clockwise; it must go around it once, "
        "counter-clockwise"
    )


def test_a_double_cover_of_a_ring_is_refused():
    V, F = gallery.tube()
    mesh = HoledMesh.from_arrays(V, F)
    z = (0.5 + V[:, 2] / 8) * (V[:, 0] + 1j * V[:, 1])
    z = z if np.count_nonzero(orientations(z, F) > 0) else np.conj(z)
    assert kinds(z, mesh, "circular holes") == []
    assert FaultKind.WINDING in kinds(doubled(z), mesh, "circular holes")


def test_a_boundary_out_of_order_is_named_beside_the_folds_it_makes():
    uv = FLAT.copy()
    b = DISK.boundary
    uv[b[3]], uv[b[4]] = uv[b[4]], uv[b[3]]
    assert kinds(uv) == [FaultKind.FOLDED, FaultKind.BOUNDARY_ORDER]


def test_a_boundary_on_half_of_the_circle_is_in_order():
    """Its polygon does not go round the centre, and is a homeomorphic image nonetheless."""
    triangle = DiskMesh.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    assert kinds(np.exp(1j * np.array([0.0, 0.5, 1.0])), triangle) == []
    assert kinds(np.exp(1j * np.array([0.0, 1.0, 0.5])), triangle) == [FaultKind.REVERSED]


@pytest.mark.parametrize("exponent", [9, 12, 15])
def test_crowded_boundaries_are_ok_as_long_as_doubles_tell_them_apart(exponent):
    """A Moebius map crowds the boundary; where two vertices coincide, a triangle has no area."""
    a = 1 - 10.0**-exponent
    uv = (FLAT + a) / (1 + a * FLAT)
    on_circle = uv[DISK.boundary] / np.abs(uv[DISK.boundary])
    uv[DISK.boundary] = on_circle
    coincide = len(np.unique(on_circle)) < len(on_circle)
    faults = kinds(uv)
    flipped = np.count_nonzero(orientations(uv, DISK.F) <= 0)
    assert (FaultKind.FOLDED in faults) == bool(flipped)
    assert flipped or not coincide
    if exponent == 9:
        assert faults == []


def test_an_overlapping_free_boundary_is_told_and_not_refused():
    free = solver("free boundary")
    assert faults(free, DISK, doubled(FLAT)) == []
    (told,) = remarks(free, DISK, doubled(FLAT))
    assert told.text.startswith("the image overlaps itself: boundary ")
    assert remarks(free, DISK, FLAT) == []


def test_holes_inside_out_or_outside_are_refused():
    loops = [k for k in HOLED.loops if np.abs(np.abs(HOLED_FLAT[k]) - 1).max() > 1e-6]
    assert kinds(HOLED_FLAT, HOLED, "circular holes") == []
    turned = HOLED_FLAT.copy()
    middle = turned[loops[0]].mean()
    turned[loops[0]] = middle + np.conj(turned[loops[0]] - middle)
    assert {FaultKind.HOLE_ORIENTATION, FaultKind.FOLDED} <= set(
        kinds(turned, HOLED, "circular holes")
    )
    outside = HOLED_FLAT.copy()
    outside[loops[0]] += 5
    assert FaultKind.FOLDED in kinds(outside, HOLED, "circular holes")
    nested = HOLED_FLAT.copy()
    one, other = loops[:2]
    inner = nested[one] - nested[one].mean()
    nested[one] = nested[other].mean() + 0.1 * inner
    assert FaultKind.FOLDED in kinds(nested, HOLED, "circular holes")


def test_circles_out_of_the_disk_or_over_each_other_are_faults():
    """Each hole is a circle, so that no figure of circularity would tell."""
    one, other = (k for k in HOLED.loops[:3] if np.abs(np.abs(HOLED_FLAT[k]) - 1).max() > 1e-6)

    def told(loop, shift):
        moved = HOLED_FLAT.copy()
        moved[loop] += shift
        found = faults(solver("circular holes"), HOLED, moved)
        return [one.detail for one in found if one.kind is FaultKind.HOLES_NOT_CIRCULAR]

    assert told(one, 0) == []
    middles = HOLED_FLAT[one].mean(), HOLED_FLAT[other].mean()
    assert told(one, 1 - middles[0]) == ["the circles of 1 of 3 holes reach outside the disk"]
    assert told(one, middles[1] - middles[0] + 0.01) == ["circles of holes overlap"]
