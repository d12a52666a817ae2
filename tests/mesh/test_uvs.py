"""UVs are read from every format, for vertices and corners, in any order; or it is said why not."""

import re

import numpy as np
import pytest
from scipy.io import savemat

from cembench import MeshError
from cembench.mesh.uvs import OtherSurfaceError, read_flat, read_uv, uv_of_corners

V = np.array([[0, 0, 0.5], [2, 0, 0], [2, 1, 0], [0, 1, 0.25]])
F = np.array([[0, 1, 2], [0, 2, 3]])
UV = np.array([[0, 0], [0.1, 0.3], [1 / 3, 1], [-1, 0.7]])
Z = UV @ [1, 1j]


def lines(rows, start=""):
    return "".join(f"{start}{' '.join(map(repr, row))}\n" for row in np.asarray(rows).tolist())


def obj(V=V, F=F, UV=UV, index=None):
    index = F if index is None else index
    faces = [
        " ".join(f"{v + 1}/{t + 1}" for v, t in zip(*p, strict=True))
        for p in zip(F, index, strict=True)
    ]
    return lines(V, "v ") + lines(UV, "vt ") + "".join(f"f {face}\n" for face in faces)


TEXTS = {
    "a.obj": obj(),
    "separate.obj": obj(UV=UV[F].reshape(-1, 2), index=np.arange(6).reshape(2, 3)),
    "negative.obj": lines(V, "v ") + lines(UV, "vt ") + "f -4/-4 -3/-3 -2/-2\nf 1/1 3/3 4/4\n",
    "polygon.obj": lines(V, "v ") + lines(UV, "vt ") + "f 1/1 2/2 3/3 4/4\n",
    "a.off": f"STOFF\n4 2 0\n{lines(np.c_[V, UV])}{lines(np.c_[[3, 3], F])}",
    "vertices.ply": "ply\nformat ascii 1.0\nelement vertex 4\n"
    + "".join(f"property double {name}\n" for name in ("x", "y", "z", "s", "t"))
    + "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    + lines(np.c_[V, UV])
    + lines(np.c_[[3, 3], F]),
    "corners.ply": "ply\nformat ascii 1.0\nelement vertex 4\n"
    + "".join(f"property double {name}\n" for name in "xyz")
    + "element face 2\nproperty list uchar int vertex_indices\n"
    + "property list uchar double texcoord\nend_header\n"
    + lines(V)
    + "".join(
        f"3 {a} {b} {c} 6 {' '.join(map(repr, UV[[a, b, c]].ravel().tolist()))}\n" for a, b, c in F
    ),
    "a.txt": "# two numbers a line\n" + lines(UV).replace(" ", ", "),
    "corners.txt": lines(UV[F].reshape(-1, 2)),
}


@pytest.mark.parametrize("name", TEXTS)
def test_a_text_gives_the_uv_of_each_corner(tmp_path, name):
    (tmp_path / name).write_text(TEXTS[name])
    assert np.array_equal(uv_of_corners(read_uv(tmp_path / name), V, F), Z[F])


@pytest.mark.process
@pytest.mark.parametrize(
    "arrays", [{"uv": UV}, {"uv": Z}, {"uv": Z[F].ravel(), "fuv": [[0, 1, 2], [3, 4, 5]]}]
)
def test_arrays_give_the_uv_of_each_corner(tmp_path, arrays):
    np.savez(tmp_path / "a.npz", **arrays)
    ones = {k: np.asarray(v) + 1 if k == "fuv" else v for k, v in arrays.items()}
    savemat(tmp_path / "a.mat", ones)
    for name in ("a.npz", "a.mat"):
        assert np.array_equal(uv_of_corners(read_uv(tmp_path / name), V, F), Z[F])


def test_another_order_and_repeated_vertices_are_found_by_their_places(tmp_path):
    """As a program writes it that cut the surface: six vertices, triangles turned and swapped."""
    corners = np.array([[2, 3, 0], [1, 2, 0]])
    text = obj(V[corners.ravel()] + 1e-7, np.arange(6).reshape(2, 3), UV[corners.ravel()])
    (tmp_path / "a.obj").write_text(text)
    assert np.array_equal(uv_of_corners(read_uv(tmp_path / "a.obj"), V, F), Z[F])


def test_a_flattened_surface_has_its_uvs_in_its_vertices(tmp_path):
    (tmp_path / "a.off").write_text(
        f"OFF\n4 2 0\n{lines(np.c_[UV, np.zeros(4)])}3 0 1 2\n3 0 2 3\n"
    )
    assert np.array_equal(uv_of_corners(read_flat(tmp_path / "a.off"), V, F), Z[F])
    (tmp_path / "b.off").write_text(f"OFF\n4 2 0\n{lines(V)}3 0 1 2\n3 0 2 3\n")
    with pytest.raises(MeshError, match="do not lie in the plane"):
        read_flat(tmp_path / "b.off")


@pytest.mark.process
@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.obj", obj(UV=[]), "no UVs"),
        ("a.obj", obj().replace("4/4", "4/9"), "UV number 8"),
        ("a.obj", obj().replace("4/4", "4"), "a corner without a UV"),
        ("a.obj", obj()[:-8] + "\n", "line 10"),
        ("a.obj", obj().replace("vt 0.1", "vt x"), "line 6"),
        ("a.off", TEXTS["a.off"].replace("ST", ""), "STOFF"),
        ("a.off", TEXTS["a.off"].replace("4 2 0", "4 3 0"), "3 faces are declared, but 2 were"),
        ("a.off", TEXTS["a.off"][:-6], "3 numbers are needed, but 0 were"),
        ("a.ply", TEXTS["vertices.ply"].replace("double s", "double q"), "no UVs"),
        ("a.ply", TEXTS["vertices.ply"][:-6], "declares"),
        ("a.txt", "1 2\n3\n", "two numbers per line"),
        ("a.txt", "", "two numbers per line"),
        ("a.mat", "MATLAB", "cannot be read as MAT"),
        ("a.npz", "PK", "cannot be read as NPZ"),
    ],
)
def test_what_is_wrong_with_a_file_is_said(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(MeshError, match=re.escape(message)):
        uv_of_corners(read_uv(tmp_path / name), V, F)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (obj(F=F[:1]), "1 triangles; the surface has 2"),
        (obj(V=V + 1), "vertex 2 (counted from 0) lies"),
        (obj(F=F[:, ::-1]), "other triangles: 2 of 2"),
        (lines(UV[:3]), "3 UVs; required is one for each of the 4 vertices"),
    ],
)
def test_another_surface_is_refused(tmp_path, text, message):
    file = tmp_path / ("a.obj" if "v" in text else "a.txt")
    file.write_text(text)
    with pytest.raises(OtherSurfaceError, match=re.escape(message)):
        uv_of_corners(read_uv(file), V, F)


def test_an_array_of_another_name_is_not_guessed(tmp_path):
    np.savez(tmp_path / "a.npz", texture=UV)
    with pytest.raises(MeshError, match="no array uv"):
        read_uv(tmp_path / "a.npz")
