"""Which files are read, that none of their faces is lost, and that damaged ones are refused."""

import os
import re
import socket
import struct

import numpy as np
import pytest
from scipy.io import savemat

from cembench import MeshError
from cembench.mesh.files import read_soup
from tests.independent_reader import counts
from tests.real_meshes import FOLDER

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]])
ROWS = [f"{x:g} {y:g} {z:g}" for x, y, z in POINTS]
TRIANGLES = [[0, 1, 2], [0, 2, 3]]
QUAD = [[0, 1, 2, 3]]
MIXED = [[0, 1, 2], [0, 1, 2, 3], [3, 2, 1]]

OBJ = "".join(f"v {row}\n" for row in ROWS)
OFF = "".join(f"{row}\n" for row in ROWS)
XYZ = "property float x\nproperty float y\nproperty float z\n"
CORNERS = "property list uchar int vertex_indices\n"
TWO = "3 0 1 2\n3 0 2 3\n"
EDGE = "element edge 1\nproperty int vertex1\nproperty int vertex2\n"


def ply(*, vertex=XYZ, rows=OFF, face=CORNERS, faces=TWO, count=2, first=("", ""), last=("", "")):
    return (
        f"ply\nformat ascii 1.0\ncomment made by hand\n{first[0]}element vertex 4\n{vertex}"
        f"element face {count}\n{face}{last[0]}end_header\n{first[1]}{rows}{faces}{last[1]}"
    )


PLY_TYPES = {"i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint"}


def binary_ply(polygons, *, order="<", size="u1", item="i4", point="f8", more=b"", declared=None):
    """A binary PLY whose faces have a scalar before their corners, and `more` behind them."""
    coordinate = {"f4": "float", "f8": "double"}[point]
    header = (
        f"ply\nformat binary_{'little' if order == '<' else 'big'}_endian 1.0\nelement vertex 4\n"
        + "".join(f"property {coordinate} {axis}\n" for axis in "xyz")
        + f"element face {len(polygons) if declared is None else declared}\n"
        f"property list {PLY_TYPES[size]} {PLY_TYPES[item]} vertex_index\n"
        + "".join(f"property uchar extra{k}\n" for k in range(len(more)))
        + "end_header\n"
    )
    body = POINTS.astype(order + point).tobytes()
    for corners in polygons:
        body += np.array(len(corners), order + size).tobytes()
        body += np.array(corners, order + item).tobytes() + more
    return header.encode() + body


def binary_stl(count=2, declared=None):
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    triangles = np.zeros(count, record)
    triangles["corners"] = POINTS[TRIANGLES][:count]
    head = b"solid from a program that begins binary files like this".ljust(80)
    return head + struct.pack("<I", count if declared is None else declared) + triangles.tobytes()


def ascii_stl():
    facets = "".join(
        "facet normal 0 0 1\n outer loop\n"
        + "".join(f"  vertex {ROWS[k]}\n" for k in corners)
        + " endloop\nendfacet\n"
        for corners in TRIANGLES
    )
    return f"solid some name\n{facets}endsolid some name\n"


