"""Direct CEM with the interior factored alone ends where it ends with the boundary last."""

import numpy as np
import pytest
from cembench.algorithms.direct_cem import disk
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.spherical_cap import spherical_cap

from cembench import DiskMesh
from cembench.conformal import quasi_newton
from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.boundary_modes import InverseByModes, estimated_energy
from cembench.conformal.filled_start import arcs_of_measure
from cembench.conformal.gauge import gauge_measure
from cembench.conformal.harmonic import edge_lengths
from cembench.conformal.interior_laplacian import InteriorLaplacian, solves_pay
from cembench.conformal.laplacian import laplacian
from cembench.conformal.metrics import flipped_triangles
from cembench.linear_algebra import orderings
from cembench.linear_algebra.cholesky import Among, Cholesky, linear_algebra
from cembench.linear_algebra.work import counting
from cembench.mesh.files import read_mesh
from tests import gallery
from tests.real_meshes import real_mesh

#: E_C grows along the way back to (1 + .01) of the least. Seen from there, a minimum that is short
#: of the least by the share 1e-6 differs by up to 2 (.01 1e-6)^(1/2).
AFTER_WAY_BACK = 2e-4

USUAL = disk.SURELY_MORE

SURFACES = {
    "half ellipsoid": lambda: gallery.uneven(3000),
    "rectangle": lambda: DiskMesh.from_arrays(*gallery.flat_rectangle(30, 60)),
    "lion": lambda: read_mesh(real_mesh("chinese_lion.obj")),
    "human face": lambda: read_mesh(real_mesh("human_face.obj")),
}


@pytest.fixture
def way(monkeypatch):
    """Map by solves or by the factor with the boundary last, whatever the estimates say."""
    taken = []
    inside = quasi_newton.quasi_newton_minimum

    def minimum(*arguments, **options):
        minimum = inside(*arguments, **options)
        taken.append(minimum is not None)
        return minimum

    def call(mesh, solves, surely_more=0, **options):
        taken.clear()
        monkeypatch.setattr(disk, "SURELY_MORE", surely_more)
        monkeypatch.setattr(disk, "solves_pay", lambda *_: solves)
        monkeypatch.setattr(disk, "quasi_newton_minimum", minimum)
        return direct_cem(mesh, **options), taken == [True]

    return call


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("options", [{}, {"back": 0, "delaunay": False}], ids=str)
def test_energy_and_folds_are_those_of_the_other_way(way, surface, options):
    mesh = SURFACES[surface]()
    (usual, _), (other, taken) = (way(mesh, solves, **options) for solves in (False, True))
    assert taken
    assert usual.extras["start"] == "harmonic measure"
    assert min(other.energy_history) == pytest.approx(min(usual.energy_history), rel=1e-6)
    assert other.energy_history[-1] == pytest.approx(usual.energy_history[-1], rel=AFTER_WAY_BACK)
    assert flipped_triangles(mesh, other.uv) == flipped_triangles(mesh, usual.uv)
    turn = np.exp(1j * np.angle(np.vdot(other.uv, usual.uv)))
    assert abs(turn * other.uv - usual.uv).max() < 1e-3


@pytest.mark.parametrize("gauge", ["triangle", "area"])
def test_every_gauge_is_kept(way, gauge):
    mesh = gallery.uneven(3000)
    (usual, _), (other, taken) = (way(mesh, solves, gauge=gauge) for solves in (False, True))
    assert taken
    assert min(other.energy_history) == pytest.approx(min(usual.energy_history), rel=1e-6)
    assert other.energy_history[-1] == pytest.approx(usual.energy_history[-1], rel=AFTER_WAY_BACK)


def test_one_sparse_factorisation_and_a_solve_a_step(way, count_calls):
    mesh, solves = gallery.uneven(3000), count_calls(InteriorLaplacian, "harmonic_near")
    ends = count_calls(Cholesky, "schur_factor")
    with counting() as work:
        found, taken = way(mesh, True, back=0)
    assert taken
    assert not ends
    assert work.order == len(mesh.interior)
    assert work.numeric == 2  # and L_bb
    assert len(solves) == found.iterations + 1  # the start and the steps


