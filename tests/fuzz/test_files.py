"""The oracle for files: it knows every legal file, and sees what is planted."""

import random
import struct
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.io import savemat

from cembench import MeshError, TriangleMesh
from cembench.mesh.files import read_mesh, write_mesh
from tests import gallery
from tests.campaign.files import judge_file
from tests.campaign.mutations import MUTATIONS, mutate
from tests.campaign.reading import READERS, Damaged
from tests.campaign.seed_files import FAMILIES, seed_file

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n"


@pytest.mark.parametrize("family", FAMILIES)
def test_the_independent_reader_reads_every_legal_file(family):
    for number in range(40):
        file = seed_file(family, random.Random(number))
        content = READERS[file.suffix](file.data)
        assert content.triangles >= 2
        assert len(content.points) >= 4


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".stl"])
def test_the_independent_reader_agrees_on_files_that_the_package_writes(suffix, tmp_path):
    mesh = TriangleMesh.from_arrays(*gallery.annulus())
    path = tmp_path / f"a{suffix}"
    write_mesh(path, mesh)
    content = READERS[suffix](path.read_bytes())
    assert (len(content.points), content.triangles) == (mesh.n, mesh.m)


@pytest.mark.parametrize("mutation", MUTATIONS)
def test_each_mutation_takes_any_bytes_and_repeats_itself(mutation):
    inputs = [b"", b"x", b"\n", bytes(range(256)), SQUARE.encode()]
    inputs += [seed_file(family, random.Random(1)).data for family in FAMILIES]
    made = [MUTATIONS[mutation](data, random.Random(k)) for k, data in enumerate(inputs)]
    again = [MUTATIONS[mutation](data, random.Random(k)) for k, data in enumerate(inputs)]
    assert made == again
    assert any(new != old for new, old in zip(made, inputs, strict=True))


def test_mutations_are_named():
    data, names = mutate(SQUARE.encode(), random.Random(3))
    assert names
    assert set(names) <= set(MUTATIONS)
    assert isinstance(data, bytes)


@pytest.mark.parametrize(
    ("suffix", "text"),
    [
        (".obj", SQUARE.replace("f 1 3 4", "f 1 3")),
        (".obj", SQUARE.replace("f 1 3 4", "f 1 3 9")),
        (".obj", SQUARE.replace("v 1 0 0", "v 1 nan 0")),
        (".obj", SQUARE.replace("v 1 0 0", "v 1 1e999 0")),
        (".off", "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
        (".off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 2\n"),
        (".ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"),
        (".stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"),
        (".mat", "hello"),
    ],
)
def test_the_independent_reader_knows_damage(suffix, text):
    with pytest.raises(Damaged):
        READERS[suffix](text.encode())


PLY = """ply   \nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y
property float z
property uchar red\nelement face 1\nproperty list uchar int vertex_indices\nproperty float quality
end_header\n0 0 0 300\n1 0 0 1.5\n0 1 0 nan\n3 0 1 2 1e400\n"""

STL = """solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0
endloop\nendfacet\nendsolid a\n"""


@pytest.mark.parametrize(
    ("suffix", "text"),
    [
        (".obj", SQUARE.replace("v 1 0 0", "v\t1\v0\f0")),
        (".off", "COFF\n3 1 0\n0 0 0 1\n1 0 0 nan\n0 1 0 1e400\n3 0 1 2 -inf\n"),
        (".ply", PLY),
        (".ply", PLY.replace("1 0 0 1.5", "1\f0\v0 1.5")),
        (".stl", STL.replace("1 0 0", "1\f0\v0")),
    ],
)
def test_what_nobody_reads_and_any_white_space_is_no_damage(suffix, text, tmp_path):
    path = tmp_path / f"a{suffix}"
    path.write_text(text)
    read = judge_file(path, lambda path: read_mesh(path, TriangleMesh), legal=True)
    assert (read.outcome, read.fault) == ("mesh", None)


@pytest.mark.parametrize(
    ("name", "after", "length", "outcome"),
    [
        (b"note", 8, 2**32 - 1, "mesh"),  # of numbers that nobody reads
        (b"v\0\0\0", -32, 10, "mesh"),  # of flags, which always have eight bytes
        (b"f\0\0\0", 8, 2**32 - 1, "refused"),
        (b"f\0\0\0", -12, 2**32 - 1, "refused"),  # -1 rows, which a reader could make fit
    ],
)
def test_a_wrong_length_within_mat_counts_where_it_loses_something(
    name, after, length, outcome, tmp_path
):
    path = tmp_path / "a.mat"
    V, F = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[1, 2, 3]], np.int32)
    savemat(path, {"note": np.array([[1.0, 2.0]]), "v": V, "f": F})
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, data.index(name) + after, length)
    path.write_bytes(data)
    read = judge_file(path, lambda path: read_mesh(path, TriangleMesh), legal=False)
    assert (read.outcome, read.fault) == (outcome, None)


