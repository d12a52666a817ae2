"""Cuts along seams of the user's own, and along those of texture coordinates."""

import json

import numpy as np
import pytest

import cembench
from cembench import DiskMesh, ParameterError, TriangleMesh
from cembench.mesh import topology
from cembench.mesh.cut import cut_open
from cembench.mesh.files import read_mesh, write_soup
from cembench.mesh.soup import Soup
from tests import gallery

SPHERE = cembench.repair(gallery.octahedron()).mesh
TORUS = TriangleMesh.from_arrays(*gallery.torus())


def edge_set(edges):
    return {tuple(sorted(edge)) for edge in np.asarray(edges).tolist()}


def test_a_seam_of_vertices_is_the_cut():
    path = [4, 0, 5]
    result = cembench.cut(SPHERE, along=[path])
    assert isinstance(result.mesh, DiskMesh)
    assert edge_set(result.edges) == {(0, 4), (0, 5)}
    np.testing.assert_array_equal(result.origin[result.mesh.F], SPHERE.F)
    assert result.length == pytest.approx(2 * np.sqrt(2))


def test_vertices_that_are_no_neighbours_are_joined_by_the_shortest_path():
    assert len(cembench.cut(SPHERE, along=[[4, 5]]).edges) == 2
    ring = [0, 12, 24, 36, 48, 60, 72, 84, 0]
    same = cembench.cut(TORUS, along=[ring[::2]])
    assert edge_set(cembench.cut(TORUS, along=[ring]).edges) == edge_set(same.edges)


def test_what_the_seams_leave_is_cut_further_until_it_is_a_disk():
    ring = [0, 12, 24, 36, 48, 60, 72, 84, 0]
    result = cembench.cut(TORUS, along=[ring])
    assert isinstance(result.mesh, DiskMesh)
    assert edge_set(np.column_stack([ring[:-1], ring[1:]])) < edge_set(result.edges)
    np.testing.assert_array_equal(result.origin[result.mesh.F], TORUS.F)
    assert any("8 given edges" in str(n) and "more that a disk" in str(n)
               for n in result.mesh.notices)  # fmt: skip
    lengths = np.linalg.norm(np.diff(TORUS.V[result.edges], axis=1)[:, 0], axis=1)
    assert result.length == pytest.approx(lengths.sum())


def test_seams_that_divide_the_surface_make_pieces():
    result = cembench.cut(SPHERE, along=[[0, 2, 1, 3, 0]])
    assert topology.components(result.mesh.F, result.mesh.n)[0] == 2
    assert "into 2 islands" in str(result.mesh.notices[-1])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"along": [[0, 99]]}, r"goes through \[0, 99\]; allowed are two or more.*0 to 5"),
        ({"along": [[3]]}, "two or more vertices"),
        ({"along": [[4, 5]], "through": [4, 5]}, "exclude each other"),
        ({"along": "uv"}, "for a file with texture coordinates, 'uv'"),
        ({"along": "seams"}, "allowed are lists of vertices"),
    ],
)
def test_seams_that_cannot_be(options, message):
    with pytest.raises(ParameterError, match=message):
        cembench.cut(SPHERE, **options)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".npz"])
@pytest.mark.parametrize("surface", [SPHERE, TORUS], ids=["sphere", "torus"])
def test_the_seams_of_a_file_s_own_texture_coordinates(surface, suffix, tmp_path):
    """A map written for the uncut surface has the cut as its seam."""
    opened = cut_open(surface)
    uv = cembench.parameterize(opened.mesh).z
    path = tmp_path / f"a{suffix}"
    write_soup(path, Soup.of_triangles(surface.V, surface.F, uv, opened.mesh.F))
    again = cembench.cut(path, along="uv")
    assert edge_set(again.edges) == edge_set(opened.edges)
    assert isinstance(again.mesh, DiskMesh)


def test_a_file_without_texture_coordinates_has_no_seams(tmp_path):
    (tmp_path / "a.obj").write_text(gallery.obj_text(*gallery.octahedron()))
    with pytest.raises(cembench.MeshError, match="no UVs"):
        cembench.cut(tmp_path / "a.obj", along="uv")


@pytest.mark.process
def test_the_command_takes_a_file_of_seams_or_uv(tmp_path, cli):
    path = tmp_path / "a.obj"
    path.write_text(gallery.obj_text(*gallery.octahedron()))
    (tmp_path / "seams.txt").write_text("# mine\n4, 0, 5\n")
    code, out, err = cli("cut", path, "-o", "d.obj", "--along", tmp_path / "seams.txt", "--json")
    assert code == 0, err
    assert edge_set(json.loads(out)["cut_edges"]) == {(0, 4), (0, 5)}
    read_mesh(cli.folder / "d.obj", DiskMesh)
    assert cli("map", path, "--cut", "-o", "uv.obj")[0] == 0
    code, out, err = cli("cut", "uv.obj", "-o", "e.obj", "--along", "uv")
    assert code == 0, err
    assert "given edges" in err
    assert read_mesh(cli.folder / "e.obj", DiskMesh).m == 8
    (tmp_path / "bad.txt").write_text("4 x\n")
    code, _, err = cli("cut", path, "-o", "f.obj", "--along", tmp_path / "bad.txt")
    assert (code, "cannot be read as seams" in " ".join(err.split())) == (2, True)
    code, _, err = cli("cut", path, "-o", "f.obj", "--along", "uv", "--between", "4", "5")
    assert (code, "`along` and" in " ".join(err.split())) == (2, True)