@pytest.mark.parametrize(
    ("interior", "boundary", "pays"),
    [
        (550_053, 2_976, True),
        (2_203_200, 5_952, True),
        (1_100_000, 1_960, True),
        (137_142, 1_488, True),
        (274_879, 980, False),
        (1_000, 500, False),  # whatever the estimate says
        (10_000_000, 2_100, False),
        (0, 3_000, False),
    ],
)
def test_it_pays_where_the_boundary_is_long_for_the_surface(interior, boundary, pays):
    assert solves_pay(interior, boundary) is pays


def test_it_never_pays_where_each_solve_is_a_factorisation():
    with linear_algebra("backslash"):
        assert not solves_pay(550_053, 2_976)


def test_the_estimate_is_monotonic():
    longer = [solves_pay(1_000_000, b) for b in range(100, 20_000, 100)]
    assert longer == sorted(longer)
    grown = [solves_pay(2**k, 4_000) for k in range(10, 26)]
    assert grown == sorted(grown, reverse=True)
    assert {*grown} == {*longer} == {False, True}


@pytest.mark.parametrize(
    ("name", "value"),
    [("MAX_STEPS", 0), ("MIN_AGREEMENT", 1e6)],
    ids=["too many steps", "steps that lower the energy less than predicted"],
)
def test_what_it_gives_up_is_mapped_the_usual_way_to_the_bit(way, monkeypatch, name, value):
    mesh = gallery.uneven(3000)
    usual, _ = way(mesh, False)
    monkeypatch.setattr(quasi_newton, name, value)
    other, taken = way(mesh, True)
    assert not taken
    np.testing.assert_array_equal(other.uv, usual.uv)
    assert other.extras == usual.extras


def test_arc_length_is_compared_where_it_may_be_the_better_start_without_another_factor(way):
    mesh = spherical_cap(4000)
    usual, _ = way(mesh, False)
    assert usual.extras["start"] == "arc length"
    with counting() as work:
        other, taken = way(mesh, True, surely_more=USUAL)
    assert taken
    assert work.order == len(mesh.interior)
    assert work.numeric == 2  # and L_bb
    assert other.extras["start"] == "arc length"
    assert other.energy_history[-1] == pytest.approx(usual.energy_history[-1], rel=AFTER_WAY_BACK)
    assert abs(other.uv - usual.uv).max() < 1e-5


def test_a_boundary_crowded_far_below_rounding_is_mapped_all_the_same(way):
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle(4, 60))
    (usual, _), (other, _) = (way(mesh, solves, surely_more=USUAL) for solves in (False, True))
    assert other.energy_history[-1] == pytest.approx(usual.energy_history[-1], rel=AFTER_WAY_BACK)
    assert flipped_triangles(mesh, other.uv) == flipped_triangles(mesh, usual.uv)


def parts(mesh, measure=None):
    L = laplacian(mesh, delaunay=True)
    bordered = BorderedLaplacian(mesh, L, (mesh.boundary,))
    middle = gauge_measure(mesh, "triangle", mesh.boundary)[:, None]
    seen = bordered.swept_to_boundary(middle)[:, 0]
    arcs = arcs_of_measure(seen, edge_lengths(mesh, mesh.boundary))
    measure = middle if measure is None else measure
    interior = InteriorLaplacian(mesh, L, mesh.boundary, measure)
    return bordered, interior, 2 * np.pi * arcs / arcs.sum()


