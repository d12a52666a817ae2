"""The page of the paper's models: printed cells are the paper's, and Nefertiti's are measured."""

import numpy as np
from cembench.algorithms.cem import cem, map_from_triangle
from cembench.algorithms.ldm import farthest_from_mean, ldm, map_numbered
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from benchmarks.paper_models import cells, printed
from cembench.mesh.files import read_mesh
from tests.real_meshes import real_mesh


def test_printed_cells_are_the_paper_s():
    assert printed("Nefertiti", "ldm") == ("0.0337", "2.79", "3.46")
    assert printed("Human Brain", "qiem") == ("0.0220", "1.87", "1.72")


def test_the_usual_choices_are_the_algorithms():
    mesh = hemi_ellipsoid(400)
    usual = map_numbered(mesh, farthest_from_mean(mesh)).uv
    assert np.array_equal(usual, ldm(mesh).uv)
    assert np.array_equal(map_from_triangle(mesh, None).uv, cem(mesh).uv)


def test_numbering_moves_the_figures_of_a_coarse_mesh():
    mesh = read_mesh(real_mesh("nefertiti.obj"))
    other = [cells(mesh, map_numbered(mesh, k)).shown() for k in (0, 16, 32)]
    assert len(set(other)) == 3
    assert other[2] == ("0.0335", "2.79", "3.46")
    starts = {cells(mesh, map_from_triangle(mesh, k)).shown() for k in (0, 100, 200)}
    assert len(starts) > 1
