import numpy as np
import pytest
from cembench.algorithms.cem import cem
from cembench.papers.cem.morphing.align import (
    aligned,
    best_turn,
    centred,
    to_centre,
    vertex_areas,
    without_new_folds,
)

from cembench.conformal.laplacian import cotangent_laplacian
from cembench.conformal.metrics import flipped_triangles
from tests.papers.morphing.reliefs import SMILE, relief, vertices_of

NONE = np.empty(0, dtype=np.int64)


@pytest.fixture(scope="module")
def face():
    mesh = relief(SMILE)
    return mesh, cem(mesh).uv, np.array(list(vertices_of(mesh, SMILE).values()))


def test_the_disk_is_carried_to_itself_and_the_point_to_its_centre():
    m = to_centre(0.3 - 0.5j, 0.7)
    circle = np.exp(2j * np.pi * np.arange(50) / 50)
    np.testing.assert_allclose(np.abs(m(circle)), 1, rtol=1e-12)
    np.testing.assert_allclose(m(np.array([0.3 - 0.5j])), 0, atol=1e-15)
    np.testing.assert_allclose(m.inverse(m(0.4 * circle)), 0.4 * circle, rtol=1e-12)


def test_the_best_turn_is_the_one_that_was_made():
    z = np.array([0.1 + 0.2j, -0.5j, 0.7])
    assert best_turn(z, z * np.exp(0.4j)) == pytest.approx(0.4)


def test_vertex_areas_add_up_to_the_surface(face):
    mesh, _, _ = face
    p, q, r = (mesh.V[mesh.F[:, c]] for c in range(3))
    faces = np.linalg.norm(np.cross(q - p, r - p), axis=1)
    of_first = faces[(mesh.F == 0).any(axis=1)].sum() / 3
    assert vertex_areas(mesh).sum() == pytest.approx(1, rel=1e-12)
    assert vertex_areas(mesh)[0] == pytest.approx(of_first / faces.sum(), rel=1e-12)


def test_without_landmarks_the_area_is_centred(face):
    mesh, z, _ = face
    moved = centred(mesh, to_centre(0.6 + 0.1j)(z), NONE)
    area = vertex_areas(mesh)
    assert abs(area @ moved) / area.sum() < 1e-8


@pytest.mark.parametrize("how_many", [0, 1, 4])
def test_a_map_that_was_moved_is_brought_back(face, how_many):
    """By all landmarks exactly, by a single one or none as well as the grid tells curvature."""
    mesh, z, landmarks = face
    chosen = landmarks[:how_many]
    reference = centred(mesh, z, chosen)
    moved = to_centre(-0.4 + 0.3j, 2.0)(reference)
    back = aligned(mesh, moved, chosen, mesh, reference, chosen)
    off = np.abs(back - reference).max()
    assert off < (1e-10 if how_many == 4 else 0.03)


def test_curvature_aligns_two_meshes_of_one_surface(face):
    mesh, z, _ = face
    other = relief(SMILE, faces=1500)
    reference = centred(mesh, z, NONE)
    turned = aligned(other, to_centre(0.3j, 1.0)(cem(other).uv), NONE, mesh, reference, NONE)
    there, here = (list(vertices_of(m, SMILE).values()) for m in (other, mesh))
    assert np.abs(turned[there] - reference[here]).max() < 0.06


def test_a_triangle_that_a_moebius_map_folds_is_laid_flat():
    """On a coarse disk, with a point very near to the boundary taken to the centre."""
    mesh = relief(faces=150)
    z = cem(mesh).uv
    moved = to_centre(0.98j)(z)
    assert flipped_triangles(mesh, moved) > 0
    flat = without_new_folds(mesh, moved)
    assert flipped_triangles(mesh, flat) == 0
    np.testing.assert_array_equal(flat[mesh.boundary], moved[mesh.boundary])
    assert without_new_folds(mesh, z) is z


def test_alignment_is_conformal(face):
    """Moebius maps change angles only as far as triangles are not small."""
    mesh, z, landmarks = face
    moved = centred(mesh, z, landmarks)
    uv = np.stack([moved.real, moved.imag], 1)
    energy = 0.5 * np.vdot(moved, cotangent_laplacian(mesh.V, mesh.F) @ moved).real
    own = 0.5 * np.vdot(moved, cotangent_laplacian(uv, mesh.F) @ moved).real
    assert energy == pytest.approx(own, rel=0.02)
