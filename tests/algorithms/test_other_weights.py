import numpy as np
import pytest
from cembench.algorithms import mean_value as mean_value_module
from cembench.algorithms.harmonic_tutte import harmonic_tutte
from cembench.algorithms.mean_value import mean_value
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from scipy import sparse

from cembench import AlgorithmFailed, DiskMesh
from cembench.conformal.harmonic import arc_length_circle
from cembench.conformal.metrics import all_metrics
from cembench.mesh.topology import vertex_graph
from tests import gallery
from tests.hard_surfaces import hard_surface


def test_tutte_puts_every_vertex_in_the_middle_of_its_neighbours():
    mesh = hemi_ellipsoid(600)
    z = harmonic_tutte(mesh).uv
    graph = vertex_graph(mesh.F, mesh.n).astype(bool).astype(float)
    mean = (graph @ z) / graph.sum(axis=1)
    assert abs(mean - z)[mesh.interior].max() < 1e-12


def test_mean_values_give_a_flat_disk_as_it_is():
    """They are linearly precise: with its own circle as the boundary, nothing moves."""
    mesh = flat_disk(600)
    z = mean_value(mesh).uv
    turn = arc_length_circle(mesh)[0] / (mesh.V[mesh.boundary[0]] @ [1, 1j, 0])
    assert abs(z - turn * (mesh.V @ [1, 1j, 0])).max() < 1e-12


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("f", [harmonic_tutte, mean_value])
def test_positive_weights_do_not_fold(f, seed):
    mesh = hard_surface(seed)
    result = f(mesh)
    if result.extras["fold_repairs"]:  # only triangles with all corners on the boundary do
        on = np.isin(mesh.F, mesh.boundary).all(axis=1)
        assert result.extras["before_repair"]["flipped_triangles"] <= on.sum()
    else:
        assert all_metrics(mesh, result.uv)["flipped_triangles"] == 0


@pytest.mark.parametrize("height", [1e-1, 1e-8, 1e-12])
def test_mean_values_take_angles_near_180_degrees(height):
    """1 + cos a is lost to rounding there: the weights were infinite."""
    V, F = gallery.flat_rectangle(4, 4)
    V = np.array(V, dtype=float)
    face = F[12]
    V[face[2]] = (V[face[0]] + V[face[1]]) / 2
    V[face[2], 2] += height
    mesh = DiskMesh.from_arrays(V, F)
    half = np.arctan(1 / (2 * height))  # of the angle at the corner that is nearly flat
    weights = mean_value_module.mean_value_weights(mesh.V, mesh.F)[face[2]].data
    assert np.isfinite(weights).all()
    assert weights.max() > np.tan(half)
    assert np.isfinite(mean_value(mesh).uv).all()


def test_a_matrix_that_cannot_be_factored_is_told(monkeypatch):
    mesh = flat_disk(100)
    none = sparse.csr_array((mesh.n, mesh.n))
    monkeypatch.setattr(mean_value_module, "mean_value_weights", lambda *_: none)
    with pytest.raises(AlgorithmFailed, match="too thin"):
        mean_value(mesh)
