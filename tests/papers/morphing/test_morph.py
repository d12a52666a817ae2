import numpy as np
import pytest
from cembench.papers.cem.morphing.landmarks import Landmarks
from cembench.papers.cem.morphing.metrics import distances_to, mean_edge
from cembench.papers.cem.morphing.morph import morph

from cembench.conformal.metrics import flipped_triangles
from tests.papers.morphing.reliefs import relief, three


@pytest.fixture(scope="module")
def reliefs():
    return three()


@pytest.fixture(scope="module")
def found(reliefs):
    return morph(*reliefs, pose="keep")


@pytest.fixture(scope="module")
def figures(found):
    return found.metrics(48)


def test_carried_vertices_lie_on_the_target(found):
    for mesh, carried in zip(found.meshes[1:], found.carried[1:], strict=True):
        assert distances_to(carried, mesh.V, mesh.F).max() < 1e-9


def test_the_boundary_is_carried_to_the_boundary(found):
    first, second = found.meshes[:2]
    rim = found.carried[1][first.boundary]
    radius = np.linalg.norm(rim[:, :2], axis=1)
    assert radius.min() > np.cos(np.pi / len(second.boundary)) - 1e-9


def test_registrations_meet_their_landmarks_without_folds(found, figures):
    for row, mesh, registration in zip(
        figures["registrations"], found.meshes[1:], found.registrations, strict=True
    ):
        assert row["landmark_error_share"] < 0.01
        assert row["flipped_triangles"] == flipped_triangles(mesh, registration.uv) == 0
        assert row["distance_mean_edges"] < 0.5
        assert row["dilatation_max"] >= row["dilatation_mean"] >= 1
        assert row["dirichlet_energy"] > 3.1


def test_the_path_has_no_jumps(found, figures):
    """In 48 frames no vertex goes further than a few times its share of the whole way."""
    way = max(
        np.linalg.norm(b - a, axis=1).max()
        for a, b in zip(found.stops, found.stops[1:], strict=False)
    )
    size = np.linalg.norm(np.ptp(found.meshes[0].V, axis=0))
    assert figures["largest_step_share"] < 4 * way / size * 2 / 47


def test_landmarks_travel_to_their_counterparts(found):
    places = found.landmarks.vertices
    for k, time in ((1, 0.5), (2, 1.0)):
        off = found.at(time)[places[:, 0]] - found.meshes[k].V[places[:, k]]
        assert np.linalg.norm(off, axis=1).max() < 0.02


def test_a_surface_morphs_into_itself_without_moving(reliefs):
    (mesh, *_), (uv, *_), landmarks = reliefs
    own = Landmarks(landmarks.names, landmarks.vertices[:, [0, 0]])
    still = morph([mesh, mesh], [uv, uv], own)
    np.testing.assert_allclose(still.carried[1], mesh.V, atol=1e-3)
    assert still.metrics(5)["registrations"][0]["hausdorff_edges"] < 0.05


def test_a_pose_removes_how_the_target_stands(reliefs):
    """Turned, moved and scaled, it morphs the same way."""
    meshes, maps, landmarks = reliefs
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    elsewhere = type(meshes[1]).from_arrays(7 * meshes[1].V @ turn + 4, meshes[1].F)
    two = Landmarks(landmarks.names, landmarks.vertices[:, :2])
    plain = morph(meshes[:2], maps[:2], two)
    moved = morph([meshes[0], elsewhere], maps[:2], two)
    np.testing.assert_allclose(moved.stops[1], plain.stops[1], atol=1e-9)
    rigid = morph(meshes[:2], maps[:2], two, pose="rigid")
    assert mean_edge(relief()) == pytest.approx(mean_edge(relief(name="again")))
    assert np.linalg.norm(np.ptp(rigid.stops[1], axis=0)) > 0


def test_without_landmarks_curvature_brings_the_noses_near(reliefs):
    meshes, maps, landmarks = reliefs
    none = Landmarks((), np.empty((0, 2), dtype=np.int64))
    result = morph(meshes[:2], maps[:2], none)
    nose = landmarks.vertices[0]
    off = result.carried[1][nose[0]] - meshes[1].V[nose[1]]
    assert np.linalg.norm(off) < 0.15


def test_the_same_call_gives_the_same_bits(reliefs, found):
    again = morph(*reliefs, pose="keep")
    for one, two in zip(found.carried, again.carried, strict=True):
        np.testing.assert_array_equal(one, two)
