import numpy as np
import pytest
from cembench.algorithms.harmonic_tutte import harmonic_tutte
from cembench.surfaces.flat_disk import flat_disk

from cembench.conformal.harmonic import arc_length_circle, harmonic_extension
from cembench.conformal.laplacian import laplacian
from cembench.conformal.planar import folded_triangles
from cembench.conformal.untangling import _Patches, untangled
from cembench.mesh.topology import vertex_graph
from tests import gallery


def as_complex(x):
    return x[: len(x) // 2] + 1j * x[len(x) // 2 :]


@pytest.fixture
def patches():
    mesh = gallery.crumpled_disk()
    z = harmonic_extension(laplacian(mesh), mesh.boundary, arc_length_circle(mesh))
    free = np.zeros(mesh.n, dtype=bool)
    free[mesh.F[folded_triangles(z, mesh.F)]] = True
    free[mesh.boundary] = False
    return _Patches(mesh, z, free, vertex_graph(mesh.F, mesh.n)), z


def test_the_slope_is_the_energys_derivative_along_the_step(patches):
    patches, z = patches
    moving, eps = z[patches.vertices], np.full(patches.count, 0.1)
    step, slope = patches.newton_step(moving, eps)
    assert (slope < 0).all()
    h = 1e-6
    above, below = (patches._energy(moving + t * step, eps) for t in (h, -h))
    np.testing.assert_allclose((above - below) / (2 * h), slope, rtol=1e-5)


def test_a_random_map_of_a_flat_disk_is_untangled_to_nearly_the_identity():
    mesh = flat_disk(150)
    identity = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    free = np.ones(mesh.n, dtype=bool)
    free[mesh.boundary] = False
    rng = np.random.default_rng(0)
    z = np.where(free, 0.3 * as_complex(rng.standard_normal(2 * mesh.n)), identity)
    assert len(folded_triangles(z, mesh.F)) > 30
    found, patch = untangled(mesh, z, free, vertex_graph(mesh.F, mesh.n))
    assert not len(folded_triangles(found, mesh.F))
    np.testing.assert_array_equal(found[mesh.boundary], identity[mesh.boundary])
    assert set(patch) <= {-1, 0}
    assert abs(found - identity).mean() < 0.1


def test_patches_do_not_see_each_other():
    mesh = flat_disk(600)
    identity = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    graph = vertex_graph(mesh.F, mesh.n)
    a, b = (np.argmin(abs(identity - c)) for c in (0.5, -0.5))
    z = identity.copy()
    z[a] += 0.3
    z[b] -= 0.3
    free = np.zeros(mesh.n, dtype=bool)
    free[a] = True
    alone, _ = untangled(mesh, z, free, graph)
    free[b] = True
    both, patch = untangled(mesh, z, free, graph)
    assert patch.max() == 1
    assert abs(both[a] - identity[a]) < 0.02
    assert both[a] == pytest.approx(alone[a], abs=0.01)
    np.testing.assert_array_equal(np.delete(both, [a, b]), np.delete(identity, [a, b]))


def test_from_a_map_without_folds_no_step_folds_and_the_energy_falls():
    mesh = gallery.crumpled_disk()
    z = harmonic_tutte(mesh).uv
    assert not len(folded_triangles(z, mesh.F))
    free = np.ones(mesh.n, dtype=bool)
    free[mesh.boundary] = False
    graph, L = vertex_graph(mesh.F, mesh.n), laplacian(mesh)
    for steps in (1, 8):
        lower, _ = untangled(mesh, z, free, graph, steps, first=0.0)
        assert not len(folded_triangles(lower, mesh.F))
        assert np.vdot(lower, L @ lower).real < np.vdot(z, L @ z).real
