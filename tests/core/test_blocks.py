import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench.conformal.metrics import all_metrics
from cembench.conformal.planar import orientations
from cembench.core import blocks


def test_blocks_cover_all_rows_once():
    for rows in (0, 1, blocks.ROWS, blocks.ROWS + 1, 3 * blocks.ROWS):
        items = [k for part in blocks.blocks(rows) for k in range(rows)[part]]
        assert items == list(range(rows))


@pytest.mark.parametrize("rows", [0, 1, 6, 7, 8, 20])
def test_a_function_of_rows_is_the_same_in_blocks(monkeypatch, rows):
    monkeypatch.setattr(blocks, "ROWS", 7)
    matrix = np.arange(3.0 * rows).reshape(rows, 3)
    blockwise = blocks.in_blocks(lambda some: some @ [1.0, 2.0, 3.0], matrix)
    np.testing.assert_array_equal(blockwise, matrix @ [1.0, 2.0, 3.0])


def test_figures_of_a_map_do_not_depend_on_the_blocks(monkeypatch):
    mesh = hemi_ellipsoid(1500)
    uv = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    uv[mesh.F[0]] = uv[mesh.F[0]][[1, 0, 2]]  # folds
    torn = uv.copy()
    torn[mesh.F[-1, 0]] = np.nan
    whole = all_metrics(mesh, uv), orientations(torn, mesh.F)
    monkeypatch.setattr(blocks, "ROWS", 64)
    parts = all_metrics(mesh, uv), orientations(torn, mesh.F)
    assert repr(parts[0]) == repr(whole[0])
    assert whole[0]["flipped_triangles"] > 0
    np.testing.assert_array_equal(parts[1], whole[1])