#: Name -> content and the polygons that it holds.
LEGAL = {
    "tabs.obj": (OBJ + "f\t1 2\t3\nf\t1\t3\t4\n", TRIANGLES),
    "vertices-with-tabs.obj": (OBJ.replace(" ", "\t") + "f 1 2 3\n", TRIANGLES[:1]),
    "comments.obj": (OBJ + "f 1 2 3 # one\nf 1 3 4# two\n#f 1 2 4\n", TRIANGLES),
    "continued.obj": (OBJ + "f 1 2 \\\n 3 \\\n4\nf 1 2\\\n 3\n", [QUAD[0], TRIANGLES[0]]),
    "continued-crlf.obj": ((OBJ + "f 1 2 \\\n 3\n").replace("\n", "\r\n"), TRIANGLES[:1]),
    "folder.obj": ("# C:\\meshes\\\n" + OBJ + "o C:\\\nf 1 2 3\n", TRIANGLES[:1]),
    "relative.obj": (OBJ + "f -4 -3 -2\nf -4 -2 -1", TRIANGLES),
    "relative-between.obj": (
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 .5\nf -4 -2 -1\n",
        TRIANGLES,
    ),
    "seams.obj": (OBJ + "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nf 1//1 3//1 4//1\n", TRIANGLES),
    "some-seams.obj": (OBJ + "vt 0 0\nf 1/1 2/ 3\n", TRIANGLES[:1]),
    "groups.obj": (
        "mtllib a b.mtl\no a\ng b\ns off\nusemtl c\n" + OBJ + "f 1 2 3\ng d\nl 1 2\nf 1 3 4\np 1\n",
        TRIANGLES,
    ),
    "crlf.obj": ((OBJ + "f 1 2 3\nf 1 3 4\n").replace("\n", "\r\n"), TRIANGLES),
    "cr.obj": ((OBJ + "f 1 2 3\nf 1 3 4\n").replace("\n", "\r"), TRIANGLES),
    "mark.obj": (b"\xef\xbb\xbf" + (OBJ + "f 1 2 3").encode(), TRIANGLES[:1]),
    "latin.obj": (b"# caf\xe9\no \xff\xfe\n" + (OBJ + "f 1 2 3").encode(), TRIANGLES[:1]),
    "mixed.obj": (OBJ + "f 1 2 3\nf 1 2 3 4\nf 4 3 2\n", MIXED),
    "colours.obj": (OBJ.replace("\n", " 1 0 0.5\n") + "f 1 2 3\n", TRIANGLES[:1]),
    "weights.obj": (OBJ.replace("\n", " 1.0\n") + "f 1 2 3\n", TRIANGLES[:1]),
    "indented.obj": (OBJ + "  f 1 2 3\n\tf 1 3 4", TRIANGLES),
    "faces-first.obj": ("f 1 2 3\n" + OBJ, TRIANGLES[:1]),
    "old-keyword.obj": (OBJ + "fo 1 2 3\n", TRIANGLES[:1]),
    "plain.off": ("OFF\n4 2 0\n" + OFF + TWO, TRIANGLES),
    "mixed.off": ("OFF\n4 3 0\n" + OFF + "3 0 1 2\n4 0 1 2 3\n3 3 2 1\n", MIXED),
    "colours.off": ("OFF\n4 2 5\n" + OFF + "3 0 1 2 255 0 0\n3 0 2 3 0 0.5 0\n", TRIANGLES),
    "vertex-colours.off": ("COFF\n4 2 0\n" + OFF.replace("\n", " 1 0 0 1\n") + TWO, TRIANGLES),
    "normals.off": ("NOFF\n4 2 0\n" + OFF.replace("\n", " 0 0 1\n") + TWO, TRIANGLES),
    "all.off": ("STCNOFF\n4 2 0\n" + OFF.replace("\n", " 0 0 1 1 1 1 1 0 0\n") + TWO, TRIANGLES),
    "one-line.off": ("OFF 4 2 0\n" + OFF + TWO, TRIANGLES),
    "no-word.off": ("4 2 0\n" + OFF + TWO, TRIANGLES),
    "comments.off": ("OFF # x\n# y\n\n4 2 0 # z\n\n" + OFF + "# w\n" + TWO.strip(), TRIANGLES),
    "crlf.off": (("OFF\n4 2 0\n" + OFF + TWO).replace("\n", "\r\n"), TRIANGLES),
    "mark.off": (b"\xef\xbb\xbfOFF\n4 2 0\n" + (OFF + TWO).encode(), TRIANGLES),
    "plain.ply": (ply(), TRIANGLES),
    "crlf.ply": (ply().replace("\n", "\r\n"), TRIANGLES),
    "cr.ply": (ply().replace("\n", "\r"), TRIANGLES),
    "no-newline.ply": (ply().strip(), TRIANGLES),
    "edges-last.ply": (ply(last=(EDGE, "0 1\n")), TRIANGLES),
    "edges-first.ply": (ply(first=(EDGE, "0 1\n")), TRIANGLES),
    "no-edges.ply": (ply(last=(EDGE.replace("1", "0", 1), "")), TRIANGLES),
    "property-after.ply": (
        ply(face=CORNERS + "property uchar red\n", faces="3 0 1 2 7\n3 0 2 3 8\n"),
        TRIANGLES,
    ),
    "property-before.ply": (
        ply(face="property float q\n" + CORNERS, faces="0.5 3 0 1 2\n9 3 0 2 3\n"),
        TRIANGLES,
    ),
    "normals-first.ply": (
        ply(
            vertex=XYZ.replace(" x", " nx").replace(" y", " ny").replace(" z", " nz") + XYZ,
            rows="".join(f"0 0 1 {row}\n" for row in ROWS),
        ),
        TRIANGLES,
    ),
    "turned-axes.ply": (
        ply(
            vertex="property float z\nproperty double x\nproperty float y\n",
            rows="".join(f"{z} {x} {y}\n" for x, y, z in POINTS),
        ),
        TRIANGLES,
    ),
    "uint.ply": (ply(face="property list uchar uint vertex_index\n"), TRIANGLES),
    "ushort.ply": (ply(face="property list ushort ushort vertex_indices\n"), TRIANGLES),
    "new-names.ply": (
        ply(
            vertex=XYZ.replace("float", "float64"), face="property list uint8 int32 vertex_index\n"
        ),
        TRIANGLES,
    ),
    "texture-after.ply": (
        ply(
            face=CORNERS + "property list uchar float texcoord\n",
            faces="3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 0 0 1 1 0 1\n",
        ),
        TRIANGLES,
    ),
    "texture-before.ply": (
        ply(
            face="property list uchar float texcoord\n" + CORNERS,
            faces="6 0 0 1 0 1 1 3 0 1 2\n0 3 0 2 3\n",
        ),
        TRIANGLES,
    ),
    "mixed.ply": (ply(count=3, faces="3 0 1 2\n4 0 1 2 3\n3 3 2 1\n"), MIXED),
    "list-of-vertex.ply": (
        ply(
            vertex="property list uchar int k\n" + XYZ,
            rows="1 9 " + "0 ".join(OFF.splitlines(True)),
        ),
        TRIANGLES,
    ),
    "binary-mixed.ply": (binary_ply(MIXED), MIXED),
    "binary-mixed-more.ply": (binary_ply(MIXED, order=">", more=b"\x03\x00"), MIXED),
    "binary-newline.ply": (binary_ply(TRIANGLES) + b"\n", TRIANGLES),
    "binary-single.ply": (binary_ply(TRIANGLES, point="f4"), TRIANGLES),
    "plain.stl": (ascii_stl(), TRIANGLES),
    "capitals.stl": (ascii_stl().upper(), TRIANGLES),
    "no-name.stl": (ascii_stl().replace(" some name", "").replace("\n", "\r\n"), TRIANGLES),
    "two-solids.stl": (ascii_stl() + ascii_stl(), TRIANGLES * 2),
    "binary.stl": (binary_stl(), TRIANGLES),
} | {
    f"binary-{order}-{size}-{item}.ply": (
        binary_ply(TRIANGLES, order={"little": "<", "big": ">"}[order], size=size, item=item),
        TRIANGLES,
    )
    for order in ("little", "big")
    for size in ("u1", "u2", "i4")
    for item in PLY_TYPES
}


