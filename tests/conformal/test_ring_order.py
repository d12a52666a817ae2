"""The ring's order gives the map of the other order, and is chosen by counts alone."""

import numpy as np
import pytest
from cembench.algorithms.cem import cem
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench.conformal import bordered
from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.laplacian import laplacian
from cembench.conformal.ring_order import LIKELY_ITERATIONS, ring_pays
from cembench.linear_algebra.cholesky import linear_algebra
from cembench.linear_algebra.work import counting
from cembench.mesh.files import read_mesh
from tests.real_meshes import real_mesh


@pytest.mark.parametrize(
    ("interior", "ring", "boundary", "iterations", "pays"),
    [
        (17_089, 270, 245, 20, True),
        (17_089, 270, 245, 0, False),
        (137_142, 1_482, 1_488, 20, False),
        (550_053, 2_960, 2_976, 20, False),
        (274_879, 980, 980, 20, False),
        (1_100_000, 1_958, 1_960, 20, False),
        (40, 40, 30, 20, False),  # no other interior
    ],
)
def test_it_pays_where_the_boundary_is_short_and_iterations_are_many(
    interior, ring, boundary, iterations, pays
):
    assert ring_pays(interior, ring, boundary, iterations) is pays


def test_the_estimate_is_monotonic():
    sizes = [2**k for k in range(9, 22)]
    grown = [ring_pays(n, 400, 400, 2) for n in sizes]
    assert grown == sorted(grown)
    assert {*grown} == {False, True}
    longer = [ring_pays(100_000, b, b, 2) for b in range(10, 4000, 50)]
    assert longer == sorted(longer, reverse=True)
    many, more = (ring_pays(20_000, 600, 600, LIKELY_ITERATIONS + k) for k in (0, 50))
    assert many == more


@pytest.fixture(params=[True, False], ids=["ring", "no ring"])
def ring(request, monkeypatch):
    monkeypatch.setattr(bordered, "ring_pays", lambda *_: request.param)
    return request.param


SURFACES = {
    "hemi-ellipsoid": lambda: hemi_ellipsoid(1500, x=2.0),
    "spikes": lambda: hemi_ellipsoid(3000, z=6.0),
    "nearly all beside the boundary": lambda: hemi_ellipsoid(40, x=1.3, y=0.8),
    "lion": lambda: read_mesh(real_mesh("chinese_lion.obj")),
}


@pytest.mark.parametrize("surface", SURFACES)
@pytest.mark.parametrize("inversion", [True, False])
def test_the_map_is_that_of_algorithm_1_as_printed(ring, surface, inversion):
    mesh = SURFACES[surface]()
    options = {"inversion": inversion, "max_iterations": 5}
    result = cem(mesh, **options)
    with linear_algebra("backslash"):
        printed = cem(mesh, **options)
    assert abs(result.uv - printed.uv).max() < 1e-11
    assert result.iterations == printed.iterations
    np.testing.assert_allclose(result.energy_history, printed.energy_history, atol=1e-11)


def test_the_iterate_of_least_energy_has_its_own_interior(ring):
    mesh = hemi_ellipsoid(1500, x=3.0)
    best = cem(mesh, best=True, max_iterations=4)
    with linear_algebra("backslash"):
        printed = cem(mesh, best=True, max_iterations=4)
    assert abs(best.uv - printed.uv).max() < 1e-11


def test_less_than_half_a_solve_counts_less_than_half(ring):
    mesh, k = hemi_ellipsoid(1500, x=2.0), 5
    with counting() as work:
        assert cem(mesh, tolerance=0, max_iterations=k).iterations == k
    # Two real columns each: a boundary step each time, half a solve for the interior at the end,
    # and parts of halves: the start, and the boundary's neighbours each time, if not by the ring.
    parts = 1 + (0 if ring else k + 1)
    assert 2 * (k + 0.5) < work.right_hand_sides < 2 * (k + 0.5 + 0.5 * parts)
    assert work.numeric == 2


def test_algorithm_1_as_printed_never_takes_it(ring):
    mesh = hemi_ellipsoid(1500)
    for how in ({"solves": "backslash"}, {"backend": "superlu"}):
        with linear_algebra(**how):
            L = BorderedLaplacian(mesh, laplacian(mesh), (mesh.boundary,), iterations=20)
        assert len(L.beside) == len(L.interior)


def test_backslash_factors_for_every_solve_as_before():
    mesh, k = hemi_ellipsoid(600, x=2.0), 3
    with linear_algebra("backslash"), counting() as work:
        assert cem(mesh, tolerance=0, max_iterations=k).iterations == k
    assert work.numeric == 1 + (k + 1) + k
    assert work.right_hand_sides == 2 * work.numeric


def bordered_laplacian(mesh, iterations):
    return BorderedLaplacian(mesh, laplacian(mesh), (mesh.boundary,), iterations=iterations)


@pytest.mark.parametrize("ring", [True], indirect=True)
@pytest.mark.parametrize(
    ("name", "use"),
    [
        ("solve_interior", lambda it, mesh: it.solve_interior(np.ones(len(mesh.interior)))),
        ("dirichlet_to_neumann", lambda it, mesh: it.dirichlet_to_neumann()),
        ("S", lambda it, mesh: it.S),
        ("swept_to_boundary", lambda it, mesh: it.swept_to_boundary(np.ones((mesh.n, 1)))),
        ("harmonic_extension", lambda it, mesh: it.harmonic_extension(mesh.boundary * 1j)),
    ],
)
def test_what_needs_the_whole_interior_first_is_refused_in_the_ring_order(ring, name, use):
    mesh = hemi_ellipsoid(600)
    with pytest.raises(ValueError, match=f"{name} needs the whole interior.*iterations=0"):
        use(bordered_laplacian(mesh, 5), mesh)
    use(bordered_laplacian(mesh, 0), mesh)
