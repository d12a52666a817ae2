import numpy as np

from cembench.mesh import topology
from cembench.mesh.gluing import edges_of_half_edges, glue, paired_half_edges
from tests import gallery


def test_all_pairs_give_the_surface_back():
    V, F = gallery.torus()
    _, edge, faces = edges_of_half_edges(F)
    again, origin = glue(F, paired_half_edges(edge, faces), len(V))
    np.testing.assert_array_equal(again, F)
    np.testing.assert_array_equal(origin, np.arange(len(V)))


def test_no_pairs_leave_every_triangle_alone():
    V, F = gallery.torus()
    apart, origin = glue(F, np.empty((0, 2), np.int64), len(V))
    assert len(np.unique(apart)) == F.size
    np.testing.assert_array_equal(origin[apart], F)
    np.testing.assert_array_equal(origin[: len(V)], np.arange(len(V)))


def test_pairs_of_any_orientation_are_glued():
    _, F = gallery.flat_rectangle()
    turned = np.where(np.arange(len(F))[:, None] % 3 == 0, F[:, ::-1], F)
    _, edge, faces = edges_of_half_edges(turned)
    again, _ = glue(turned, paired_half_edges(edge, faces), F.max() + 1)
    np.testing.assert_array_equal(again, turned)


def test_a_vertex_of_two_fans_becomes_two():
    V, F = gallery.bow_tie()
    _, edge, faces = edges_of_half_edges(F)
    split, origin = glue(F, paired_half_edges(edge, faces), len(V))
    assert origin.tolist() == [0, 1, 2, 3, 4, 0]
    assert topology.components(split, 6)[0] == 2
