from fractions import Fraction

import numpy as np
import pytest

from cembench.conformal.planar import (
    backward_arcs,
    bounds_once,
    crossing_polygons,
    fitted_circle,
    folded_triangles,
    orientations,
    overlap_share,
    polygon_area,
    signed_areas,
    turns,
    winding_words,
)


def ring(k=12):
    return np.exp(2j * np.pi * np.arange(k) / k)


def test_area_of_a_polygon_has_a_sign_and_no_origin():
    exact = 6 * np.sin(2 * np.pi / 12)
    assert polygon_area(ring()) == pytest.approx(exact)
    assert polygon_area(ring()[::-1]) == pytest.approx(-exact)
    assert polygon_area(ring() + 1e6) == pytest.approx(exact, rel=1e-9)


def test_signed_areas():
    z = np.array([0, 1, 1j, 1 + 1j])
    np.testing.assert_allclose(signed_areas(z, np.array([[0, 1, 2], [1, 2, 3]])), [0.5, -0.5])


def test_folds_are_judged_by_the_exact_sign_of_the_area():
    rng = np.random.default_rng(0)
    a, b = rng.random((2, 300)) + 1j * rng.random((2, 300))
    z = np.stack(
        [a, b, a + rng.random(300) * (b - a)], axis=1
    ).ravel()  # on a line but for rounding
    F = np.arange(900).reshape(-1, 3)

    def folded(a, b, c):
        (p, q), (r, s) = ((Fraction(w.real), Fraction(w.imag)) for w in (a, b))
        x, y = Fraction(c.real), Fraction(c.imag)
        return (r - p) * (y - q) <= (s - q) * (x - p)

    exact = [t for t in range(300) if folded(*z[F[t]].tolist())]
    np.testing.assert_array_equal(folded_triangles(z, F), exact)
    assert set(exact) != set(np.flatnonzero(~(signed_areas(z, F) > 0)))


def test_an_image_that_is_not_finite_counts_as_folded():
    z = np.array([0, 1, complex("nan"), 1j])
    np.testing.assert_array_equal(folded_triangles(z, np.array([[0, 1, 2], [0, 1, 3]])), [0])


@pytest.mark.parametrize(("centre", "radius"), [(0, 1), (3 - 4j, 1e-6), (1e3, 50.0)])
def test_the_circle_through_points_of_a_circle(centre, radius):
    c, r = fitted_circle(centre + radius * ring(7)[:5])
    assert abs(c - centre) < 1e-9 * max(abs(centre), radius)
    assert r == pytest.approx(radius, rel=1e-6)


def test_points_that_determine_no_circle():
    assert np.isnan(fitted_circle(np.zeros(4, complex))[1])
    assert np.isnan(fitted_circle(np.arange(4) + 0j)[1])


def test_arcs_that_run_backwards():
    z = ring()
    assert backward_arcs(z) == 0
    assert backward_arcs(z[::-1]) == 12
    z[[3, 4]] = z[[4, 3]]
    assert backward_arcs(z) == 1


def square(corner, side=1.0):
    return corner + side * np.array([0, 1, 1 + 1j, 1j])


@pytest.mark.parametrize(
    ("curves", "answer"),
    [
        ([square(0), square(3)], None),
        ([square(0), square(0.25 + 0.25j, 0.5)], None),  # one inside the other
        ([square(0), square(5), square(0.5 + 0.5j)], (0, 2)),
        ([square(0), square(1)], (0, 1)),  # side by side, sharing two corners and a side
        ([np.array([0, 1 + 1j, 1, 1j])], (0, 0)),
    ],
)
def test_polygons_that_cross_are_found(curves, answer):
    assert crossing_polygons(curves) == answer


def test_crossings_agree_with_trying_every_pair():
    rng = np.random.default_rng(5)
    inside = set()
    for _ in range(60):
        curves = [
            complex(*rng.uniform(-2, 2, 2)) + rng.uniform(0.1, 1) * ring(9) * np.exp(1j * turn)
            for turn in rng.uniform(0, 6, 3)
        ]
        expected = any(_polygons_cross(a, b) for k, a in enumerate(curves) for b in curves[:k])
        inside.add(expected)
        assert (crossing_polygons(curves) is not None) == expected
    assert inside == {True, False}