@pytest.mark.parametrize("wanted", [False, True])
def test_a_compressed_variable_that_cannot_be_read_is_damage_if_it_is_wanted(wanted, tmp_path):
    path = tmp_path / "a.mat"
    V, F = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[1, 2, 3]], np.int32)
    content = {"note": np.array([[1.0, 2.0]]), "v": V, "f": F}
    savemat(path, content, do_compression=True)
    data, at = bytearray(path.read_bytes()), 128
    if wanted:
        at += 8 + struct.unpack_from("<I", data, at + 4)[0]
    data[at + 12] ^= 0xFF
    with pytest.raises(Damaged) if wanted else nullcontext():
        assert READERS[".mat"](bytes(data)).polygons == [(0, 1, 2)]


def reading(change=lambda V, F: (V, F)):
    """A reader that is right but for a change."""

    def read(path):
        content = READERS[path.suffix](path.read_bytes())
        V, F = change(np.array(content.points), np.array(content.polygons))
        return SimpleNamespace(V=V, F=F)

    return read


def planted(path, exception):
    def read(path):
        raise exception

    return judge_file(path, read, legal=False)


@pytest.fixture
def square(tmp_path):
    path = tmp_path / "a.obj"
    path.write_text(SQUARE)
    return path


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda V, F: (V, F), None),
        (lambda V, F: (V, F[:, [1, 2, 0]][::-1]), None),
        (lambda V, F: (V, F[:-1]), "silent loss"),
        (lambda V, F: (V[:-1], F[:-1]), "silent loss"),
        (lambda V, F: (V, np.concatenate([F, F[:1]])), "silent loss"),
        (lambda V, F: (V[::-1], F), "other triangles"),
        (lambda V, F: (V + np.array([0, 0, 1]), F), "other triangles"),
        (lambda V, F: (V, np.array([[0, 1, 2], [0, 1, 3]])), "other triangles"),
    ],
)
def test_a_reader_that_loses_or_changes_something_is_found(change, fault, square):
    assert judge_file(square, reading(change), legal=True).fault == fault


def test_a_reader_that_takes_a_damaged_file_is_found(square):
    square.write_text(SQUARE + "f 2 3\n")
    verdict = judge_file(square, lambda path: SimpleNamespace(V=np.eye(3), F=[[0, 1, 2]]), legal=0)
    assert verdict.fault == "silent loss"
    assert "2 corners" in verdict.detail


def test_refusals_need_a_message_and_a_reason(square):
    assert planted(square, MeshError("it is damaged")).fault is None
    assert planted(square, MeshError("")).fault == "no message"
    assert planted(square, KeyError("f")).fault == "traceback"

    def refuse(path):
        raise MeshError("a tab")

    assert judge_file(square, refuse, legal=True).fault == "legal file refused"


def test_the_package_reads_what_the_oracle_takes(square):
    verdict = judge_file(square, lambda path: read_mesh(path, TriangleMesh), legal=True)
    assert (verdict.outcome, verdict.fault) == ("mesh", None)
