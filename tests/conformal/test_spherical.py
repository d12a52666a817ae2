import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench.conformal.doubling import doubled_surface
from cembench.conformal.planar import signed_areas
from cembench.conformal.spherical import balanced, harmonic_around_triangle, most_regular_triangle
from cembench.conformal.stereographic import to_plane, to_sphere


@pytest.fixture(scope="module")
def closed():
    _, double, L_double, V = doubled_surface(hemi_ellipsoid(600, x=1.3))
    return V, double.F, L_double


def sides(points, triangle):
    corners = points[triangle]
    if np.iscomplexobj(corners):
        return np.abs(corners - np.roll(corners, 1))
    return np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)


def test_an_equilateral_triangle_is_the_most_regular():
    V = np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(3) / 2, 0], [0, 3, 0]])
    assert most_regular_triangle(V, np.array([[0, 2, 3], [0, 1, 2]])) == 1


def test_the_map_is_harmonic_and_its_triangle_keeps_its_shape(closed):
    V, F, L = closed
    t = most_regular_triangle(V, F)
    z = harmonic_around_triangle(L, V, F[t])
    ratio = sides(z, F[t]) / sides(V, F[t])
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-12)
    free = np.setdiff1d(np.arange(len(z)), F[t])
    assert abs((L @ z)[free]).max() < 1e-12
    assert abs(z.mean()) < 1e-14
    areas = signed_areas(z, F)
    assert areas[t] > 0
    assert (np.delete(areas, t) < 0).all()


def test_balanced_poles_look_alike(closed):
    V, F, L = closed
    t = most_regular_triangle(V, F)
    z = balanced(harmonic_around_triangle(L, V, F[t]), F, t)
    w = to_plane(to_sphere(z), "south")
    reach = np.abs(z)[F].sum(axis=1)
    reach[t] = np.inf
    assert sides(z, F[t]).mean() == pytest.approx(sides(w, F[np.argmin(reach)]).mean())
