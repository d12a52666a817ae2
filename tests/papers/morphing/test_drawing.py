import numpy as np
import pytest
from cembench.papers.cem.morphing.drawing import VIEWS, check_views, draw_film, fitted_views
from cembench.papers.cem.morphing.path import position

from cembench import ParameterError
from cembench.drawing.painter import draw_clay
from tests.papers.morphing.reliefs import relief

MESH = relief(faces=600)
STOPS, TIMES = [MESH.V, 0.5 * MESH.V], np.linspace(0, 1, 3)


@pytest.fixture(scope="module")
def views():
    """The vertices of each frame in each view, and the rotations."""
    places, rotations = fitted_views(MESH, STOPS, VIEWS)
    return [[position(places, time) @ r.T for r in rotations] for time in TIMES], rotations


def test_every_frame_fits_into_its_panel(views):
    assert all(np.abs(points[:, :2]).max() <= 1 for frame in views[0] for points in frame)


def test_views_are_a_front_a_side_and_one_between(views):
    toward = views[1][:, 2]
    angles = np.rad2deg(np.arccos(np.clip(toward @ toward[0], -1, 1)))
    np.testing.assert_allclose(angles, [0, 90, 45], atol=1e-6)


@pytest.mark.parametrize("views", [["back"], []])
def test_an_unknown_view_is_refused(views):
    with pytest.raises(ParameterError, match="allowed: front, side, three-quarter"):
        check_views(views)


def test_a_surface_is_drawn_where_it_is(views):
    """What is drawn covers the triangles' corners and leaves the margin white."""
    points = views[0][0][0]
    picture = draw_clay(MESH.F, points, 96)
    seen = (picture < 255).any(axis=2)
    inside = points[np.hypot(*points[:, :2].T) < 0.8]
    column = ((inside[:, 0] + 1) / 2 * 96).astype(int)
    row = ((1 - inside[:, 1]) / 2 * 96).astype(int)
    assert seen[row, column].all()
    assert not seen[0].any()


def test_every_frame_is_drawn_and_told(views):
    frames = []
    pictures = draw_film(MESH, STOPS, TIMES, side=96, tell=frames.append)
    assert frames == [0, 1, 2]
    assert pictures.shape == (3, 96, 96 * len(VIEWS), 3)
    assert (pictures < 255).any(axis=(1, 2, 3)).all()
    np.testing.assert_array_equal(pictures[1, :, 96:192], draw_clay(MESH.F, views[0][1][1], 96))
