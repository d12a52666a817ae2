import re

import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from scipy.io import savemat

from cembench import MeshError, TriangleMesh
from cembench.core.notices import NoticeKind
from cembench.mesh.files import WITH_UV, read_mesh, write_mesh
from tests import gallery
from tests.limits import files_of_at_most


@pytest.fixture
def surface():
    mesh = hemi_ellipsoid(600)
    return TriangleMesh.from_arrays(mesh.V / 3, mesh.F)


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply"])
def test_every_bit_survives_a_round_trip(surface, suffix, tmp_path):
    write_mesh(tmp_path / f"a{suffix}", surface)
    again = read_mesh(tmp_path / f"a{suffix}", TriangleMesh)
    np.testing.assert_array_equal(again.V, surface.V)
    np.testing.assert_array_equal(again.F, surface.F)
    assert again.name == "a"
    assert not again.notices


def test_stl_merges_its_corners_again_in_single_precision(surface, tmp_path):
    write_mesh(tmp_path / "a.stl", surface)
    again = read_mesh(tmp_path / "a.stl")
    assert (again.n, again.m, len(again.boundary)) == (surface.n, surface.m, 60)
    assert abs(np.sort(again.V[:, 2]) - np.sort(surface.V[:, 2])).max() < 1e-7


def test_uvs_read_back_exactly_from_obj(surface, tmp_path):
    uv = np.exp(1j * np.arange(surface.n)) / 3
    write_mesh(tmp_path / "a.obj", surface, uv)
    text = (tmp_path / "a.obj").read_text()
    written = [complex(*map(float, line.split()[1:3])) for line in re.findall("vt .*", text)]
    np.testing.assert_array_equal(written, uv)
    corners = re.findall(r"^f (\d+)/(\d+)", text, re.MULTILINE)
    assert len(corners) == surface.m
    assert all(vertex == texture for vertex, texture in corners)


SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


@pytest.mark.parametrize(
    ("name", "text", "faces", "notice"),
    [
        ("quad.obj", SQUARE + "f 1 2 3 4\n", 2, NoticeKind.POLYGONS_CUT),
        ("mixed.obj", SQUARE + "v 2 0 0\nf 1 2 3 4\nf 2 5 3\n", 3, NoticeKind.POLYGONS_CUT),
        ("pentagon.obj", SQUARE + "v -1 0.5 0\nf 1 2 3 4 5\n", 3, NoticeKind.POLYGONS_CUT),
        ("seams.obj", SQUARE + "vt 0 0\n" * 6 + "f 1/1/1 2/2/1 3/3/1\nf 1/4 3//5 4\n", 2, None),
        (
            "colours.obj",
            "".join(f"v {k} {k * k} 0 1 0 0\n" for k in range(3)) + "f 1 2 3\n",
            1,
            None,
        ),
        ("relative.obj", SQUARE + "f -4 -3 -2\nf -4 -2 -1\n", 2, None),
        ("continued.obj", SQUARE + "f 1 2 \\\n 3\nf 1 3 4\n", 2, None),
        (
            "quad.off",
            "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n",
            2,
            NoticeKind.POLYGONS_CUT,
        ),
        ("comment.off", "OFF\n# c\n3 1 0\n0 0 0\n1 0 0 # x\n1 1 0\n3 0 1 2\n", 1, None),
    ],
)
def test_what_artists_and_scanners_write_is_read(name, text, faces, notice, tmp_path):
    (tmp_path / name).write_text(text)
    mesh = read_mesh(tmp_path / name)
    assert mesh.m == faces
    assert len(mesh.loops) == 1
    assert {n.kind for n in mesh.notices} - {NoticeKind.DEFINITION_1} == ({notice} - {None})


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_keeps_float64_in_every_form(form, tmp_path):
    V, F = gallery.flat_rectangle()
    V = V + 1 / 3
    order = ">" if "big" in form else "<"
    header = (
        f"ply\nformat {form} 1.0\nelement vertex {len(V)}\nproperty double x\nproperty double y\n"
        f"property double z\nelement face {len(F)}\nproperty list uchar int vertex_indices\n"
        "end_header\n"
    )
    if form == "ascii":
        rows = [" ".join(map(repr, row)) for row in V.tolist()]
        rows += ["3 " + " ".join(map(str, row)) for row in F.tolist()]
        body = ("\n".join(rows) + "\n").encode()
    else:
        faces = np.zeros(len(F), np.dtype([("k", "u1"), ("i", f"{order}i4", 3)]))
        faces["k"], faces["i"] = 3, F
        body = V.astype(f"{order}f8").tobytes() + faces.tobytes()
    (tmp_path / "a.ply").write_bytes(header.encode() + body)
    mesh = read_mesh(tmp_path / "a.ply")
    np.testing.assert_array_equal(mesh.V, V)
    np.testing.assert_array_equal(mesh.F, F)


