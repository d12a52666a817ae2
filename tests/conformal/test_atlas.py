"""Islands, seams and figures of maps that cut a surface, on surfaces where all is known."""

import numpy as np
import pytest

from cembench.conformal.atlas import atlas_metrics, cut_map
from cembench.conformal.metrics import all_metrics
from cembench.mesh.triangle_mesh import TriangleMesh

#: A strip of four squares, each cut along its diagonal.
N = 4
V = np.array([[x, y, 0.0] for y in (0, 1) for x in range(N + 1)])
K = np.arange(N)
F = np.stack(
    [np.stack([K, K + 1, K + N + 2], axis=1), np.stack([K, K + N + 2, K + N + 1], axis=1)], axis=1
).reshape(-1, 3)
STRIP = TriangleMesh.from_arrays(V, F)
Z = V[:, 0] + 1j * V[:, 1]


def test_without_a_seam_the_figures_are_those_of_a_map():
    uv = Z + 0.1 * Z**2 / N
    figures, known = atlas_metrics(STRIP, uv[F]), all_metrics(STRIP, uv)
    for name in figures.keys() & known.keys():
        assert figures[name] == pytest.approx(known[name], rel=1e-12, abs=1e-12), name
    assert (figures["islands"], figures["seam_length"]) == (1, 0)
    stretch = (known["dilatation_max"] - 1) / (known["dilatation_max"] + 1)
    assert figures["beltrami_max"] == pytest.approx(stretch)


def test_islands_hang_together_by_edges_and_seams_have_their_length_on_the_surface():
    corners = Z[F]
    corners[4:] += 10
    cut = cut_map(STRIP, corners)
    assert cut.islands == 2
    assert (cut.island == [0, 0, 0, 0, 1, 1, 1, 1]).all()
    assert cut.seams.tolist() == [[2, N + 3]]
    assert cut.seam_length == 1
    assert atlas_metrics(STRIP, corners)["conformal_energy"] == pytest.approx(0)


def test_triangles_that_share_a_corner_alone_are_two_islands():
    corners = Z[F].copy()
    corners[0, 0] -= 5  # the first triangle keeps the images of its edge to nobody
    cut = cut_map(STRIP, corners)
    assert cut.islands == 2
    assert cut.seam_length == pytest.approx(np.sqrt(2))


def test_an_island_may_lie_mirrored_turned_and_of_another_size():
    corners = Z[F]
    corners[4:] = 3j * corners[4:].conj() - 7
    figures = atlas_metrics(STRIP, corners)
    assert (figures["mirrored_islands"], figures["flipped_triangles"]) == (1, 0)
    assert figures["beltrami_max"] == pytest.approx(0, abs=1e-12)
    assert figures["conformal_energy"] == pytest.approx(0, abs=1e-12)
    assert figures["image_area"] == pytest.approx(2 + 9 * 2)


def test_folds_are_counted_by_island():
    corners = Z[F]
    corners[4:] += 10
    corners[F == N] = 10 + 2.5 + 2j  # the last corner goes over its neighbours
    figures = atlas_metrics(STRIP, corners)
    assert figures["flipped_triangles"] == figures["folds_of_worst_island"] > 0


def test_a_triangle_that_collapsed_has_mu_of_modulus_one():
    corners = Z[F]
    corners[0] = 0
    figures = atlas_metrics(STRIP, corners)
    assert figures["beltrami_max"] == 1
    assert figures["flipped_triangles"] == 1
