from dataclasses import replace

import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import AlgorithmFailed, HoledMesh
from cembench.conformal import boundary_energy
from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.boundary_energy import (
    EnergyModel,
    in_gauge,
    minimise,
    moebius_descent,
)
from cembench.conformal.circle_domain import BoundaryLoops, CircleDomain
from cembench.conformal.laplacian import laplacian
from cembench.conformal.metrics import all_metrics
from cembench.conformal.trust_region import newton_step
from tests import gallery


@pytest.fixture(scope="module")
def ring():
    """A surface with one hole, its boundary energy, and a domain that is far from the best."""
    V, F = gallery.tube()
    mesh = HoledMesh.from_arrays(V + 0.05 * np.random.default_rng(7).standard_normal(V.shape), F)
    loops = mesh.loops
    bordered = BorderedLaplacian(mesh, laplacian(mesh), loops)
    rng = np.random.default_rng(3)
    sizes = tuple(len(loop) for loop in loops)
    arcs = np.concatenate([a / a.sum() * 2 * np.pi for a in (rng.random(k) + 0.5 for k in sizes)])
    centres, radii = np.array([0, 0.1 + 0.2j]), np.array([1, 0.3])
    domain = CircleDomain(BoundaryLoops(sizes), arcs, rng.random(2), centres, radii, 0.1 * arcs)
    weights = np.where(domain.rims.loop == 0, 1 / sizes[0], 0)
    return mesh, bordered, bordered.dirichlet_to_neumann(), domain, weights


def test_the_energy_is_that_of_the_harmonic_map(ring):
    mesh, bordered, S, domain, weights = ring
    uv = bordered.harmonic_extension(domain.points)
    energy = EnergyModel(S, domain, weights).energy
    assert energy == pytest.approx(all_metrics(mesh, uv)["conformal_energy"], rel=1e-12)


def test_gradient_and_hessian_are_the_derivatives_along_a_step(ring):
    _, _, S, domain, weights = ring
    model = EnergyModel(S, domain, weights)
    x = np.random.default_rng(4).standard_normal(len(model.gradient))
    # Along straight lines in angles, radii and centres, which `moved` follows to first order only.
    B = len(domain.arcs)

    def energy(t):
        theta = np.angle(domain.directions) + t * x[:B] / domain.radius
        growth, shift = np.array([0, x[B]]), np.array([0, x[B + 1] + 1j * x[B + 2]])
        z = (domain.centres + t * shift)[domain.rims.loop]
        z = z + (domain.radii + t * growth)[domain.rims.loop] * np.exp(1j * theta)
        return 0.5 * np.vdot(z, model.residual_of(z)).real

    h = 1e-4
    first = (energy(h) - energy(-h)) / (2 * h)
    second = (energy(h) - 2 * energy(0) + energy(-h)) / h**2
    assert x @ model.gradient == pytest.approx(first, rel=1e-5)
    assert x @ model.hessian(x) == pytest.approx(second, rel=1e-4)


def test_the_hessian_and_the_preconditioner_are_symmetric(ring):
    _, _, S, domain, weights = ring
    model = EnergyModel(S, in_gauge(domain, weights), weights)
    rng = np.random.default_rng(5)
    x, y = rng.standard_normal((2, len(model.gradient)))
    assert x @ model.hessian(y) == pytest.approx(y @ model.hessian(x))
    assert x @ model.precondition(y) == pytest.approx(y @ model.precondition(x))
    assert x @ model.precondition(x) > 0


def test_steps_keep_the_gauge(ring):
    _, _, S, domain, weights = ring
    start = in_gauge(domain, weights)
    model = EnergyModel(S, start, weights)
    step = model.precondition(-model.gradient)
    moved = model.moved(1e-6 * step).points
    assert abs(weights @ moved) < 1e-9
    assert abs(weights @ model.moved(1e-6 * model.gradient).points) > 1e-8


def test_energy_falls_at_every_step_down_to_a_stationary_point(ring):
    _, _, S, domain, weights = ring
    result = minimise(S, domain, weights, tolerance=1e-14, max_iterations=50)
    assert (np.diff(result.energies) < 0).all()
    assert result.reason == "gradient"
    assert result.gradient**2 <= 2e-14 * result.energies[-1]
    rng = np.random.default_rng(6)
    for _ in range(10):  # nowhere near is it lower
        model = EnergyModel(S, result.model.domain, weights)
        x = model.precondition(rng.standard_normal(len(model.gradient)))
        near = in_gauge(model.moved(1e-3 * x / np.linalg.norm(x)), weights)
        assert EnergyModel(S, near, weights).energy > result.energies[-1]


