import numpy as np
import pytest
from cembench.algorithms.harmonic_circle import harmonic_circle
from cembench.surfaces.flat_disk import flat_disk

from cembench import DiskMesh
from cembench.conformal.harmonic import arc_length_circle
from cembench.conformal.laplacian import laplacian
from tests import gallery


def test_arcs_are_in_proportion_to_edges():
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle(2, 3))
    z = arc_length_circle(mesh)
    steps = np.angle(np.roll(z, -1) / z)
    np.testing.assert_allclose(steps, 2 * np.pi / 10, rtol=1e-12)


def test_it_is_harmonic_inside_and_exact_on_a_round_disk():
    mesh = flat_disk(600)
    uv = harmonic_circle(mesh).uv
    assert abs((laplacian(mesh) @ uv)[mesh.interior]).max() < 1e-13
    assert uv == pytest.approx(mesh.V[:, 0] + 1j * mesh.V[:, 1], abs=1e-12)


def test_a_mesh_without_interior_has_nothing_to_solve():
    strip = DiskMesh.from_arrays(*gallery.flat_rectangle(1, 5))
    uv = harmonic_circle(strip).uv
    assert abs(abs(uv) - 1).max() < 1e-15
