import numpy as np
import pytest
from cembench.textures.packing import packed

DISK = np.exp(2j * np.pi * np.arange(12) / 12)
OBLONG = np.array([3, 7, 7 + 2j, 3 + 2j])


@pytest.mark.parametrize("areas", [[1, 1], [5, 1, 3, 2], [1] * 9, [100, 1e-9, 1e-9]])
def test_shells_share_the_square_without_overlap(areas):
    shells = packed([DISK] * len(areas), areas)
    low = np.array([[z.real.min(), z.imag.min()] for z in shells])
    high = np.array([[z.real.max(), z.imag.max()] for z in shells])
    assert low.min() >= 0
    assert high.max() <= 1
    for i in range(len(shells)):
        for j in range(i):
            assert (low[i] > high[j]).any() or (low[j] > high[i]).any()
    assert (high - low).prod(axis=1).sum() > 0.4  # a few shells waste no more
    larger = np.argsort(areas, kind="stable")
    assert (np.diff((high - low)[larger, 0]) > -1e-12).all()


def test_equal_parts_are_equal_whatever_the_areas():
    square = np.array([0, 1, 1 + 1j, 1j])
    first, second = packed([square, square], [100.0, 1.0], equal=True)
    assert np.ptp(first.real) == pytest.approx(np.ptp(second.real))
    by_area = packed([square, square], [100.0, 1.0])
    assert np.ptp(by_area[0].real) == pytest.approx(10 * np.ptp(by_area[1].real))
