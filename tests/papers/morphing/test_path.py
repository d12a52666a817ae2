from itertools import pairwise

import numpy as np
import pytest
from cembench.papers.cem.morphing.path import (
    largest_acceleration,
    largest_step,
    pose_of,
    position,
)

RNG = np.random.default_rng(0)
A, B, C = RNG.standard_normal((3, 20, 3))


def test_two_surfaces_are_joined_by_a_straight_line():
    np.testing.assert_allclose(position([A, B], 0.25), 0.75 * A + 0.25 * B, atol=1e-14)
    assert largest_acceleration([A, B]) == pytest.approx(0, abs=1e-12)


def test_the_path_goes_through_every_surface_at_its_time():
    for time, surface in ((0.0, A), (0.5, B), (1.0, C)):
        np.testing.assert_allclose(position([A, B, C], time), surface, atol=1e-13)


def test_the_path_is_a_natural_cubic_spline():
    """Its second derivative is continuous, linear between knots, and zero at both ends."""
    h = 1e-3

    def second(time):
        return (
            sum(w * position([A, B, C], time + k * h) for k, w in ((-1, 1), (0, -2), (1, 1))) / h**2
        )

    np.testing.assert_allclose(second(0.25), second(0.5 - h) / 2, atol=0.1)
    np.testing.assert_allclose(second(0.5 - h), second(0.5 + h), atol=0.2)
    assert np.abs(second(h)).max() < 0.2


def test_the_largest_acceleration_is_that_of_finite_differences():
    h = 1e-4
    times = np.linspace(h, 1 - h, 401)
    by_differences = max(
        np.linalg.norm(
            position([A, B, C], t - h) - 2 * position([A, B, C], t) + position([A, B, C], t + h),
            axis=1,
        ).max()
        / h**2
        for t in times
    )
    assert largest_acceleration([A, B, C]) == pytest.approx(by_differences, rel=0.01)


def test_the_largest_step_is_between_two_frames():
    times = np.linspace(0, 1, 5)
    frames = [position([A, B, C], t) for t in times]
    steps = [np.linalg.norm(q - p, axis=1).max() for p, q in pairwise(frames)]
    assert largest_step([A, B, C], times) == pytest.approx(max(steps))


@pytest.mark.parametrize("scale", [True, False])
def test_a_surface_that_stands_elsewhere_is_brought_back(scale):
    turn, _ = np.linalg.qr(RNG.standard_normal((3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    factor = 2.5 if scale else 1.0
    moved = factor * A @ turn + [1, 2, 3]
    np.testing.assert_allclose(
        pose_of(moved, A, np.ones(len(A)), scale=scale)(moved), A, atol=1e-12
    )


def test_a_pose_is_never_a_mirror_image():
    mirrored = A * [-1, 1, 1]
    pose = pose_of(mirrored, A, np.ones(len(A)), scale=False)
    corners = np.vstack([np.zeros(3), np.eye(3)])
    image = pose(corners)
    assert np.linalg.det(image[1:] - image[0]) == pytest.approx(1)
