import io

import numpy as np
import pytest
import trimesh

from cembench import TriangleMesh
from cembench.mesh.cut import cut_open
from cembench.mesh.files import read_mesh
from cembench.mesh.formats import obj
from cembench.mesh.formats.obj import with_uv
from cembench.mesh.soup import Soup
from tests import gallery

FILE = """# by hand
mtllib wood.mtl
o plate
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v 1 1 0 0 0 1
v 0 1 0 1 1 1
v 2 0.5 0 1 1 0
vt 0.5 0.5
vn 0 0 1
g left
usemtl oak
s 1
f 1/1/1 2/1/1 3/1/1 4/1/1
g right
usemtl elm
f -4//-1 -1//-1 \\
  -3//-1
l 1/1 2/1
"""

EXPECTED = """# by hand
mtllib wood.mtl
o plate
v 0 0 0 1 0 0
v 1 0 0 0 1 0
v 1 1 0 0 0 1
v 0 1 0 1 1 1
v 2 0.5 0 1 1 0
vn 0 0 1
g left
usemtl oak
s 1
vt 0.0 0.1
vt 1.0 0.1
vt 2.0 0.1
vt 3.0 0.1
vt 4.0 0.1
f 1/1/1 2/2/1 3/3/1 4/4/1
g right
usemtl elm
f 2/2/-1 5/5/-1 3/3/-1
l 1 2
"""


def obj_text(*arrays):
    return obj.write(Soup.of_triangles(*arrays)).decode()


def test_everything_but_the_uvs_stays():
    assert with_uv(FILE, np.arange(5) + 0.1j) == EXPECTED


def test_statements_are_those_that_the_reader_finds():
    text = (
        "# a comment ends in a backslash \\\n"
        "v 0 0 0\nv 1 \\\n0 0 # \x85 \x0c\nv 1 1 0\nv 0 1 0\n"
        "g left\\\nf 1 2 3 # 4\n\tfo 1 3 \\\n4\n"
    )
    new = with_uv(text, np.arange(4) + 0j)
    assert corners_of(new) == [[(0, 0), (1, 1), (2, 2)], [(0, 0), (2, 2), (3, 3)]]
    assert new.startswith(text[: text.index("f 1")] + "vt 0.0 0.0\n")


def test_numbers_are_the_shortest_that_read_back_as_the_same_double():
    V = np.array([[0.1, 1e-17, 1 / 3], [1, 0, 0], [0, 1, 0]])
    uv = np.array([0.1 + 0.2j, 1e-300 + 1j / 3, 5e-324 + 0j])
    lines = obj_text(V, np.array([[0, 1, 2]]), uv).splitlines()
    assert lines[0] == "v 0.1 1e-17 0.3333333333333333"
    assert lines[3:6] == ["vt 0.1 0.2", "vt 1e-300 0.3333333333333333", "vt 5e-324 0.0"]
    again = [complex(*map(float, line.split()[1:])) for line in lines[3:6]]
    assert again == uv.tolist()


def corners_of(text):
    """Every face of an OBJ file as pairs of a vertex and a UV, from 0."""
    faces = [line.split()[1:] for line in text.splitlines() if line.startswith("f ")]
    return [[tuple(int(k) - 1 for k in word.split("/")[:2]) for word in face] for face in faces]


@pytest.mark.parametrize("compose", ["anew", "from a file"])
def test_another_reader_finds_the_uvs_of_a_cut_surface_on_the_uncut_one(compose):
    mesh = TriangleMesh.from_arrays(*gallery.torus())
    cut = cut_open(mesh)
    uv = np.exp(1j * np.arange(cut.mesh.n)) / 3
    text = (
        obj_text(mesh.V, mesh.F, uv, cut.mesh.F)
        if compose == "anew"
        else with_uv(obj_text(mesh.V, mesh.F), uv, mesh.F, cut.mesh.F)
    )
    expected = np.stack([mesh.F, cut.mesh.F], axis=2)
    np.testing.assert_array_equal(corners_of(text), expected)
    loaded = trimesh.load_mesh(io.StringIO(text), file_type="obj", process=False)
    np.testing.assert_allclose(loaded.vertices[loaded.faces], mesh.V[mesh.F], atol=1e-8)
    z = loaded.visual.uv[loaded.faces] @ [1, 1j]
    np.testing.assert_allclose(z, uv[cut.mesh.F], atol=1e-8)


def test_polygons_stay_except_where_the_seam_crosses_them(tmp_path):
    V, F = gallery.torus()
    half = len(F) // 2  # quadrilateral k consists of the triangles k and half + k
    quads = np.column_stack([F[:half, :3], F[half:, 2]])
    text = obj_text(V, F[:0]) + "".join(
        "f " + " ".join(f"{v + 1}" for v in quad) + "\n" for quad in quads.tolist()
    )
    (tmp_path / "a.obj").write_text(text)
    mesh = read_mesh(tmp_path / "a.obj", TriangleMesh)
    cut = cut_open(mesh)
    uv = np.arange(cut.mesh.n) * (1 + 2j)
    faces = corners_of(with_uv(text, uv, mesh.F, cut.mesh.F))
    corners = {
        frozenset(face): dict(zip(face, copies, strict=True))
        for face, copies in zip(mesh.F.tolist(), cut.mesh.F.tolist(), strict=True)
    }
    crossed = sum(
        any(corners[frozenset((a, b, c))][v] != corners[frozenset((a, c, d))][v] for v in (a, c))
        for a, b, c, d in quads.tolist()
    )
    assert 0 < crossed < half
    assert len(faces) == half + crossed
    for face in faces:
        if len(face) == 3:
            assert dict(face) == corners[frozenset(v for v, _ in face)]
    area = sum(len(face) - 2 for face in faces)
    assert area == len(F)


def test_a_large_file_reads_back(tmp_path):
    V, F = gallery.torus()
    (tmp_path / "a.obj").write_text(obj_text(V / 3, F))
    again = read_mesh(tmp_path / "a.obj", TriangleMesh)
    np.testing.assert_array_equal(again.V, V / 3)
    np.testing.assert_array_equal(again.F, F)
