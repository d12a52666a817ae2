import numpy as np
import pytest

from cembench import ParameterError
from cembench.drawing.painter import draw_clay
from cembench.morphing.drawing import VIEWS, Film, check_views, draw_film
from tests.morphing.reliefs import relief


@pytest.fixture(scope="module")
def film():
    mesh = relief(faces=600)
    return Film.of(mesh, [mesh.V, 0.5 * mesh.V], np.linspace(0, 1, 3), side=96)


def test_a_film_has_a_panel_for_each_view(film):
    assert film.shape == (3, 96, 96 * len(VIEWS), 3)


def test_every_frame_fits_into_its_panel(film):
    for frame in range(3):
        for view in range(3):
            assert np.abs(film.in_window(frame, view)[:, :2]).max() <= 1


def test_views_are_a_front_a_side_and_one_between(film):
    toward = film.rotations[:, 2]
    angles = np.rad2deg(np.arccos(np.clip(toward @ toward[0], -1, 1)))
    np.testing.assert_allclose(angles, [0, 90, 45], atol=1e-6)


@pytest.mark.parametrize("views", [["back"], []])
def test_an_unknown_view_is_refused(views):
    with pytest.raises(ParameterError, match="allowed: front, side, three-quarter"):
        check_views(views)


def test_a_surface_is_drawn_where_it_is(film):
    """What is drawn covers the triangles' corners and leaves the margin white."""
    points = film.in_window(0, 0)
    picture = draw_clay(film.F, points, 96)
    seen = (picture < 255).any(axis=2)
    inside = points[np.hypot(*points[:, :2].T) < 0.8]
    column = ((inside[:, 0] + 1) / 2 * 96).astype(int)
    row = ((1 - inside[:, 1]) / 2 * 96).astype(int)
    assert seen[row, column].all()
    assert not seen[0].any()


def test_every_frame_is_drawn_and_told(film):
    frames = []
    pictures = draw_film(film, frames.append)
    assert frames == [0, 1, 2]
    assert pictures.shape == film.shape
    assert (pictures < 255).any(axis=(1, 2, 3)).all()
    np.testing.assert_array_equal(
        pictures[1, :, 96:192], draw_clay(film.F, film.in_window(1, 1), 96)
    )
