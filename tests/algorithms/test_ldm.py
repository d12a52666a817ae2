import numpy as np
import pytest
from cembench.algorithms import ldm as module
from cembench.algorithms.ldm import ldm
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import AlgorithmFailed, DiskMesh
from cembench.conformal.metrics import all_metrics
from cembench.core.clock import measure
from tests import gallery


def test_it_is_direct():
    result = ldm(hemi_ellipsoid(600))
    assert result.iterations == 0
    assert result.energy_history == ()


def test_its_time_is_told_by_phases():
    mesh = hemi_ellipsoid(600).fresh()  # as a measured call gets it: nothing is known of it
    _, timing = measure(lambda: ldm(mesh))
    expected = {"laplacian", "assembly", "beltrami", "factorisation", "solves", "boundary"}
    assert expected <= set(timing.phases)


def test_three_points_keep_their_distances():
    corners = np.random.default_rng(0).standard_normal((3, 3))
    flat = module._congruent(corners)
    np.testing.assert_allclose(
        np.abs(flat - np.roll(flat, 1)),
        np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1),
    )
    assert (flat[0] + flat[1]) == pytest.approx(0)


@pytest.mark.parametrize("rows", [8, 12])
def test_ears_on_the_boundary_do_no_harm(rows):
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle(rows, 20))
    assert all_metrics(mesh, ldm(mesh).uv)["flipped_triangles"] == 0


def cone_over(corners, rings=60, height=8.0):
    """A tall cone over a polygon; its rings shrink by a tenth from one to the next."""
    k, ring = np.arange(corners), np.arange(rings)[:, None]
    z = 0.9**ring * np.exp(2j * np.pi * (k + 0.5 * (ring % 2)) / corners)
    V = np.stack([z.real, z.imag, height * (1 - np.abs(z))], axis=-1).reshape(-1, 3)
    F = []
    for j in range(rings - 1):
        a, b = j * corners + k, j * corners + (k + 1) % corners
        x, y = a + corners, b + corners
        x, y = (x, np.roll(x, 1)) if j % 2 == 0 else (y, x)
        F += [np.stack([a, b, x], axis=1), np.stack([a, x, y], axis=1)]
    last = (rings - 1) * corners
    tip = np.full(corners, len(V))
    F.append(np.stack([last + k, last + (k + 1) % corners, tip], axis=1))
    return DiskMesh.from_arrays(np.vstack([V, [0, 0, height]]), np.concatenate(F))


def test_a_boundary_beside_the_centre_is_named_as_a_limit_of_the_method():
    mesh = cone_over(45)
    with pytest.raises(AlgorithmFailed, match=r"LDM does not lay the boundary .* use direct-cem"):
        ldm(mesh)
    result = ldm(mesh, last_resort=True)
    assert all_metrics(mesh, result.uv)["flipped_triangles"] == 0