def _polygons_cross(a, b):
    """By solving for the crossing of every pair of sides."""
    for p, q in zip(a, np.roll(a, -1), strict=True):
        for r, s in zip(b, np.roll(b, -1), strict=True):
            u, v = q - p, s - r
            cross = (np.conj(u) * v).imag
            t = (np.conj(r - p) * v).imag / cross
            w = (np.conj(r - p) * u).imag / cross
            if 0 <= t <= 1 and 0 <= w <= 1:
                return True
    return False


def test_a_point_repeated_in_a_row_counts_once_and_a_spike_crosses():
    repeated = np.insert(square(0), 2, square(0)[2])
    assert crossing_polygons([repeated]) is None
    spike = np.array([0, 1, 1 + 1j, 0.5 + 0.5j, 1 + 1j, 1j])
    assert crossing_polygons([spike]) == (0, 0)


def test_a_polygon_with_many_sides_in_every_strip_is_quickly_found_simple():
    inward = np.exp(1j * np.linspace(0, 400, 8000)) * np.linspace(1, 51, 8000)
    spiral = np.concatenate([inward, 1.001 * inward[::-1]])
    assert crossing_polygons([spiral]) is None


def fraction_orientation(a, b, c):
    (ax, ay), (bx, by), (cx, cy) = ((Fraction(z.real), Fraction(z.imag)) for z in (a, b, c))
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    return (area > 0) - (area < 0)


@pytest.mark.parametrize("scale", [1.0, 1e-180, 1e200])
def test_orientations_are_exact(scale):
    """Corners on or a rounding error off a line, and two in one point."""
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(2, 300, 2)) @ [1, 1j]
    c = a + rng.uniform(-1, 2, 300) * (b - a) + rng.choice([0, 1e-17, 1e-16, 1e-8], 300)
    c[:20] = a[:20]
    z = np.concatenate([a, b, c]) * scale
    F = np.arange(900).reshape(3, 300).T
    expected = [fraction_orientation(*z[corners]) for corners in F]
    np.testing.assert_array_equal(orientations(z, F), expected)
    assert {-1, 0, 1} == set(expected)
    with np.errstate(over="ignore", invalid="ignore"):
        assert (np.sign(signed_areas(z, F)) != expected).any()


def test_orientations_of_what_is_not_finite_are_0():
    z = np.array([0, 1, 1j, np.nan, np.inf])
    np.testing.assert_array_equal(
        orientations(z, np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])), [1, 0, 0]
    )


def test_turns_of_a_loop():
    assert turns(ring()) == (1, 1, 0)
    assert turns(ring() ** 2) == (2, 2, 0)
    assert turns(ring()[::-1])[1:] == (-1, 12)
    assert turns(np.exp(1j * np.array([0, 0.1, 0.2]))) == (1, 0, 1)  # on a half: one wide arc
    rounded = ring()
    rounded = np.insert(rounded, 1, rounded[0] * np.exp(-3e-16j))
    assert turns(rounded)[0] == 1


def test_no_circle_is_fitted_to_points_that_are_no_numbers():
    assert np.isnan(fitted_circle(np.array([1, 1j, np.nan, -1]))[1])
    assert np.isnan(fitted_circle(np.array([1, 1j, np.inf, -1]))[1])


@pytest.mark.parametrize(
    ("winding", "words"),
    [
        (0, "does not go around the circle"),
        (1, "goes around the circle once, counter-clockwise"),
        (-1, "goes around the circle once, clockwise"),
        (2, "goes around the circle twice, counter-clockwise"),
        (-3, "goes around the circle 3 times, clockwise"),
    ],
)
def test_a_winding_number_in_words(winding, words):
    assert winding_words(winding) == words


def test_boundaries_that_do_not_cross_can_bound_a_region_twice():
    """About a branch point; the image has no folds, and no boundary crosses another."""
    ring = np.exp(2j * np.pi * np.arange(60) / 60)
    assert bounds_once([2 * ring, ring.conj()])
    assert bounds_once([2 * ring.conj(), ring])
    assert overlap_share([2 * ring, ring.conj()]) == 0
    assert not bounds_once([2 * ring, ring])
    assert overlap_share([2 * ring, ring]) == pytest.approx(0.2)