@pytest.mark.parametrize("name", ["a.off", "a.stl", "a.xyz"])
def test_uvs_only_go_where_they_fit(name, surface, tmp_path):
    with pytest.raises(MeshError, match=r"allowed here: \.obj, \.ply"):
        write_mesh(tmp_path / name, surface, np.zeros(surface.n, complex))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", WITH_UV)
def test_uvs_may_be_two_columns(suffix, surface, tmp_path):
    """Single precision, lists and integers, too."""
    z = (surface.V[:, 0] + 1j * surface.V[:, 1]).astype(np.complex64)
    for k, uv in enumerate((z, np.column_stack([z.real, z.imag]), [[x.real, x.imag] for x in z])):
        write_mesh(tmp_path / f"{k}{suffix}", surface, uv)
    assert len({(tmp_path / f"{k}{suffix}").read_bytes() for k in range(3)}) == 1
    write_mesh(tmp_path / f"a{suffix}", surface, np.zeros((surface.n, 2), int))


@pytest.mark.parametrize("suffix", WITH_UV)
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda z: z[:-1],
            r"complex128 and shape \(330,\); allowed is .* each of the 331 vertices",
        ),
        (lambda z: z.real, r"float64 and shape \(331,\)"),
        (lambda z: z[:, None], r"shape \(331, 1\)"),
        (lambda z: np.zeros((len(z), 3)), r"shape \(331, 3\)"),
        (lambda z: [str(x) for x in z], "of type <U"),
        (lambda z: np.where(np.arange(len(z)) == 7, np.nan, z), "NaN or infinite at vertex 7 "),
        (lambda z: [[0, 0], [1]] * len(z), "row 1 .* has 1 numbers; allowed is 2 in each"),
    ],
)
def test_other_uvs_are_refused_alike_for_every_format(suffix, change, message, surface, tmp_path):
    with pytest.raises(MeshError, match=rf"a{suffix}: .*{message}"):
        write_mesh(tmp_path / f"a{suffix}", surface, change(surface.V[:, 0] + 0j))
    assert not list(tmp_path.iterdir())


def test_nothing_is_half_written(surface, tmp_path):
    with files_of_at_most(1_000), pytest.raises(MeshError, match="cannot be written: File too"):
        write_mesh(tmp_path / "a.obj", surface)
    assert not list(tmp_path.iterdir())
    with pytest.raises(MeshError, match="there is no folder"):
        write_mesh(tmp_path / "missing" / "a.obj", surface)


def mat(path, **variables):
    savemat(path, variables)
    return path


@pytest.mark.process
def test_matlab_files_count_triangles_from_1(surface, tmp_path):
    path = mat(tmp_path / "a.mat", v=surface.V, f=(surface.F + 1).astype(float))
    again = read_mesh(path, TriangleMesh)
    assert again.hash == surface.hash
    assert again.name == "a"


@pytest.mark.process
@pytest.mark.parametrize(
    ("variables", "words"),
    [
        ({"v": np.zeros((3, 3)), "x": 1}, "'f', and no two of them fit. It has: v (3, 3)."),
        ({"v": np.eye(3), "f": [[0, 1, 2]]}, "'f' must hold whole numbers from 1 on"),
        ({"v": np.eye(3), "f": [[1, 2, 2.5]]}, "'f' must hold whole numbers from 1 on"),
        ({"v": np.eye(3), "f": "text"}, "variable 'f' must be real numbers of shape (rows, 3)"),
        ({"v": np.eye(3), "f": [[1, 2, 4]]}, "index"),
        ({"v": "text", "f": [[1, 2, 3]]}, "variable 'v' must be real numbers of shape (rows, 3)"),
    ],
)
def test_matlab_file_without_a_mesh(variables, words, tmp_path):
    with pytest.raises(MeshError, match=re.escape(words)):
        read_mesh(mat(tmp_path / "a.mat", **variables))


@pytest.mark.process
def test_damaged_matlab_file(tmp_path):
    (tmp_path / "a.mat").write_text("hello")
    with pytest.raises(MeshError, match="cannot be read as MAT"):
        read_mesh(tmp_path / "a.mat")


@pytest.mark.process
def test_matlab_file_of_version_7_3_is_refused_with_the_remedy(tmp_path):
    header = b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM"
    (tmp_path / "a.mat").write_bytes(header + bytes(512))
    with pytest.raises(MeshError, match=r"version 7\.3 are not supported.*'-v7'"):
        read_mesh(tmp_path / "a.mat")


def test_matlab_files_are_not_written(surface, tmp_path):
    with pytest.raises(MeshError, match=r"'\.mat' can be read but not written"):
        write_mesh(tmp_path / "a.mat", surface)
