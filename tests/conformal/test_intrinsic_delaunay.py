import igl
import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from scipy import sparse

from cembench import DiskMesh
from cembench.conformal import intrinsic_delaunay as own
from cembench.conformal.laplacian import (
    delaunay_laplacian,
    half_cotangents,
    laplacian,
    laplacian_of_weights,
)
from cembench.mesh.files import read_mesh
from cembench.mesh.flips import Independence, area_of_sides
from tests import gallery
from tests.real_meshes import real_mesh


def of(V, F):
    lengths = np.linalg.norm(V[F[:, [1, 2, 0]]] - V[F[:, [2, 0, 1]]], axis=2)
    return own.intrinsic_delaunay(F, lengths, half_cotangents(V, F))


def area(lengths):
    return area_of_sides(*lengths.T).sum()


@pytest.mark.parametrize(
    "mesh", [hemi_ellipsoid(1500, x=5.0), flat_disk(1500, stretch=6.0), gallery.three_holes(900)]
)
def test_the_laplacian_is_that_of_libigl(mesh):
    weights = laplacian(mesh, delaunay=True)
    reference = -igl.intrinsic_delaunay_cotmatrix(mesh.V, mesh.F)[0]
    assert abs(weights - reference).max() < 1e-12 * abs(reference).max()


def test_a_stretched_disk_is_triangulated_anew_and_stays_the_same_surface():
    mesh = flat_disk(1500, stretch=6.0)
    F, lengths, weights = of(mesh.V, mesh.F)
    assert (F != mesh.F).any(axis=1).sum() > 500
    # In the plane the lengths must be the distances, and the triangles cover the disk once.
    ends = mesh.V[F[:, [1, 2, 0]]] - mesh.V[F[:, [2, 0, 1]]]
    assert lengths == pytest.approx(np.linalg.norm(ends, axis=2))
    assert weights == pytest.approx(half_cotangents(mesh.V, F))
    corners = mesh.V[F]
    signed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2] / 2
    assert signed.min() > 0
    assert signed.sum() == pytest.approx(area(lengths))


def test_angles_round_every_vertex_and_area_stay():
    """A metric with cone points is known by its lengths; a flip must not change it."""
    mesh = hemi_ellipsoid(3000, z=8.0)
    rough = mesh.V + 0.02 * np.random.default_rng(3).normal(size=mesh.V.shape)
    F, lengths, weights = of(rough, mesh.F)
    assert (F != mesh.F).any()

    def angle_sums(F, weights):
        angles = np.arctan2(1, 2 * weights)
        return np.bincount(F.ravel(), angles.ravel())

    before = half_cotangents(rough, mesh.F)
    assert angle_sums(F, weights) == pytest.approx(angle_sums(mesh.F, before), abs=1e-9)
    corners = rough[mesh.F]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert area(lengths) == pytest.approx(np.linalg.norm(normals, axis=1).sum() / 2)


def test_flips_end_where_rounding_makes_both_edges_look_wrong():
    """A fan of needles, 40,000 times as long as wide, on which flips of libigl do not end."""
    angles = 2 * np.pi * np.arange(12) / 12
    rim = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    V = np.concatenate([[[0, 0, 4e4]], rim, 2 * rim])
    inner, outer = 1 + np.arange(12), 13 + np.arange(12)
    right, outer_right = np.roll(inner, -1), np.roll(outer, -1)
    F = np.concatenate(
        [
            np.stack([0 * inner, inner, right], axis=1),
            np.stack([inner, outer, outer_right], axis=1),
            np.stack([inner, outer_right, right], axis=1),
        ]
    )
    L = laplacian(DiskMesh(V, F), delaunay=True)
    assert np.isfinite(L.data).all()
    assert abs(L.sum(axis=1)).max() < 1e-12 * abs(L).max()


@pytest.mark.parametrize("name", ["chinese_lion.obj", "canonical_face.obj", "mountain.ply"])
def test_no_weight_inside_is_negative_on_a_real_mesh(name):
    """Sides of the boundary cannot be flipped."""
    mesh = read_mesh(real_mesh(name))

    before, after = (
        laplacian(mesh, delaunay=delaunay)[mesh.interior] for delaunay in (False, True)
    )
    before, after = (sparse.coo_array(L) for L in (before, after))
    largest = [L.data[mesh.interior[L.row] != L.col].max() for L in (before, after)]
    assert largest[0] > 1e-2
    assert largest[1] < 1e-9 * before.data.max()


