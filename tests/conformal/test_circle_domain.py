import numpy as np
import pytest

from cembench.conformal.boundary_energy import in_gauge
from cembench.conformal.circle_domain import BoundaryLoops, CircleDomain
from cembench.conformal.moebius import Moebius


def ring_and_two_holes(seed=0):
    rng = np.random.default_rng(seed)
    sizes = (9, 5, 6)
    arcs = np.concatenate([a / a.sum() * 2 * np.pi for a in (rng.random(k) + 0.1 for k in sizes)])
    centres, radii = np.array([0, 0.4 + 0.1j, -0.3j]), np.array([1.0, 0.2, 0.3])
    return CircleDomain(BoundaryLoops(sizes), arcs, rng.random(3), centres, radii, 0.1 * arcs)


def order_of(domain):
    """The arcs from vertex to vertex, measured on the points themselves."""
    turned = (domain.points - domain.centres[domain.rims.loop]) / domain.radius
    return np.angle(turned[domain.rims.following] / turned) * domain.rims.sense % (2 * np.pi)


def test_points_lie_on_their_circles_in_order_outer_loop_left_holes_right():
    domain = ring_and_two_holes()
    off = np.abs(domain.points - domain.centres[domain.rims.loop]) - domain.radius
    assert abs(off).max() < 1e-15
    np.testing.assert_allclose(order_of(domain), domain.arcs, atol=1e-13)


@pytest.mark.parametrize("a", [0.0, 0.3, -0.5 + 0.6j, 0.99])
def test_a_moebius_map_moves_every_point_as_its_formula_says(a):
    domain = ring_and_two_holes()
    image = domain.through(a)
    z = domain.points
    np.testing.assert_allclose(image.points, (z - a) / (1 - np.conj(a) * z), atol=1e-12)
    np.testing.assert_allclose(image.rims.sums(image.arcs), 2 * np.pi)


def test_arcs_far_below_rounding_stay_exact_under_a_moebius_map():
    arcs = np.array([1.0, 1e-14, 3e-14, 2.0, 3.0])
    domain = CircleDomain.of_arcs(arcs)
    image = domain.through(0.7).arcs
    np.testing.assert_allclose(image[2] / image[1], 3, rtol=1e-10)


def test_settled_arcs_have_the_other_ones_proportions_where_they_crowd_and_keep_their_sum():
    start = CircleDomain.of_arcs(np.array([2.105, 1e-9, 3e-9, 2e-9, 2.0, 1.895]))
    domain = CircleDomain.of_arcs(np.array([2.105, 5e-9, 1e-9, 1e-12, 2.5, 1.395]))
    found = domain.settled(start).arcs
    np.testing.assert_allclose(found[2:4] / found[1], [3, 2])
    np.testing.assert_allclose(found[[0, 5]], domain.arcs[[0, 5]])
    assert found.sum() == pytest.approx(2 * np.pi)
    even = CircleDomain.of_arcs(np.ones(6))
    assert even.settled(even) is even


def test_of_too_many_shortest_arcs_those_too_short_to_count_are_left_out():
    domain = CircleDomain.of_arcs(np.array([2.0, 1e-9, 1.0, 2.0]))
    there = domain.moved(np.array([0.0, 0.0, 2.0, -2.0]), np.zeros(1), np.zeros(1, complex))
    shrunk = CircleDomain(
        there.rims, there.least, there.turns, there.centres, there.radii, there.least
    )
    assert shrunk.shortest(4).tolist() == [0, 1, 2, 3]
    assert shrunk.shortest(3).tolist() == [0, 2, 3]


@pytest.mark.parametrize("k", [1, 2])
def test_turned_inside_out_a_hole_is_outside_and_back_again_all_is_as_it_was(k):
    domain = ring_and_two_holes()
    other = domain.inside_out(k)
    z = domain.points
    expected = Moebius(0, domain.radii[k], 1, -domain.centres[k])(z)
    np.testing.assert_allclose(other.points, expected, atol=1e-12)
    assert other.apart
    assert abs(abs(other.points[domain.rims.loop == k]) - 1).max() < 1e-14
    np.testing.assert_allclose(order_of(other), other.arcs, atol=1e-12)
    weights = np.where(domain.rims.loop == 0, 1 / domain.rims.sizes[0], 0.0)
    back = in_gauge(other.inside_out(0), weights)
    np.testing.assert_allclose(back.arcs, in_gauge(domain, weights).arcs, atol=1e-10)


def test_no_step_however_long_lets_vertices_change_places():
    domain = ring_and_two_holes()
    rng = np.random.default_rng(1)
    for size in (0.1, 10, 1e6):
        there = domain.moved(size * rng.standard_normal(20), np.zeros(3), np.zeros(3, complex))
        assert (order_of(there) > 0).all()
        assert (there.arcs >= domain.least * (1 - 1e-12)).all()
        np.testing.assert_allclose(there.rims.sums(there.arcs), 2 * np.pi)


def test_a_short_step_moves_points_as_its_derivative_says():
    domain = ring_and_two_holes()
    rng = np.random.default_rng(2)
    along, growth, shift = rng.standard_normal(20), rng.standard_normal(3), rng.standard_normal(3)
    growth[0] = shift[0] = 0
    t = 1e-7
    there = domain.moved(t * along, t * growth, t * shift.astype(complex))
    velocity = domain.directions * (1j * along + growth[domain.rims.loop]) + shift[domain.rims.loop]
    np.testing.assert_allclose((there.points - domain.points) / t, velocity, atol=1e-5)


def test_circles_that_meet_or_leave_the_disk_are_seen():
    domain = ring_and_two_holes()
    still, none = np.zeros(20), np.zeros(3)
    assert domain.apart
    assert not domain.moved(still, none, np.array([0, 0.5, 0])).apart
    assert not domain.moved(still, np.array([0, 0.15, 0.15]), none).apart


def test_circles_that_a_step_makes_meet_shrink_until_they_have_room():
    domain, still = ring_and_two_holes(), np.zeros(20)
    for shift in (np.array([0, 0.15, 0.15]), np.array([0, -0.1, 0.1])):
        there = domain.moved(still, np.array([0, 0.2, 0.2]), shift)
        if not there.apart:
            pulled = there.apart_from(domain)
            assert pulled.apart
            assert (pulled.centres == there.centres).all()
    assert domain.apart_from(domain).radii == pytest.approx(domain.radii)
