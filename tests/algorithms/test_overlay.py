"""cetm-flips on the common refinement of the mesh and its flipped triangulation."""

import numpy as np
import pytest
from cembench.algorithms.cetm.crossings import Crossings
from cembench.algorithms.cetm.flips import cetm_flips
from cembench.algorithms.cetm.overlay import refined_map

import cembench
from cembench import AlgorithmFailed, DiskMesh, ParameterError
from cembench.conformal.doubling import doubled
from cembench.conformal.metrics import flipped_triangles, is_disk_map
from cembench.mesh.intrinsic import Triangulation
from tests import gallery


def bumpy(rows=8, columns=14, seed=3):
    """A rough, stretched rectangle: many edges are not Delaunay, and more are flipped later."""
    V, F = gallery.flat_rectangle(rows, columns)
    V[:, 0] *= 3
    V[:, 2] = 2 * np.random.default_rng(seed).standard_normal(len(V))
    return DiskMesh.from_arrays(V, F)


def areas(mesh):
    a, b, c = (mesh.V[mesh.F[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def test_paths_are_straight_lines_of_the_plane_after_flat_flips():
    rng = np.random.default_rng(5)
    V, F = gallery.flat_rectangle(6, 7)
    V[:, :2] += rng.uniform(-0.3, 0.3, (len(V), 2)) * (V[:, :2] % 6 > 0) * (V[:, :2] % 7 > 0)
    V[:, 0] *= 4
    mesh = DiskMesh.from_arrays(V, F)
    double = doubled(mesh)
    T = Triangulation.doubled(mesh.F, mesh.V, double.mirror)
    given, paths = (Crossings.none(T.F, T.twin) for _ in range(2))
    T.log = []
    T.make_delaunay(np.zeros(double.size), flat=True)
    paths.flip_all(T.log)
    assert T.flips > 5
    assert T.F.ravel().tolist() == paths.F
    assert paths.twin == T.twin.tolist()
    z = V[:, 0] + 1j * V[:, 1]

    def ends(start, e):
        h = start.first_half_edge[e]
        return start.F[h], start.F[h - h % 3 + (h % 3 + 1) % 3]

    def cross(a, b, c, d):
        turned = [
            np.imag(np.conj(q - p) * (x - p)) for p, q in ((a, b), (c, d)) for x in (a, b, c, d)
        ]
        return turned[2] * turned[3] < -1e-12 and turned[4] * turned[5] < -1e-12

    flipped = {e: pair for e in range(len(paths.on_edge)) if max(pair := ends(paths, e)) < mesh.n}
    for g in range(len(given.on_edge)):
        p, q = ends(given, g)
        if max(p, q) < mesh.n:
            crossed = {e for e, (a, b) in flipped.items() if cross(*z[[p, q, a, b]])}
            assert {paths.edge_of[x] for x in paths.path(g)} & set(flipped) == crossed


@pytest.mark.parametrize("seed", range(3))
def test_the_refinement_is_the_same_surface_and_has_no_folds(seed):
    mesh = bumpy(seed=seed)
    result = refined_map(mesh, repair=False)
    fine = DiskMesh.from_arrays(result.mesh.V, result.mesh.F)
    assert result.extras["flips"] > 20
    assert fine.m > mesh.m
    assert np.bincount(result.triangle, areas(fine)) == pytest.approx(areas(mesh))
    assert not flipped_triangles(fine, result.uv)
    assert is_disk_map(fine, result.uv)


def test_its_given_vertices_are_where_cetm_flips_puts_them():
    mesh = bumpy()
    own = cetm_flips(mesh, repair=False)
    result = refined_map(mesh, repair=False)
    np.testing.assert_allclose(result.uv[: mesh.n], own.uv, atol=1e-14)


def test_parameterize_returns_and_writes_the_refined_surface(tmp_path):
    mesh = bumpy()
    result = cembench.parameterize(mesh, "cetm-flips", overlay=True)
    assert result.ok
    assert result.mesh.n == len(result.z) > mesh.n
    assert result.metrics["flipped_triangles"] == 0
    again = cembench.read_mesh(result.save(tmp_path / "fine.obj"))
    assert again.m == result.mesh.m


def test_edges_that_cross_too_often_end_the_refinement(monkeypatch):
    """Where a surface winds, the edges of both triangulations cross without a useful limit."""
    monkeypatch.setattr("cembench.algorithms.cetm.crossings.MOST", 3)
    monkeypatch.setattr("cembench.algorithms.cetm.crossings.MAX_OF_AN_EDGE", 0)
    with pytest.raises(AlgorithmFailed, match="cross the flipped ones more than 3 times"):
        refined_map(bumpy())


def test_others_have_no_overlay():
    with pytest.raises(
        ParameterError, match=r"direct-cem has no `overlay`.*use algorithm='cetm-flips'"
    ):
        cembench.parameterize(bumpy(), "direct-cem", overlay=True)