def test_arcs_at_their_least_length_do_not_become_shorter(ring):
    _, _, S, domain, weights = ring
    start = in_gauge(domain, weights)
    every_third = np.arange(len(start.arcs)) % 3 == 0
    stuck = replace(start, least=np.where(every_third, start.arcs, 0.1 * start.arcs))
    model = EnergyModel(S, stuck, weights)
    assert 0 < len(model.held) < every_third.sum()
    # Of those that are not held, none becomes shorter.
    change = EnergyModel(S, stuck, weights).moved(-1e-6 * model.uphill).arcs - start.arcs
    assert change[every_third].min() > -1e-12
    step = model.precondition(-model.gradient)
    free = replace(start, least=0.1 * start.arcs)
    change = EnergyModel(S, free, weights).moved(1e-6 * step).arcs - free.arcs
    assert abs(change[model.held]).max() < 1e-10 < abs(change).max()


def test_with_too_many_arcs_at_their_least_length_it_stops(ring, monkeypatch):
    _, _, S, domain, weights = ring
    monkeypatch.setattr(boundary_energy, "MAX_HELD", 0)
    stuck = replace(in_gauge(domain, weights), least=0.999 * in_gauge(domain, weights).arcs)
    result = minimise(S, stuck, weights, tolerance=1e-7, max_iterations=50)
    assert result.reason == "crowded"
    assert np.isnan(result.gradient)
    assert result.held_arcs > 0


def test_a_limit_on_iterations_is_kept_and_told(ring):
    _, _, S, domain, weights = ring
    result = minimise(S, domain, weights, tolerance=1e-12, max_iterations=1)
    assert result.reason == "iterations"
    assert len(result.energies) == 2


def test_every_moebius_image_has_the_same_one_in_the_gauge(ring):
    *_, domain, weights = ring
    expected = in_gauge(domain, weights)
    other = in_gauge(domain.through(0.4 - 0.5j), weights)
    np.testing.assert_allclose(np.sort(other.arcs), np.sort(expected.arcs), rtol=1e-9)
    assert other.radii == pytest.approx(expected.radii)


def test_a_leash_lets_the_energy_fall_as_far_as_anywhere_within_it():
    mesh = hemi_ellipsoid(600, x=2.0)
    bordered = BorderedLaplacian(mesh, laplacian(mesh), (mesh.boundary,))
    S, k = bordered.dirichlet_to_neumann(), len(mesh.boundary)
    here = CircleDomain.of_arcs(np.random.default_rng(0).random(k) + 0.5)

    def energy(domain):
        return EnergyModel(S, domain, np.ones(k) / k).energy

    model = EnergyModel(S, here, np.ones(k) / k)
    for max_modulus in (0.001, 0.03):
        images = [here.through(max_modulus * np.exp(1j * t * np.pi / 18)) for t in range(36)]
        lowest = min(energy(image) for image in images)
        gain = energy(here) - energy(here.through(moebius_descent(model, max_modulus)))
        assert gain > 0
        assert gain == pytest.approx(energy(here) - lowest, rel=0.03)


def test_a_gauge_whose_weight_lies_on_one_vertex_is_refused():
    with pytest.raises(AlgorithmFailed, match="another gauge"):
        in_gauge(CircleDomain.of_arcs(np.ones(5)), np.array([0.9, 0.1, 0, 0, 0]))


def test_a_newton_step_solves_a_convex_model_and_stops_at_the_edge():
    rng = np.random.default_rng(8)
    A = rng.standard_normal((6, 6))
    H, g = A @ A.T + np.eye(6), rng.standard_normal(6)
    whole = newton_step(g, g, lambda p: H @ p, lambda r: r, 1e3, 1e-12)
    np.testing.assert_allclose(whole.p, -np.linalg.solve(H, g), rtol=1e-8)
    short = newton_step(g, g, lambda p: H @ p, lambda r: r, 0.01, 1e-12)
    assert short.at_edge
    assert np.linalg.norm(short.p) == pytest.approx(0.01)
    assert 0 < short.decrease < whole.decrease


def test_a_newton_step_follows_negative_curvature_to_the_edge():
    g = np.array([1.0, 0.1])
    step = newton_step(g, g, lambda p: p * [1, -1], lambda r: r, 2.0, 1e-12)
    assert step.at_edge
    assert np.linalg.norm(step.p) == pytest.approx(2)
    assert step.decrease > 0
