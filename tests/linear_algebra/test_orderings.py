"""Orders of rows for CHOLMOD: permutations, and how large the factors become."""

from importlib.util import find_spec

import numpy as np
import pytest
from cvxopt import spmatrix

import cembench
from cembench.conformal.laplacian import laplacian
from cembench.linear_algebra import cholmod, orderings
from cembench.linear_algebra.backends import available_backends
from cembench.linear_algebra.cholesky import Cholesky, linear_algebra
from cembench.linear_algebra.orderings import (
    dissection_by_position,
    minimum_degree,
    nested_dissection,
    set_options,
)
from cembench.linear_algebra.work import counting
from cembench.mesh.triangle_mesh import DiskMesh

needs_metis = pytest.mark.skipif(
    find_spec("pymetis") is None, reason="the extra metis is not installed: METIS is not tested"
)


def system(faces, boundary_last=True):
    """A pinned Laplacian with its boundary behind the interior, and the interior's size."""
    mesh = cembench.surface("hemi-ellipsoid", faces)
    order = np.concatenate([mesh.interior, mesh.boundary])
    L = laplacian(mesh).tocsr()[order][:, order]
    L.setdiag(L.diagonal() + 1)
    return L.tocsc(), len(mesh.interior)


def entries(backend, A, leading):
    with linear_algebra(backend=backend), counting() as work:
        Cholesky(A, leading=leading)
    return work.entries


@pytest.mark.parametrize(
    "order", [minimum_degree, pytest.param(nested_dissection, marks=needs_metis)]
)
def test_an_order_names_every_row_once(order):
    A, _ = system(2000)
    lower, _ = cholmod._lower_triangle(A)
    np.testing.assert_array_equal(np.sort(order(lower)), np.arange(A.shape[0]))


@needs_metis
def test_a_diagonal_matrix_is_left_in_order():
    lower = spmatrix(1.0, range(5), range(5))
    np.testing.assert_array_equal(nested_dissection(lower), np.arange(5))


@needs_metis
def test_nested_dissection_fills_less_on_a_mesh_with_its_boundary_last():
    A, leading = system(20_000)
    assert entries("cvxopt-metis", A, leading) < entries("cvxopt", A, leading)


@needs_metis
def test_without_a_postorder_the_factor_would_have_more_supernodes(monkeypatch):
    """Their padded blocks are then narrower, so that the factor is slower, not larger."""
    A, leading = system(6000)
    lower, _ = cholmod._lower_triangle(A)
    block = lower[:leading, :leading]
    ordered = nested_dissection(block)
    monkeypatch.setattr(orderings, "_postordered", lambda _, order: order)
    plain = nested_dissection(block)
    np.testing.assert_array_equal(np.sort(ordered), np.arange(leading))
    assert supernodes(lower, ordered, leading) < supernodes(lower, plain, leading) / 2


def supernodes(lower, first, leading):
    from cembench.linear_algebra.orderings import as_permutation
    from cembench.linear_algebra.supernodes import held_factor

    whole = np.concatenate([first, np.arange(leading, lower.size[0])])
    set_options(postorder=False)
    symbolic = cholmod.cholmod.symbolic(lower, as_permutation(whole))
    return held_factor(symbolic, numeric=False).nsuper


@needs_metis
def test_both_orders_give_the_same_map():
    mesh = cembench.surface("hemi-ellipsoid", 3000)
    maps = []
    for backend in ("cvxopt", "cvxopt-metis"):
        with linear_algebra(backend=backend):
            maps.append(cembench.parameterize(mesh, "direct-cem").z)
    assert np.abs(maps[0] - maps[1]).max() < 1e-9


def grid(side):
    """A height field, its squares halved at random, and the Laplacian of its interior."""
    rng = np.random.default_rng(0)
    x, y = np.divmod(np.arange(side * side), side)
    V = np.stack([x, y, rng.random(side * side)], axis=1).astype(float)
    a = np.flatnonzero((x < side - 1) & (y < side - 1))
    b, c, d = a + side, a + side + 1, a + 1
    turned = rng.random(len(a)) < 0.5
    one = np.where(turned, [a, b, d], [a, b, c]).T
    other = np.where(turned, [b, c, d], [a, c, d]).T
    mesh = DiskMesh(V, np.concatenate([one, other]))
    L = laplacian(mesh, delaunay=True)[mesh.interior][:, mesh.interior]
    return L.tocsc(), mesh.V[mesh.interior]


def entries_in_order(A, points):
    with linear_algebra(backend="cvxopt"), counting() as work:
        Cholesky(A, points=points)
    return work.entries


def test_dissection_by_position_fills_a_grid_no_more_than_minimum_degree():
    A, points = grid(80)
    order = dissection_by_position(cholmod._lower_triangle(A)[0], points)
    np.testing.assert_array_equal(np.sort(order), np.arange(A.shape[0]))
    assert entries_in_order(A, points) < 1.1 * entries_in_order(A, None)
    elsewhere = np.random.default_rng(1).permutation(points)
    assert entries_in_order(A, elsewhere) > 2 * entries_in_order(A, points)


@pytest.mark.parametrize("solves", ["reuse", "backslash"])
@pytest.mark.parametrize("backend", available_backends())
@pytest.mark.parametrize("place", ["surface", "one point", "line"])
def test_a_system_is_solved_wherever_its_rows_lie(backend, solves, place):
    A, points = grid(12)
    points = points * {"surface": 1e-300, "one point": 0, "line": [0, 0, 1e200]}[place]
    b = np.arange(A.shape[0], dtype=float)
    with linear_algebra(solves, backend):
        x = Cholesky(A, points=points).solve(b)
    assert abs(A @ x - b).max() < 1e-9 * abs(b).max()


def test_points_do_not_go_with_a_leading_block():
    A, points = grid(6)
    with pytest.raises(ValueError, match="leading block"):
        Cholesky(A, leading=3, points=points)


@pytest.mark.parametrize("backend", ["cvxopt", pytest.param("cvxopt-metis", marks=needs_metis)])
def test_only_the_default_back_end_takes_positions(backend):
    A, points = grid(12)
    with linear_algebra(backend=backend):
        plain, placed = Cholesky(A)._kept.order, Cholesky(A, points=points)._kept.order
    assert np.array_equal(plain, placed) == (backend != "cvxopt")
