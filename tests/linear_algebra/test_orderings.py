"""Orders of rows for CHOLMOD: permutations, and how large the factors become."""

import numpy as np
import pytest
from cvxopt import spmatrix

import cembench
from cembench.conformal.laplacian import laplacian
from cembench.linear_algebra import cholmod, orderings
from cembench.linear_algebra.cholesky import Cholesky, linear_algebra
from cembench.linear_algebra.orderings import minimum_degree, nested_dissection, set_options
from cembench.linear_algebra.work import counting

pytest.importorskip("pymetis", reason="the extra metis is not installed: nothing of it is tested")


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


@pytest.mark.parametrize("order", [minimum_degree, nested_dissection])
def test_an_order_names_every_row_once(order):
    A, _ = system(2000)
    lower, _ = cholmod._lower_triangle(A)
    np.testing.assert_array_equal(np.sort(order(lower)), np.arange(A.shape[0]))


def test_a_diagonal_matrix_is_left_in_order():
    lower = spmatrix(1.0, range(5), range(5))
    np.testing.assert_array_equal(nested_dissection(lower), np.arange(5))


def test_nested_dissection_fills_less_on_a_mesh_with_its_boundary_last():
    A, leading = system(20_000)
    assert entries("cvxopt-metis", A, leading) < entries("cvxopt", A, leading)


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


def test_both_orders_give_the_same_map():
    mesh = cembench.surface("hemi-ellipsoid", 3000)
    maps = []
    for backend in ("cvxopt", "cvxopt-metis"):
        with linear_algebra(backend=backend):
            maps.append(cembench.parameterize(mesh, "direct-cem").z)
    assert np.abs(maps[0] - maps[1]).max() < 1e-9
