"""Micro-benchmarks of the shared steps; one plain call each unless --benchmark-enable is given."""

import pytest

from benchmarks.tracked import cases

FACES = 20_000


@pytest.fixture(scope="module")
def kernels():
    return cases.kernels(cases.surface("spherical-cap", FACES))


@pytest.mark.parametrize("kernel", cases.KERNELS)
def test_kernel(benchmark, kernels, kernel):
    benchmark.extra_info["faces"] = FACES
    assert benchmark(kernels[kernel]) is not None
