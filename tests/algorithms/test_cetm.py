import numpy as np
import pytest
from cembench.algorithms.cetm.disk import cetm
from cembench.algorithms.cetm.free import cetm_free
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.spherical_cap import spherical_cap

from cembench import AlgorithmFailed, DiskMesh
from cembench.conformal.discrete_metric import BlockPattern, angles, scaled
from cembench.conformal.laplacian import laplacian_of_weights
from cembench.conformal.metrics import all_metrics, corner_angles
from cembench.linear_algebra import cholesky
from cembench.mesh.files import read_mesh
from cembench.mesh.side_lengths import side_lengths
from tests import gallery
from tests.hard_surfaces import hard_surface
from tests.real_meshes import real_mesh

MAPS = (cetm, cetm_free)


def cross_ratio(z, i, j, k, m):
    return abs((z[i] - z[k]) * (z[j] - z[m]) / ((z[k] - z[j]) * (z[m] - z[i])))


@pytest.mark.parametrize("f", MAPS)
def test_length_cross_ratios_are_those_of_the_surface(f):
    """Edge by edge, from the points alone."""
    mesh = gallery.uneven()
    result = f(mesh)
    assert result.extras["curvature"] < 1e-10
    assert result.extras["fold_repairs"] == 0
    opposite = {}
    for a, b, c in mesh.F.tolist():
        opposite |= {(a, b): c, (b, c): a, (c, a): b}
    V = mesh.V
    edges = [(i, j) for i, j in opposite if i < j and (j, i) in opposite]
    assert len(edges) == mesh.m + mesh.n - 1 - len(mesh.boundary)
    for i, j in edges:
        k, m = opposite[i, j], opposite[j, i]
        on_surface = np.linalg.norm(V[i] - V[k]) * np.linalg.norm(V[j] - V[m])
        on_surface /= np.linalg.norm(V[k] - V[j]) * np.linalg.norm(V[m] - V[i])
        assert cross_ratio(result.uv, i, j, k, m) == pytest.approx(on_surface, rel=1e-8)


@pytest.mark.parametrize("name", ["nefertiti.obj", "canonical_face.obj", "spothead.obj"])
@pytest.mark.parametrize("f", MAPS)
def test_real_surfaces_take_few_factorisations_of_one_pattern(f, name, monkeypatch):
    mesh = read_mesh(real_mesh(name))
    analysed = []
    kept = cholesky._factor
    monkeypatch.setattr(cholesky, "_factor", lambda *a: analysed.append(1) or kept(*a))
    result = f(mesh)
    assert len(analysed) == 1
    assert result.extras["factorisations"] <= 15
    assert result.extras["curvature"] < 1e-10
    assert result.extras["cross_ratios"] < 1e-8


def test_the_free_boundary_keeps_its_lengths_and_a_flat_surface_its_shape():
    mesh = gallery.uneven()
    z = cetm_free(mesh).uv[mesh.boundary]
    loop = mesh.V[mesh.boundary]
    stretch = np.abs(np.roll(z, -1) - z) / np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1)
    assert np.ptp(stretch) < 1e-9 * stretch.mean()
    flat = flat_disk(300, stretch=2.0)
    assert all_metrics(flat, cetm_free(flat).uv)["angle_error_mean_deg"] < 1e-6


def test_angles_from_lengths():
    mesh = gallery.uneven()
    found, broken = angles(side_lengths(mesh.V, mesh.F))
    assert not broken.any()
    assert abs(np.rad2deg(found) - corner_angles(mesh.V, mesh.F)).max() < 1e-9
    found, broken = angles(np.array([[1.0, 1.0, 3.0], [1.0, 1.0, 1.0]]))
    assert broken.tolist() == [True, False]
    assert found[0].tolist() == [0.0, 0.0, np.pi]


def test_a_block_has_the_same_pattern_whatever_the_weights():
    mesh = spherical_cap(200)
    kept = np.ones(mesh.n, dtype=bool)
    kept[mesh.boundary] = False
    pattern = BlockPattern(mesh.F, kept)
    rng = np.random.default_rng(0)
    weights = rng.uniform(0.1, 1, mesh.F.shape)
    expected = laplacian_of_weights(mesh.F, weights, mesh.n)[kept][:, kept]
    assert abs(pattern.block(weights) - expected).max() < 1e-12
    assert pattern.block(0 * weights).nnz == expected.nnz
    f = rng.standard_normal(mesh.n) + 0j
    A, right = pattern.dirichlet(weights, ~kept, f)
    held = laplacian_of_weights(mesh.F, weights, mesh.n)[kept][:, ~kept] @ f[~kept]
    assert abs(A - expected).max() < 1e-12
    assert abs(right + held).max() < 1e-12


def test_newton_s_hessian_is_the_derivative_of_the_angles():
    mesh = spherical_cap(60)
    lengths = side_lengths(mesh.V, mesh.F)
    L = laplacian_of_weights(mesh.F, 0.5 / np.tan(angles(lengths)[0]), mesh.n)
    step = 1e-6 * np.random.default_rng(1).standard_normal(mesh.n)
    there = angles(scaled(lengths, mesh.F, step))[0] - angles(scaled(lengths, mesh.F, -step))[0]
    change = np.bincount(mesh.F.ravel(), there.ravel(), mesh.n)
    assert abs(change + 2 * (L @ step)).max() < 1e-11


def test_chords_are_refused_with_the_remedy():
    strip = DiskMesh.from_arrays(*gallery.flat_rectangle(1, 6))
    with pytest.raises(AlgorithmFailed, match=r"edges inside join boundary vertices.*cetm-flips"):
        cetm(strip)


def test_a_broken_triangle_is_a_failure_with_its_count():
    with pytest.raises(AlgorithmFailed, match=r"1 of 1350 triangles cannot keep the triangle"):
        cetm_free(hard_surface(0))