def test_products_measure_and_maps_are_those_of_the_factor_with_the_boundary_last():
    mesh = gallery.uneven(1500)
    measure = np.random.default_rng(0).random((mesh.n, 3))
    measure[mesh.interior, 1] = 0
    measure[mesh.interior[3:], 2] = 0
    measure /= measure.sum(axis=0)
    bordered, interior, arcs = parts(mesh, measure)
    z = np.exp(1j * np.cumsum(arcs))
    S = interior.dirichlet_to_neumann(arcs)
    np.testing.assert_allclose(S(z), bordered.dirichlet_to_neumann()(z), atol=1e-11)
    swept = bordered.swept_to_boundary(measure)
    np.testing.assert_allclose(interior.swept, swept, atol=1e-12)
    np.testing.assert_array_equal(interior.swept[:, 1], measure[mesh.boundary, 1])
    expected = bordered.harmonic_extension(z)
    np.testing.assert_allclose(interior.harmonic_extension(z), expected, atol=1e-11)


def test_a_turned_boundary_takes_no_solve(count_calls):
    mesh = gallery.uneven(600)
    _, interior, arcs = parts(mesh)
    z = np.exp(1j * np.cumsum(arcs))
    first = interior.harmonic_near(z)
    solves = count_calls(Among, "solve")
    np.testing.assert_allclose(interior.harmonic_near(1j * z), 1j * first, atol=1e-12)
    assert not solves
    interior.harmonic_near(z**2)
    assert len(solves) == 1


@pytest.mark.parametrize("surface", SURFACES)
def test_the_inverse_by_modes_is_symmetric_and_near_that_of_S(surface):
    bordered, interior, arcs = parts(SURFACES[surface]())
    B = len(arcs)
    near = InverseByModes(arcs, interior.L_bb)
    free = np.eye(B) - 1 / B
    M = free @ near(free)
    np.testing.assert_allclose(M, M.T, atol=1e-9 * abs(M).max())
    # Modes from the third on: EnergyModel adds to the lower ones what is theirs.
    ratios = np.linalg.eigvals(M @ bordered.S).real
    ratios = np.sort(ratios)[1:]  # constants
    assert ratios[0] > 0.2
    assert ratios[-1] < 5


def test_estimated_energy_is_exact_for_modes_on_the_circle():
    arcs = np.full(400, 2 * np.pi / 400)
    theta = np.cumsum(arcs) - arcs
    z = np.exp(1j * theta) + 0.1 * np.exp(-3j * theta)
    assert estimated_energy(z, arcs) == pytest.approx(2 * np.pi * 3 * 0.01, rel=1e-3)
    assert estimated_energy(np.exp(1j * theta), arcs) == pytest.approx(0, abs=1e-12)


def test_where_many_edges_are_flipped_the_rows_are_ordered_by_position(way, monkeypatch):
    mesh, ordered = hemi_ellipsoid(3000, z=6.0), []
    inside = orderings.dissection_by_position
    monkeypatch.setattr(
        orderings, "dissection_by_position", lambda *a, **k: ordered.append(1) or inside(*a, **k)
    )
    maps = []
    for most in (0.0, 1.0):
        monkeypatch.setattr(disk, "MANY_FLIPS", most)
        maps.append(way(mesh, solves=True)[0].uv)
        assert ordered == [1]
    assert np.abs(maps[0] - maps[1]).max() < 1e-9


@pytest.mark.slow
def test_on_a_long_real_boundary_it_is_chosen_and_ends_at_the_same_energy(monkeypatch):
    import igl

    mesh = read_mesh(real_mesh("jacksboro_dem.ply"))
    mesh = DiskMesh.trusted(*igl.upsample(mesh.V, mesh.F))
    assert solves_pay(len(mesh.interior), len(mesh.boundary))
    by_solves = direct_cem(mesh)
    assert by_solves.extras["hessian_products"] == 0
    monkeypatch.setattr(disk, "solves_pay", lambda *_: False)
    usual = direct_cem(mesh)
    assert by_solves.energy_history[-1] == pytest.approx(usual.energy_history[-1], rel=1e-6)
    assert flipped_triangles(mesh, by_solves.uv) == flipped_triangles(mesh, usual.uv)
