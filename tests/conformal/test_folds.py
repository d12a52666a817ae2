import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import AlgorithmFailed
from cembench.conformal.folds import in_order, without_folds
from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian
from cembench.conformal.planar import backward_arcs, signed_areas
from tests import gallery


@pytest.fixture(scope="module")
def crumpled():
    return gallery.crumpled_disk()


def test_a_map_without_folds_comes_back_as_it_is():
    mesh = hemi_ellipsoid(600)
    L = laplacian(mesh)
    z = harmonic_extension(L, mesh.boundary, arc_length_circle(mesh))
    found, rounds = without_folds(mesh, L, z)
    assert found is z
    assert rounds == 0


def test_folds_are_laid_flat_and_the_boundary_stays(crumpled):
    L = laplacian(crumpled)
    z = harmonic_extension(L, crumpled.boundary, arc_length_circle(crumpled))
    assert (signed_areas(z, crumpled.F) <= 0).sum() > 3
    found, rounds = without_folds(crumpled, L, z)
    assert rounds >= 1
    assert (signed_areas(found, crumpled.F) > 0).all()
    np.testing.assert_array_equal(found[crumpled.boundary], z[crumpled.boundary])


def test_boundary_vertices_that_changed_places_are_put_in_order():
    mesh = flat_disk(150)
    L = laplacian(mesh)
    circle = (mesh.V[:, 0] + 1j * mesh.V[:, 1])[mesh.boundary]
    swapped = circle.copy()
    swapped[[3, 4]] = swapped[[4, 3]]
    z = harmonic_extension(L, mesh.boundary, swapped)
    found, rounds = without_folds(mesh, L, z)
    assert rounds >= 1
    assert (signed_areas(found, mesh.F) > 0).all()
    others = np.delete(np.arange(len(circle)), [3, 4])
    np.testing.assert_allclose(found[mesh.boundary][others], circle[others], rtol=1e-12)


def test_points_in_order_stay_where_they_are():
    circle = np.exp(1j * (3 + np.sort(np.random.default_rng(0).random(20) + np.arange(20)) * 0.3))
    np.testing.assert_allclose(in_order(circle), circle, rtol=1e-12)


def test_the_cut_may_be_anywhere():
    circle = np.exp(2j * np.pi * np.arange(12) / 12)
    circle[[5, 6]] = circle[[6, 5]]
    for k in range(12):
        ordered = in_order(np.roll(circle, k))
        assert backward_arcs(ordered) == 0
        np.testing.assert_allclose(ordered, np.roll(in_order(circle), k), atol=1e-12)


@pytest.mark.parametrize("order", [-1, 2, 0])
def test_a_boundary_that_does_not_go_round_once_cannot_be_repaired(order):
    circle = np.exp(2j * np.pi * order * np.arange(30) / 30)
    with pytest.raises(AlgorithmFailed, match="too far out of order"):
        in_order(circle)


def test_a_map_turned_over_cannot_be_repaired():
    mesh = flat_disk(150)
    with pytest.raises(AlgorithmFailed, match="goes round the circle -1 time"):
        without_folds(mesh, laplacian(mesh), mesh.V[:, 0] - 1j * mesh.V[:, 1])


def test_a_scrambled_boundary_is_not_taken_for_one_with_a_few_swaps():
    circle = np.exp(2j * np.pi * np.arange(30) / 30)
    circle[[3, 4, 8, 9, 13, 14, 18, 19]] = circle[[4, 3, 9, 8, 14, 13, 19, 18]]
    with pytest.raises(AlgorithmFailed, match="4 of its 30 arcs go backward"):
        in_order(circle)