def write(folder, name, content):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("name", LEGAL)
def test_legal_files_keep_every_vertex_and_face(name, tmp_path):
    content, polygons = LEGAL[name]
    path = write(tmp_path, name, content)
    soup = read_soup(path)
    np.testing.assert_array_equal(soup.V, POINTS)
    assert soup.sizes.tolist() == [len(polygon) for polygon in polygons]
    assert soup.corners.tolist() == np.concatenate(polygons).tolist()
    assert not soup.notices
    assert soup.name == path.stem
    vertices, faces = counts(path)
    assert (vertices or len(POINTS), faces) == (len(soup.V), len(soup.sizes))


@pytest.mark.parametrize(
    "name", ["tabs.obj", "mixed.off", "texture-after.ply", "binary-mixed.ply", "binary.stl"]
)
def test_a_file_cut_anywhere_is_refused_or_whole(name, tmp_path):
    content, polygons = LEGAL[name]
    whole = content if isinstance(content, bytes) else content.encode()
    cut = tmp_path / name
    for size in range(1, len(whole)):
        cut.write_bytes(whole[:size])
        try:
            soup = read_soup(cut)
        except MeshError:
            continue
        # Of an OBJ nobody can know how many faces there were, but those that are there are read.
        text = whole[:size].decode("latin-1").rstrip()
        listed = len(re.findall("^f", text, re.MULTILINE))
        assert len(soup.sizes) == (listed if name.endswith(".obj") else len(polygons)), size
        if not name.endswith(".obj"):
            assert not whole[size:].strip() or whole[size:].strip().isdigit(), size


