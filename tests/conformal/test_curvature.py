import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.sheets import cylinder_sheet
from cembench.surfaces.spherical_cap import spherical_cap

from cembench.conformal.curvature import mean_curvature
from cembench.mesh.triangle_mesh import DiskMesh


def test_a_unit_sphere_has_curvature_one_everywhere():
    H = mean_curvature(spherical_cap(8_000))
    assert pytest.approx(1, abs=0.05) == H


def test_it_grows_as_the_surface_shrinks_and_changes_sign_when_turned_inside_out():
    cap = spherical_cap(1_000)
    H = mean_curvature(cap)
    small = DiskMesh.from_arrays(cap.V / 2, cap.F)
    np.testing.assert_allclose(mean_curvature(small), 2 * H, rtol=1e-9)
    turned = DiskMesh.from_arrays(cap.V, cap.F[:, ::-1])
    np.testing.assert_allclose(mean_curvature(turned), -H, rtol=1e-9)


def test_a_cylinder_has_half_of_one_over_its_radius():
    sheet = cylinder_sheet(4_000)
    radius = np.median(np.hypot(sheet.V[:, 0], sheet.V[:, 1]))
    H = mean_curvature(sheet)[sheet.interior]
    assert np.median(np.abs(H)) == pytest.approx(1 / (2 * radius), rel=0.02)


def test_a_flat_surface_has_none():
    assert mean_curvature(flat_disk(500)) == pytest.approx(0, abs=1e-9)