def test_a_mesh_that_is_delaunay_stays_as_it_is():
    mesh = flat_disk(400)
    once = of(mesh.V, mesh.F)
    again = own.intrinsic_delaunay(*once)
    for before, after in zip(once, again, strict=True):
        np.testing.assert_array_equal(before, after)


def _with_one_thin_pair(mesh, wrong):
    """Move a vertex towards a neighbour's edge, so that the edge is Delaunay or not."""
    V = mesh.V.copy()
    obtuse = half_cotangents(V, mesh.F) < 0
    assert not obtuse.any()
    inside = np.flatnonzero(~np.isin(mesh.F, mesh.boundary).any(axis=1))[0]
    tip, one, other = mesh.F[inside]
    V[tip] += (0.9 if wrong else 0.55) * ((V[one] + V[other]) / 2 - V[tip])
    return DiskMesh(V, mesh.F)


def _circle_in_a_zigzag(count):
    """Points on a circle, their triangles in a row, and the centre in one of them."""
    angle = 2 * np.pi * np.arange(count) / count
    V = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    rows = []
    low, high = 0, count - 1
    while high - low > 1:
        rows.append((high, low, high - 1) if len(rows) % 2 else (high, low, low + 1))
        low, high = (low, high - 1) if len(rows) % 2 == 0 else (low + 1, high)
    F = np.array(rows)
    areas = np.cross(V[F], V[np.roll(F, -1, axis=1)])[:, :, 2].min(axis=1)
    a, b, c = F[(middle := np.argmax(areas))]
    assert areas[middle] > 0
    new = [[a, b, count], [b, c, count], [c, a, count]]
    return np.concatenate([V, [[0, 0, 0]]]), np.concatenate([np.delete(F, middle, axis=0), new])


def test_flips_that_lead_far_are_all_made(monkeypatch):
    """The centre is in the circle of every triangle: flips go from one to the next."""
    disk, (V, F) = flat_disk(3000), _circle_in_a_zigzag(41)
    V, F = np.concatenate([disk.V, V]), np.concatenate([disk.F, F + disk.n])
    assert 0 < (half_cotangents(V, F) < 0).mean() < own.FEW
    values = of(V, F)
    assert (values[0] == len(V) - 1).any(axis=1).sum() == 41
    monkeypatch.setattr(own, "FEW", 0.0)
    for near, whole in zip(values, of(V, F), strict=True):
        np.testing.assert_array_equal(near, whole)


def test_the_share_of_moved_corners_is_told():
    assert delaunay_laplacian(flat_disk(600))[1] == 0
    mesh = hemi_ellipsoid(3000, z=6.0)
    L, changed = delaunay_laplacian(mesh)
    F, _, weights = of(mesh.V, mesh.F)
    assert abs(L - laplacian_of_weights(F, weights, mesh.n)).max() < 1e-9
    assert changed == (mesh.F != F).mean() > 0.1


@pytest.mark.parametrize("wrong", [False, True])
def test_few_obtuse_angles_are_looked_at_alone(monkeypatch, wrong):
    mesh = _with_one_thin_pair(flat_disk(1500), wrong)
    obtuse = (half_cotangents(mesh.V, mesh.F) < 0).mean()
    assert 0 < obtuse < own.FEW
    values = of(mesh.V, mesh.F)
    assert (values[0] is mesh.F) == (not wrong)
    monkeypatch.setattr(own, "FEW", 0.0)
    for short, long in zip(values, of(mesh.V, mesh.F), strict=True):
        np.testing.assert_array_equal(short, long)


def test_edges_are_flipped_at_once_only_where_they_share_no_triangle():
    apart = Independence(6)
    left, right = np.array([3, 0, 4, 3]), np.array([1, 1, 5, 1])
    # The second edge shares triangle 1 with the first; the last is the first once more.
    for _ in range(2):
        assert apart(left, right).tolist() == [True, False, True, False]