DAMAGED = {
    "corner-missing.obj": (
        OBJ + "f 1 2 3\nf 1 2",
        r"line 6, 'f 1 2': a face needs 3 corners, .* 2",
    ),
    "number-missing.obj": (OBJ + "f 1 2 3\nv 0.1 0.", r"line 6, .* a vertex needs 3 numbers"),
    "not-there.obj": (OBJ + "f 1 2 3\nf 1 2 5\n", r"face 1 .* index out of range, 5; .* 1 to 4"),
    "too-far-back.obj": (OBJ + "f -1 -2 -5\n", r"line 5, .* out of range.* -1 to -4"),
    "zero.obj": (OBJ + "f 0/1 1 2\n", r"line 5, .* index out of range; allowed are 1 to"),
    "merged-vertices.obj": ("v 0 0 0 v 1 0 0\nf 1 1 1\n", r"line 1, .* 'v'"),
    "merged-faces.obj": (OBJ + "f 1 2 3 f 1 3 4\n", r"line 5, .* 'f'"),
    "underscore.obj": (OBJ + "f 1 2 0_3\n", r"line 5, .* underscore"),
    "huge-index.obj": (OBJ + "f 1 2 99999999999999999999\n", r"line 5"),
    "continued-comment.obj": (OBJ + "f 1 2 \\ # more\n3\n", r"line 5"),
    "fraction.obj": (OBJ + "f 1 2 3.5\n", r"line 5, .* '3\.5'"),
    "few-faces.off": ("OFF\n4 3 0\n" + OFF + TWO, "3 faces are declared, but 2 were found"),
    "cut-polygon.off": ("OFF\n4 2 0\n" + OFF + "4 0 1 2 3\n", "2 faces .* but 1 were found"),
    "cut-line.off": ("OFF\n4 2 0\n" + OFF + "3 0 1 2\n3 0 2\n", "line 8, .* 3 numbers .* 2 were"),
    "few-vertices.off": ("OFF\n4 1 0\n0 0 0\n", "4 vertices are declared, but 1 were found"),
    "more.off": ("OFF\n4 1 0\n" + OFF + TWO, "4 vertices and 1 faces .* continues at line 8"),
    "negative.off": ("OFF\n4 -1 0\n" + OFF, "-1 faces are declared"),
    "no-counts.off": ("OFF\n", "no line with the numbers"),
    "binary.off": (b"OFF BINARY\n\0\0\0\4", "'OFF BINARY' are not supported"),
    "four.off": ("4OFF\n4 1 0\n", "'4OFF' are not supported"),
    "few-corners.off": ("OFF\n4 1 0\n" + OFF + "2 0 1\n", "face 0 .* has 2 corners"),
    "huge-index.off": (
        "OFF\n4 1 0\n" + OFF + "3 0 1 99999999999999999999\n",
        "line 7, .* too large for a vertex index",
    ),
    "huge-size.off": ("OFF\n4 1 0\n" + OFF + "-99999999999999999999 0\n", "line 7, .* too large"),
    "colour.off": ("OFF\n4 2 0\n" + OFF + "3 0 1 2 255 x\n3 0 2 3\n", "line 7, .* 'x'"),
    "header-cut.ply": (ply()[:60], "header has no end"),
    "header-word.ply": (
        ply().replace("element face", "elemont face"),
        "line 8 .* 'elemont face 2'",
    ),
    "header-type.ply": (ply().replace("uchar int", "uchar quad"), "line 9 .* uchar quad"),
    "header-count.ply": (ply().replace("face 2", "face -2"), "line 8 .* 'element face -2'"),
    "float-size.ply": (ply(face="property list float int vertex_index\n"), "line 9"),
    "few-faces.ply": (
        ply(count=3),
        "declares 3 of 'face', but the file ends within 'face' 2",
    ),
    "many-faces.ply": (
        ply(count=10**17),
        "take at least 1000000+12 numbers, but 20 numbers follow",
    ),
    "more-faces.ply": (ply(count=1), "4 of 'vertex', 1 of 'face', but 4 numbers more follow"),
    "cut-row.ply": (ply(faces="3 0 1 2\n3 0 2\n"), "ends within 'face' 1"),
    "not-a-number.ply": (
        ply(faces="3 0 1 2\n3 0 x 3\n"),
        "line 16, '3 0 x 3': 'x' is not a number",
    ),
    "list-size.ply": (ply(faces="3 0 1 2\n-3 0 2 3\n"), "'vertex_indices' of 'face' 1 .* -3"),
    "fraction.ply": (ply(faces="3 0 1 2\n3 0 2.5 3\n"), r"vertex index 2\.5 is not a whole number"),
    "no-x.ply": (ply(vertex=XYZ.replace(" x", " q")), "'vertex' has no property 'x'"),
    "no-corners.ply": (
        ply(face="property list uchar int q\n"),
        "no property 'vertex_indices' that",
    ),
    "twice.ply": (ply(last=("element face 0\n", "")), "more than once: element 'face'"),
    "property-twice.ply": (
        ply(vertex=XYZ + "property double y\n"),
        "more than once: property 'y' of 'vertex'",
    ),
    "first-list-size.ply": (
        binary_ply(TRIANGLES, size="i1").replace(b"\3\0\0\0\0", b"\xff\0\0\0\0", 1),
        "'vertex_index' of 'face' 0 .* -1",
    ),
    "strips.ply": (
        ply(last=("element tristrips 1\nproperty list int int k\n", "3 0 1 2\n")),
        "triangle strips are not supported",
    ),
    "no-faces.ply": (ply(count=0, faces=""), "no faces: 4 vertices"),
    "cut-at-a-face.ply": (binary_ply(TRIANGLES)[:-13], r"2 of 'face', which take|within 'face' 1"),
    "cut-in-vertices.ply": (binary_ply(TRIANGLES)[:-80], "but 42 bytes follow"),
    "more-binary.ply": (binary_ply(TRIANGLES, declared=1), "1 of 'face', but 13 bytes more follow"),
    "nothing.ply": (binary_ply(TRIANGLES).partition(b"end_header")[0] + b"end_header\n", "0 bytes"),
    "cut.stl": (binary_stl()[:-50], "2 triangles are declared, but the file holds 1"),
    "cut-inside.stl": (binary_stl()[:-20], "2 .* but the file holds 1 and 30 bytes more"),
    "more.stl": (binary_stl(declared=1), "1 triangles are declared, but the file holds 2"),
    "cut-ascii.stl": (ascii_stl()[:-30], "line 14, 'endloo': expected is 'endloop'"),
    "no-end.stl": (ascii_stl().rpartition("endsolid")[0], "solid, after 2 whole triangles"),
    "two-corners.stl": (ascii_stl().replace("  vertex 1 1 0\n", "", 1), "line 6, 'endloop'"),
    "bad-number.stl": (ascii_stl().replace("1 1 0", "1 1", 1), "line 6, .* 3 numbers"),
    "bytes.stl": (b"\1\2\3", "3 bytes"),
}


