import numpy as np
import pytest

from cembench import AlgorithmFailed
from cembench.geometry.folds import without_folds
from cembench.geometry.harmonic import arc_length_circle, harmonic_extension
from cembench.geometry.laplacian import laplacian
from cembench.geometry.planar import signed_areas
from meshes_gen.flat_disk import flat_disk
from meshes_gen.hemi_ellipsoid import hemi_ellipsoid
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


def test_a_boundary_out_of_order_cannot_be_repaired():
    mesh = flat_disk(150)
    z = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    i, j = mesh.boundary[[3, 4]]
    z[[i, j]] = z[[j, i]]
    with pytest.raises(AlgorithmFailed, match=r"\d+ of its 30 arcs go backward"):
        without_folds(mesh, laplacian(mesh), z)


def test_a_boundary_that_goes_the_wrong_way_cannot_be_repaired():
    mesh = flat_disk(150)
    z = mesh.V[:, 0] - 1j * mesh.V[:, 1]
    with pytest.raises(AlgorithmFailed, match="no map of the interior can undo"):
        without_folds(mesh, laplacian(mesh), z)
