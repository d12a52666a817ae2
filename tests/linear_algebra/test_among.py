"""Solves between a few rows find what solves of the whole system find there."""

import gc

import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from scipy import sparse

from cembench.conformal.laplacian import by_rows, laplacian
from cembench.linear_algebra import factor_part
from cembench.linear_algebra.cholesky import Cholesky, available_backends, linear_algebra
from cembench.linear_algebra.factor_part import FactorPart
from cembench.linear_algebra.work import counting


def interior_system(faces=2000):
    """L_ii of a surface, and the rows of the boundary's neighbours."""
    mesh = hemi_ellipsoid(faces)
    rows = by_rows(laplacian(mesh))
    near = np.unique(rows[mesh.boundary][:, mesh.interior].indices)
    return sparse.csc_array(rows[mesh.interior][:, mesh.interior]), near


def random_system(n=60, seed=5):
    half = sparse.random_array((n, n), density=0.05, rng=np.random.default_rng(seed))
    return sparse.csc_array(half @ half.T + sparse.eye_array(n)), np.array([41, 3, 17])


def two_pieces():
    A, _ = random_system()
    return sparse.csc_array(sparse.block_diag([A, 2 * A])), np.array([100, 2])


SYSTEMS = {"interior": interior_system, "random": random_system, "two pieces": two_pieces}


def expected(A, rows, b):
    padded = np.zeros((A.shape[0], *b.shape[1:]), dtype=b.dtype)
    padded[rows] = b
    return np.linalg.solve(A.toarray(), padded)


def right_hand_sides(rows):
    random = np.random.default_rng(1).standard_normal((len(rows), 3))
    return {"column": random[:, 0], "columns": random, "complex": random @ [1, 1j, 1 - 1j]}


@pytest.mark.parametrize("kind", ["column", "columns", "complex"])
@pytest.mark.parametrize("backend", available_backends())
@pytest.mark.parametrize("solves", ["reuse", "backslash"])
@pytest.mark.parametrize("system", SYSTEMS)
def test_they_agree_with_the_whole_solution(system, solves, backend, kind):
    A, rows = SYSTEMS[system]()
    b = right_hand_sides(rows)[kind]
    with linear_algebra(solves, backend):
        among = Cholesky(A).among(rows)
        there, everywhere = among.solve(b), among.solve_everywhere(b)
    assert there.dtype == everywhere.dtype == b.dtype
    np.testing.assert_allclose(everywhere, expected(A, rows, b), atol=1e-11)
    np.testing.assert_allclose(there, everywhere[rows], atol=1e-12)


def test_the_whole_factor_is_a_part_too():
    A, _ = random_system()
    among = Cholesky(A).among(np.arange(A.shape[0]))
    b = np.random.default_rng(2).standard_normal(A.shape[0])
    assert among._part.share == 1
    np.testing.assert_allclose(among.solve(b), np.linalg.solve(A.toarray(), b), atol=1e-12)


def test_beside_a_boundary_they_pass_less_than_half_and_count_so():
    A, rows = interior_system(20_000)
    b = np.ones(len(rows))
    with counting() as work:
        among = Cholesky(A).among(rows)
        among.solve(b)
    share = work.right_hand_sides
    assert 0 < share < 0.5
    with counting() as work:
        among.solve_everywhere(b)
    assert work.right_hand_sides == pytest.approx((1 + share) / 2)


def test_they_follow_a_matrix_that_is_changed():
    A, rows = interior_system()
    whole = Cholesky(A)
    among = whole.among(rows)
    b = np.ones(len(rows))
    before = among.solve(b)
    whole.update(sparse.csc_array(4 * A))
    np.testing.assert_allclose(4 * among.solve(b), before, rtol=1e-11)
    np.testing.assert_allclose(4 * among.solve_everywhere(b)[rows], before, rtol=1e-11)


def test_nothing_else_need_hold_the_factor():
    A, rows = interior_system()
    among = Cholesky(A).among(rows)
    gc.collect()
    b = np.ones(len(rows))
    np.testing.assert_allclose(among.solve(b), expected(A, rows, b)[rows], atol=1e-11)


def test_where_the_factor_cannot_be_seen_they_are_whole_solves(monkeypatch):
    A, rows = interior_system()
    b = np.ones(len(rows))
    monkeypatch.setattr(factor_part, "held_factor", lambda *_: None)
    with counting() as work:
        there = Cholesky(A).among(rows).solve(b)
    assert work.right_hand_sides == 1
    np.testing.assert_allclose(there, expected(A, rows, b)[rows], atol=1e-11)


def test_parts_that_solve_a_known_system_wrongly_are_not_used(monkeypatch):
    A, rows = interior_system()
    b = np.ones(len(rows))
    step = FactorPart._substituted
    monkeypatch.setattr(FactorPart, "_substituted", lambda *about: 1.001 * step(*about))
    factor_part.parts_are_right.cache_clear()
    with counting() as work:
        there = Cholesky(A).among(rows).solve(b)
    assert work.right_hand_sides == 1
    np.testing.assert_allclose(there, expected(A, rows, b)[rows], atol=1e-11)
    monkeypatch.undo()
    factor_part.parts_are_right.cache_clear()
    assert factor_part.parts_are_right()


def test_a_leading_block_is_refused():
    A, rows = random_system()
    with pytest.raises(ValueError, match="without a leading block"):
        Cholesky(A, leading=5).among(rows)