@pytest.mark.parametrize("name", DAMAGED)
def test_damaged_files_are_refused_with_what_was_found(name, tmp_path):
    content, message = DAMAGED[name]
    path = write(tmp_path, name, content)
    with pytest.raises(MeshError) as error:
        read_soup(path)
    assert str(error.value).startswith(f"{path}: ")
    assert re.search(message, str(error.value)), error.value


@pytest.mark.parametrize("text", ["F 1 2 3\n", "f1 2 3\n", "face 1 2 3\n", "1 2 3\n"])
def test_lines_that_are_not_obj_are_reported(text, tmp_path):
    soup = read_soup(write(tmp_path, "a.obj", OBJ + "f 1 2 3\n" + text))
    (notice,) = soup.notices
    assert notice.text.endswith(f"OBJ were ignored: 1, the first: line 6, {text.strip()!r}")


@pytest.mark.process
@pytest.mark.usefixtures("forked_readers")
def test_matlab_files_cut_anywhere_are_refused(tmp_path):
    for compressed in (False, True):
        savemat(
            tmp_path / "whole.mat",
            {"v": POINTS, "f": np.array(TRIANGLES) + 1.0, "name": "text"},
            do_compression=compressed,
        )
        whole = (tmp_path / "whole.mat").read_bytes()
        assert read_soup(tmp_path / "whole.mat").corners.tolist() == np.ravel(TRIANGLES).tolist()
        for size in range(1, len(whole), 7):
            try:
                soup = read_soup(write(tmp_path, "cut.mat", whole[:size]))
            except MeshError:
                continue
            assert soup.V.tolist() == POINTS.tolist()
            assert soup.corners.tolist() == np.ravel(TRIANGLES).tolist()


