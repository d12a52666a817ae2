import numpy as np
import pytest

from cembench.mesh import gluing, topology
from cembench.mesh.gluing import edges_of_half_edges, glue, paired_half_edges, partners
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


@pytest.mark.parametrize("slots", [1, 8])
@pytest.mark.parametrize("some_turned", [False, True])
def test_partners_have_the_same_ends_however_full_the_table_is(monkeypatch, slots, some_turned):
    monkeypatch.setattr(gluing, "SLOTS", slots)
    edges = np.random.default_rng(0).permutation(topology.half_edges(gallery.three_holes(300).F))
    if some_turned:
        edges[::3] = edges[::3, ::-1]
    glued = partners(*edges.T)
    ends = [frozenset(edge) for edge in edges.tolist()]
    others = {}
    for k, edge in enumerate(ends):
        others.setdefault(edge, []).append(k)
    expected = [
        sum(others[edge]) - k if len(others[edge]) == 2 else -1 for k, edge in enumerate(ends)
    ]
    np.testing.assert_array_equal(glued, expected)


def test_no_edges_have_no_partners():
    none = np.empty(0, dtype=np.int64)
    assert len(partners(none, none)) == 0
