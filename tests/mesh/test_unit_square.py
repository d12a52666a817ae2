import numpy as np
import pytest

from cembench.mesh.unit_square import to_unit_square

DISK = np.exp(2j * np.pi * np.arange(12) / 12)
OBLONG = np.array([3, 7, 7 + 2j, 3 + 2j])


def test_a_disk_becomes_the_circle_that_touches_the_square():
    np.testing.assert_allclose(to_unit_square(DISK), (DISK + 1 + 1j) / 2, atol=1e-16)


@pytest.mark.parametrize("z", [DISK, OBLONG, 1e-9 * OBLONG, OBLONG[:1], DISK * (1 + 1e-12)])
def test_any_map_lies_in_the_square_and_keeps_its_shape(z):
    moved = to_unit_square(z)
    assert min(moved.real.min(), moved.imag.min()) >= 0
    assert max(moved.real.max(), moved.imag.max()) <= 1
    sides, after = np.diff(z), np.diff(moved)
    if len(z) > 1:
        np.testing.assert_allclose(after / after[0], sides / sides[0], atol=1e-9)