@pytest.mark.process
def test_a_matlab_file_cut_within_a_variable_that_nobody_wants_is_refused(tmp_path):
    arrays = {"v": POINTS, "f": np.array(TRIANGLES) + 1.0, "name": "text"}
    savemat(tmp_path / "a.mat", arrays)
    (tmp_path / "a.mat").write_bytes((tmp_path / "a.mat").read_bytes()[:-8])
    with pytest.raises(MeshError, match="as MAT: it was cut short"):
        read_soup(tmp_path / "a.mat")


@pytest.mark.process
def test_matlab_files_of_version_4_are_refused_with_the_remedy(tmp_path):
    savemat(tmp_path / "a.mat", {"v": POINTS, "f": np.array(TRIANGLES) + 1.0}, format="4")
    with pytest.raises(MeshError, match=r"version 4 are not supported.*'-v7'"):
        read_soup(tmp_path / "a.mat")


def test_what_is_not_a_file_is_refused_at_once(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # a socket's name must be short
    os.mkfifo("pipe.obj")
    (tmp_path / "folder.obj").mkdir()
    (tmp_path / "link.obj").symlink_to("nowhere.obj")
    (tmp_path / "loop.obj").symlink_to("loop.obj")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind("socket.obj")
        for name, message in {
            "pipe.obj": "this is a pipe, not a file",
            "folder.obj": "this is a folder, not a file",
            "socket.obj": "this is a socket, not a file",
            "/dev/null": "this is a device, not a file",
            "-": "standard input cannot be read as a mesh. Save it to a file",
            "link.obj": r"a symbolic link to nowhere.obj, which does not exist\.[^.]* to [^?]*\.$",
            "loop.obj": "the file cannot be read",
            "x" * 300 + ".obj": "the file cannot be read",
            "a\0b.obj": "cannot be a file name",
            "missing.obj": "there is no such file",
            "pipe.obj/a.obj": "there is no such file",
        }.items():
            with pytest.raises(MeshError, match=message):
                read_soup(name)


def test_unreadable_files_are_refused(tmp_path, monkeypatch):
    path = write(tmp_path, "a.obj", OBJ)

    def refuse(*arguments, **named):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.open", refuse)  # the tests may run as root, who may read all
    with pytest.raises(MeshError, match=r"cannot be read \(Permission denied\)"):
        read_soup(path)


def test_real_meshes_are_read_whole():
    paths = sorted(path for path in FOLDER.glob("*/*.*") if path.suffix in (".obj", ".off", ".ply"))
    paths = [path for path in paths if path.stat().st_size < 1_500_000]
    if not paths:
        pytest.skip("NOT CHECKED: no real meshes are there; set CEMBENCH_TEST_MESHES")
    for path in paths:
        soup = read_soup(path)
        assert counts(path) == (len(soup.V), len(soup.sizes)), path
        assert not soup.notices


MUTANTS = [name for name in LEGAL if "binary-" not in name or "mixed" in name]


@pytest.mark.parametrize("seed", range(3))
def test_mutated_files_raise_nothing_else_and_lose_no_face_in_silence(seed, tmp_path):
    random = np.random.default_rng(seed)
    for name in MUTANTS:
        content = LEGAL[name][0]
        data = bytearray(content if isinstance(content, bytes) else content.encode())
        for _ in range(random.integers(1, 4)):
            at = random.integers(len(data))
            match random.integers(4):
                case 0:
                    data[at] = random.integers(256)
                case 1:
                    del data[at : at + random.integers(1, 9)]
                case 2:
                    data[at:at] = data[at : at + random.integers(1, 9)]
                case 3:
                    del data[at + 1 :]
        path = write(tmp_path, name, bytes(data))
        try:
            soup = read_soup(path)
        except MeshError:
            continue
        assert (soup.sizes >= 3).all()
        assert len(soup.corners) == soup.sizes.sum()
        assert soup.notices or counts(path)[1] == len(soup.sizes), path.read_bytes()


@pytest.mark.parametrize("odd", ["\x1d", "\x85", "\xa0"])
def test_only_ascii_spaces_part_numbers(tmp_path, odd):
    file = tmp_path / "a.off"
    file.write_bytes(f"OFF\n3 1 0\n0 0 0\n1 0 0\n0{odd}1 0\n3 0 1 2\n".encode("latin-1"))
    with pytest.raises(MeshError, match="line 5"):
        read_soup(file)


def test_lines_of_a_text_ply_that_changed_places_are_no_mesh(tmp_path):
    camera = ("element camera 1\nproperty float view\n", "1.5\n")
    rows = OFF.splitlines(keepends=True)
    text = ply(first=camera)
    (tmp_path / "a.ply").write_text(text)
    assert len(read_soup(tmp_path / "a.ply").V) == 4
    # Read one after another there are as many numbers as before.
    (tmp_path / "b.ply").write_text(
        ply(first=(camera[0], rows[2]), rows=OFF.replace(rows[2], "1.5\n"))
    )
    with pytest.raises(MeshError, match=r"'camera' 0 .* has 3 numbers on its line; .* declares 1"):
        read_soup(tmp_path / "b.ply")
    short = OFF.replace(rows[1], " ".join(rows[1].split()[:2]) + "\n").replace(
        rows[2], "9 " + rows[2]
    )
    (tmp_path / "c.ply").write_text(ply(rows=short))
    with pytest.raises(MeshError, match=r"'vertex' 1 .* has 2 numbers on its line; .* declares 3"):
        read_soup(tmp_path / "c.ply")
    # A row may go over several lines, and several rows on one.
    (tmp_path / "d.ply").write_text(ply(rows=OFF.replace(" ", "\n")))
    assert len(read_soup(tmp_path / "d.ply").V) == 4
