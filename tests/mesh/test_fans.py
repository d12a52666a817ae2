"""Vertices of several fans, against libigl's general test."""

import igl
import numpy as np
import pytest

import cembench
from cembench.mesh.gluing import vertices_of_several_fans
from tests import gallery


def several_fans(F, n):
    """The vertices that libigl's test finds, of those that have triangles."""
    manifold = igl.is_vertex_manifold(F)
    return np.setdiff1d(np.unique(F), np.flatnonzero(manifold))


@pytest.mark.parametrize(
    "make", [gallery.torus, gallery.tube, gallery.tetrahedron, gallery.bow_tie]
)
def test_small_surfaces(make):
    V, F = make()
    np.testing.assert_array_equal(vertices_of_several_fans(F, len(V)), several_fans(F, len(V)))


def test_vertices_without_triangles_have_none():
    assert len(vertices_of_several_fans(np.array([[1, 4, 2]]), 6)) == 0


@pytest.mark.parametrize("seed", range(8))
def test_vertices_merged_at_random(seed):
    """Merged interior vertices make closed fans touch; merged boundary vertices, open ones."""
    rng = np.random.default_rng(seed)
    mesh = (
        cembench.surface("flat-disk", 600) if seed % 2 else cembench.surface("catenoid-ring", 600)
    )
    number = np.arange(mesh.n)
    neighbours = [set(mesh.F[(v == mesh.F).any(axis=1)].ravel()) for v in range(mesh.n)]
    merged = 0
    while merged < 5:
        i, j = rng.choice(mesh.n, 2, replace=False)
        # Without common neighbours, every edge keeps its triangles.
        if number[i] == i and number[j] == j and not neighbours[i] & neighbours[j]:
            number[j] = i
            neighbours[i] |= neighbours[j]
            merged += 1
    F = number[mesh.F]
    pinched = vertices_of_several_fans(F, mesh.n)
    np.testing.assert_array_equal(pinched, several_fans(F, mesh.n))
    assert len(pinched) >= 1


def test_a_fan_of_many_triangles():
    """A cone's tip is turned around once, however many triangles it has."""
    rim = np.arange(1, 2001)
    cone = np.stack([np.zeros_like(rim), rim, np.roll(rim, -1)], axis=1)
    assert len(vertices_of_several_fans(cone, 2001)) == 0
    two = np.concatenate([cone, np.where(cone == 0, 0, cone + 2000)])
    assert vertices_of_several_fans(two, 4001).tolist() == [0]
