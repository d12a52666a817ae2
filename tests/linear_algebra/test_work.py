"""Factorisations and solves are counted, and counting changes nothing."""

import numpy as np
import pytest
from scipy import sparse

from cembench.linear_algebra.backends import available_backends, uses_cholmod
from cembench.linear_algebra.cholesky import Cholesky, linear_algebra
from cembench.linear_algebra.dense_cholesky import DenseCholesky
from cembench.linear_algebra.work import counting
from cembench.registry import load_registry
from cembench.running.measure import check_cell
from cembench.running.plan import MeasurementSettings, plan_cells
from cembench.running.surfaces import generate_surface


def matrix(n=60):
    return sparse.csc_array(sparse.diags_array([-1.0, 2.1, -1.0], offsets=[-1, 0, 1], shape=(n, n)))


@pytest.mark.parametrize("backend", available_backends())
def test_factors_and_right_hand_sides_are_counted(backend):
    A = matrix()
    with linear_algebra(backend=backend), counting() as work:
        factor = Cholesky(A)
        factor.solve(np.ones(60))
        factor.solve(np.ones((60, 3)) * 1j)
        factor.update(2 * A)
        factor.solve(np.ones((60, 2)))
        DenseCholesky(np.eye(7))
    assert (work.numeric, work.right_hand_sides, work.order) == (2, 9.0, 60)
    assert work.symbolic == (1 if uses_cholmod(backend) else 2)
    assert (work.dense, work.dense_order) == (1, 7)
    if backend != "pardiso":
        # A tridiagonal factor without fill has 119 entries; supernodes pad.
        assert 119 <= work.entries <= 60 * 60


def test_factoring_anew_at_every_solve_is_counted_as_such():
    with linear_algebra("backslash"), counting() as work:
        factor = Cholesky(matrix(), leading=50)
        for _ in range(3):
            factor.solve(np.ones(60))
        factor.solve_leading(np.ones(50))
    assert (work.numeric, work.right_hand_sides) == (4, 4.0)


def test_half_a_solve_counts_half():
    with linear_algebra(backend="cvxopt"), counting() as work:
        factor = Cholesky(matrix(), leading=50)
        factor.condensed(np.ones((60, 2)))
    assert work.right_hand_sides in (1.0, 2.0)  # 2 where the library does not show its factor


def test_nothing_is_counted_outside():
    with counting() as work:
        pass
    Cholesky(matrix()).solve(np.ones(60))
    assert (work.numeric, work.right_hand_sides) == (0, 0.0)


@pytest.mark.parametrize(
    ("name", "numeric", "columns"), [("harmonic-circle", 1, 2.0), ("mean-value", 1, 2.0)]
)
def test_an_outcome_holds_the_counts_of_its_checked_call(name, numeric, columns):
    registry = load_registry()
    mesh = generate_surface(registry, "hemi-ellipsoid", 300)
    spec = registry.algorithm(name)
    (task,) = plan_cells([spec], [mesh], {}, MeasurementSettings(repeats=1))
    outcome, _ = check_cell(spec, mesh, task.cell)
    work = outcome.work
    assert (work.numeric, work.right_hand_sides) == (numeric, columns)
    assert work.order == len(mesh.interior)
    assert work.entries > mesh.n
