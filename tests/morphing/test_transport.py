import numpy as np
import pytest
from cembench.algorithms.cem import cem

from cembench.morphing.transport import locate
from tests.morphing.reliefs import relief


@pytest.fixture(scope="module")
def face():
    mesh = relief(faces=1200)
    return mesh, cem(mesh).uv


def test_vertices_are_found_where_they_are(face):
    mesh, uv = face
    at = locate(uv, mesh.F, mesh.boundary, uv)
    np.testing.assert_allclose(at.carry(mesh.F, mesh.V), mesh.V, atol=1e-9)


def test_points_lie_in_the_triangles_that_are_found(face):
    """Against the definition: the barycentric weights are not negative and give the point back."""
    mesh, uv = face
    rng = np.random.default_rng(0)
    points = 0.98 * np.sqrt(rng.random(500)) * np.exp(2j * np.pi * rng.random(500))
    at = locate(uv, mesh.F, mesh.boundary, points)
    assert (at.weights >= 0).all()
    np.testing.assert_allclose(at.weights.sum(axis=1), 1, rtol=1e-12)
    np.testing.assert_allclose((uv[mesh.F[at.faces]] * at.weights).sum(axis=1), points, atol=1e-12)


def test_linear_values_are_carried_exactly(face):
    mesh, uv = face
    points = 0.5 * np.exp(2j * np.pi * np.arange(40) / 40)
    at = locate(uv, mesh.F, mesh.boundary, points)
    found = at.carry(mesh.F, 3 * uv.real - uv.imag)
    np.testing.assert_allclose(found, 3 * points.real - points.imag, atol=1e-12)


def test_points_beyond_a_boundary_edge_come_to_its_chord(face):
    mesh, uv = face
    loop = uv[mesh.boundary]
    following = np.roll(loop, -1)
    middle = np.exp(1j * (np.angle(loop) + np.angle(following / loop) / 2))
    at = locate(uv, mesh.F, mesh.boundary, middle)
    place = at.carry(mesh.F, mesh.V)
    ends = mesh.V[mesh.boundary], mesh.V[np.roll(mesh.boundary, -1)]
    np.testing.assert_allclose(place, (ends[0] + ends[1]) / 2, atol=1e-9)
