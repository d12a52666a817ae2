import numpy as np
import pytest
from cembench.surfaces.holed_disk import holed_disk
from cembench.textures.resample import geometry_image, regular_remesh

from cembench import DiskMesh, ParameterError
from cembench.conformal.resample import locate
from cembench.mesh.triangle_mesh import definition_1_notices
from cembench.mesh.unit_square import to_unit_square
from cembench.registry import load_registry
from tests import gallery


@pytest.fixture(scope="module")
def cap():
    return gallery.mapped_cap()


def test_a_geometry_image_lies_on_the_surface_and_is_full(cap):
    mesh, z = cap
    image = geometry_image(mesh, z, 33)
    assert image.shape == (33, 33, 3)
    radius = np.linalg.norm(image, axis=2)
    np.testing.assert_allclose(radius, np.linalg.norm(mesh.V[0]), atol=5e-3)
    rim = image[[0, -1], :, 2], image[:, [0, -1], 2]
    for heights in rim:
        np.testing.assert_allclose(heights, mesh.V[mesh.boundary, 2].mean(), atol=5e-3)
    # Its squares are squares of the surface, away from the corners.
    inner = image[8:-8, 8:-8]
    across, down = np.diff(inner, axis=1)[:-1], np.diff(inner, axis=0)[:, :-1]
    cosine = (across * down).sum(axis=2) / (
        np.linalg.norm(across, axis=2) * np.linalg.norm(down, axis=2)
    )
    assert np.abs(cosine).max() < 0.1


def test_the_first_row_is_the_top(cap):
    mesh, z = cap
    image = geometry_image(mesh, z, 9, "disk")
    up = mesh.V[np.argmax(z.imag)]
    assert np.linalg.norm(image[0, 4] - up) < 0.35 * np.linalg.norm(image[-1, 4] - up)
    assert np.isnan(image[0, 0]).all()


def test_holes_stay_holes_in_a_geometry_image():
    mesh = holed_disk(400)
    z = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    image = geometry_image(mesh, z, 65, "disk")
    known = np.isfinite(image[..., 0])
    np.testing.assert_allclose(image[known][:, 2], 0, atol=1e-12)
    x = (np.arange(65) + 0.5) / 65
    expected = locate(to_unit_square(z), mesh.F, (x[None] + 1j * x[::-1, None]).ravel())[0] >= 0
    assert (known.ravel() == expected).mean() > 0.999
    assert known[32, 32] == expected.reshape(65, 65)[32, 32]
    with pytest.raises(
        ParameterError, match=r"does not cover the disk: the surface has \d+ boundaries"
    ):
        geometry_image(mesh, z, 65)


def test_a_regular_mesh_lies_on_the_surface_with_nearly_equal_angles(cap):
    mesh, z = cap
    new, new_z = regular_remesh(mesh, z, 41)
    assert len(new.loops) == 1
    np.testing.assert_allclose(np.abs(new_z[new.boundary]), 1, atol=1e-12)
    radius = np.linalg.norm(new.V, axis=1)
    np.testing.assert_allclose(radius, np.linalg.norm(mesh.V[0]), atol=5e-3)
    P = new.V[new.F]
    u, v = P[:, [1, 2, 0]] - P, P[:, [2, 0, 1]] - P
    cosine = (u * v).sum(axis=2) / (np.linalg.norm(u, axis=2) * np.linalg.norm(v, axis=2))
    angles = np.rad2deg(np.arccos(cosine))
    assert np.quantile(np.abs(angles - 60), 0.8) < 6


@pytest.mark.parametrize("side", [3, 8193])
def test_a_side_out_of_range_is_refused(cap, side):
    with pytest.raises(ParameterError, match="write an integer from 4 to 8,192"):
        geometry_image(*cap, side)


def test_more_samples_than_a_surface_has_room_for_are_refused_with_a_number_that_works():
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle(4, 5))
    z = load_registry().algorithm("direct-cem").function(mesh).uv
    with pytest.raises(ParameterError, match="side=129 is too many") as refused:
        regular_remesh(mesh, z, 129)
    fewer = int(str(refused.value).rpartition("side=")[2].rstrip("."))
    assert regular_remesh(mesh, z, fewer)[0].m >= mesh.m


def test_a_map_that_is_not_onto_the_disk_is_refused(cap):
    mesh, z = cap
    with pytest.raises(ParameterError, match="off the unit circle by up to 1"):
        regular_remesh(mesh, 2 * z, 9)


def test_a_remeshed_surface_meets_definition_1():
    """Section 2: "Otherwise, a remeshing process can be applied to reach the conditions"."""
    i, j, F = gallery.grid(8, 8)  # two of its corners are ears, without an interior neighbour
    V = np.stack([j / 8, i / 8, 0.2 * np.sin(i / 3.0) * np.cos(j / 4.0)], 1)
    mesh = DiskMesh.from_arrays(V, F)
    assert definition_1_notices(mesh.F, mesh.n, mesh.loops)
    z = load_registry().algorithm("direct-cem").function(mesh).uv
    again, image = regular_remesh(mesh, z, 24)
    assert definition_1_notices(again.F, again.n, again.loops) == ()
    assert len(image) == again.n
