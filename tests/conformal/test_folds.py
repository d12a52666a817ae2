import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import AlgorithmFailed, DiskMesh
from cembench.conformal.folds import in_order, interior_without_folds, without_folds
from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian
from cembench.conformal.planar import backward_arcs, folded_triangles, signed_areas
from tests import gallery


def tall_vertex_in_the_middle():
    """A flat disk with one vertex far above it: the triangles round it are slivers."""
    mesh = flat_disk(600)
    V = mesh.V.copy()
    middle = np.argmin(np.linalg.norm(V, axis=1))
    V[middle] += [0.3, 0.2, 2]
    return DiskMesh.from_arrays(V, mesh.F)


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
    np.testing.assert_array_equal(found[mesh.boundary][others], circle[others])


def test_only_the_surroundings_of_folds_move():
    mesh = tall_vertex_in_the_middle()
    L = laplacian(mesh)
    z = harmonic_extension(L, mesh.boundary, arc_length_circle(mesh))
    assert len(folded_triangles(z, mesh.F)) > 0
    found, rounds = without_folds(mesh, L, z)
    moved = np.flatnonzero(found != z)
    assert rounds == 1
    assert 0 < len(moved) < mesh.n / 10
    assert not len(folded_triangles(found, mesh.F))


def test_without_room_to_lay_a_fold_flat_the_map_stays_as_it_was():
    mesh = flat_disk(150)
    z = (mesh.V[:, 0] + 1j * mesh.V[:, 1]).copy()
    b = mesh.boundary
    z[b[3]] = -2  # the boundary is held, and crosses itself
    found, rounds = interior_without_folds(mesh, z)
    assert rounds > 0
    np.testing.assert_array_equal(found, z)


def test_arcs_stay_as_short_as_they_are():
    mesh = flat_disk(600)
    arcs = np.full(len(mesh.boundary), 1.0)
    arcs[10:20] = 1e-9
    circle = np.exp(2j * np.pi * (np.cumsum(arcs) - arcs) / arcs.sum())
    L = laplacian(mesh)
    z = harmonic_extension(L, mesh.boundary, circle)
    near = mesh.interior[np.argmin(np.abs(mesh.V[mesh.interior, :2]).sum(axis=1))]
    z[near] = 0.5  # folds triangles far from those arcs
    found, _ = without_folds(mesh, L, z)
    np.testing.assert_array_equal(found[mesh.boundary], circle)
    assert not len(folded_triangles(found, mesh.F))


def test_an_arc_of_zero_becomes_one_that_doubles_resolve():
    circle = np.exp(2j * np.pi * np.arange(30) / 30)
    circle[4] = circle[3]
    ordered = in_order(circle)
    assert 1e-13 < np.angle(ordered[4] / ordered[3]) < 1e-11
    np.testing.assert_allclose(ordered, circle, atol=1e-11)


def test_vertices_that_changed_places_are_spread_over_their_disorder():
    circle = np.exp(2j * np.pi * np.arange(30) / 30)
    circle[[5, 6, 7]] = circle[6] * np.exp([3e-6j, 0, -3e-6j])
    arcs = np.angle(np.roll(in_order(circle), -1) / in_order(circle))
    np.testing.assert_allclose(arcs[[5, 6]], 2e-6, rtol=1e-4)


def test_a_triangle_between_three_vertices_that_almost_coincide_gets_an_area():
    V, F = gallery.flat_rectangle(6, 9)
    mesh = DiskMesh.from_arrays(V, F)
    on_boundary = np.isin(mesh.F, mesh.boundary).all(axis=1)
    ear = mesh.F[on_boundary][0]
    tip = next(
        k
        for k, v in enumerate(mesh.boundary)
        if v in ear and mesh.boundary[k - 1] in ear and np.roll(mesh.boundary, -1)[k] in ear
    )
    arcs = np.ones(len(mesh.boundary))
    arcs[[tip - 1, tip]] = 1e-12
    circle = np.exp(2j * np.pi * (np.cumsum(arcs) - arcs) / arcs.sum())
    L = laplacian(mesh)
    z = harmonic_extension(L, mesh.boundary, circle)
    assert len(folded_triangles(z, mesh.F))
    found, _ = without_folds(mesh, L, z)
    assert not len(folded_triangles(found, mesh.F))
    assert abs(found[mesh.boundary] - circle).max() < 1e-11


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
    with pytest.raises(AlgorithmFailed, match="no repair of its order"):
        in_order(circle)


def test_a_map_turned_over_cannot_be_repaired():
    mesh = flat_disk(150)
    with pytest.raises(AlgorithmFailed, match="goes around the circle once, clockwise"):
        without_folds(mesh, laplacian(mesh), mesh.V[:, 0] - 1j * mesh.V[:, 1])


def test_a_scrambled_boundary_is_not_taken_for_one_with_a_few_swaps():
    circle = np.exp(2j * np.pi * np.arange(30) / 30)
    circle[[3, 4, 8, 9, 13, 14, 18, 19]] = circle[[4, 3, 9, 8, 14, 13, 19, 18]]
    with pytest.raises(AlgorithmFailed, match="4 of the boundary's 30 arcs go backward"):
        in_order(circle)
