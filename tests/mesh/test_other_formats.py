"""MAT files with any two arrays that fit, subsets, and the formats that other libraries read."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from scipy.io import savemat

from cembench.core.errors import MeshError
from cembench.core.extras import Extra, MissingExtra
from cembench.core.notices import NoticeKind
from cembench.mesh import files
from cembench.mesh.files import read_mesh, read_soup, write_mesh
from cembench.mesh.formats import isolated
from cembench.mesh.triangle_mesh import TriangleMesh

pytestmark = pytest.mark.process


@pytest.fixture(scope="module")
def disk():
    mesh = flat_disk(120)
    rng = np.random.default_rng(0)
    return mesh.moved(mesh.V + 0.01 * rng.standard_normal(mesh.V.shape))


@pytest.mark.parametrize("names", [("v2", "f2"), ("Vertices", "Triangles"), ("a", "b")])
def test_two_arrays_that_fit_are_found_among_others(disk, tmp_path, names):
    others = {"uv": np.zeros((disk.n, 2)), "text": "abc", "colours": np.ones((7, 3)) / 3}
    savemat(tmp_path / "x.mat", {names[0]: disk.V, names[1]: disk.F + 1, **others})
    mesh = read_mesh(tmp_path / "x.mat", TriangleMesh, arrays=names)
    assert mesh.hash == disk.hash
    mesh = read_mesh(tmp_path / "x.mat", TriangleMesh)  # the uv fit too, but are flat
    assert mesh.hash == disk.hash
    assert NoticeKind.ARRAYS_GUESSED in {n.kind for n in mesh.notices}


def test_two_meshes_in_a_file_need_names(disk, tmp_path):
    small = flat_disk(40)
    arrays = {"v1": disk.V, "f1": disk.F + 1, "v2": small.V, "f2": small.F + 1}
    savemat(tmp_path / "two.mat", arrays, do_compression=True)
    mesh = read_mesh(tmp_path / "two.mat", TriangleMesh, arrays=("v2", "f2"))
    assert mesh.hash == small.hash
    with pytest.raises(MeshError, match=r"several pairs fit: v1 and f1; v2 and f2.*arrays="):
        read_mesh(tmp_path / "two.mat", TriangleMesh)
    with pytest.raises(MeshError, match="there is no variable 'v3'; it has: v1, f1, v2, f2"):
        read_mesh(tmp_path / "two.mat", TriangleMesh, arrays=("v3", "f2"))
    with pytest.raises(MeshError, match="index out of range"):
        read_mesh(tmp_path / "two.mat", TriangleMesh, arrays=("v2", "f1"))


@pytest.mark.parametrize("save", [np.savez, savemat])
def test_names_of_what_a_file_does_not_hold_are_answered_with_those_it_holds(save, tmp_path):
    path = tmp_path / ("a.npz" if save is np.savez else "a.mat")
    arrays = {"v": np.eye(3), "f": [[1, 2, 3]], "x": np.zeros((2, 2, 2))}
    save(path, **arrays) if save is np.savez else save(path, arrays)
    with pytest.raises(MeshError, match=r"no variable 'p'; it has: v, f, x\. Name two"):
        read_mesh(path, TriangleMesh, arrays=("p", "t"))
    with pytest.raises(MeshError, match=r"'x' must be real numbers of shape \(rows, 3\)"):
        read_mesh(path, TriangleMesh, arrays=("x", "f"))


def test_flat_vertices_get_a_height_of_0(disk, tmp_path):
    savemat(tmp_path / "flat.mat", {"p": disk.V[:, :2], "t": disk.F + 1})
    assert not read_mesh(tmp_path / "flat.mat", TriangleMesh).V[:, 2].any()


def test_arrays_are_named_for_files_of_arrays_only(disk, tmp_path):
    write_mesh(tmp_path / "a.obj", disk)
    with pytest.raises(MeshError, match=r"arrays can be named only for \.mat, \.npz files"):
        read_mesh(tmp_path / "a.obj", arrays=("v", "f"))


def test_a_subset_of_polygons_leaves_out_the_other_vertices(tmp_path):
    (tmp_path / "a.obj").write_text(
        "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 2 3 4 5\nf 3 6 4\n"
    )
    soup = read_soup(tmp_path / "a.obj", polygons=(1, 2))
    assert soup.sizes.tolist() == [4, 3]
    assert soup.corners.tolist() == [0, 1, 2, 3, 1, 4, 2]
    assert soup.V[:, 0].tolist() == [0, 1, 1, 0, 2]
    for wrong in ((0, 3), (2, 1), (-1, 0)):
        with pytest.raises(MeshError, match="it has 3, counted from 0"):
            read_soup(tmp_path / "a.obj", polygons=wrong)


def test_our_own_npz_is_read_bit_by_bit(disk, tmp_path):
    write_mesh(tmp_path / "a.npz", disk, disk.V[:, 0] + 1j * disk.V[:, 1])
    assert read_mesh(tmp_path / "a.npz", TriangleMesh).hash == disk.hash


def test_an_npz_that_is_none(tmp_path):
    for content in (b"hello", b"PK\x03\x04" + bytes(40)):
        (tmp_path / "a.npz").write_bytes(content)
        with pytest.raises(MeshError, match="cannot be read as NPZ"):
            read_mesh(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", x=np.array([object()]))
    with pytest.raises(MeshError, match="cannot be read as NPZ"):
        read_mesh(tmp_path / "b.npz")


def write_by_meshio(path, disk):
    meshio = pytest.importorskip("meshio")
    cells = [("line", [[0, 1]]), ("triangle", disk.F[:40]), ("triangle", disk.F[40:])]
    binary = {"binary": True} if path.suffix == ".vtk" else {}
    meshio.write(path, meshio.Mesh(disk.V, cells), **binary)


@pytest.mark.parametrize("name", ["a.vtk", "a.vtu"])
def test_vtk_files_keep_every_triangle_and_tell_of_lines(disk, tmp_path, name):
    write_by_meshio(tmp_path / name, disk)
    mesh = read_mesh(tmp_path / name, TriangleMesh)
    assert mesh.hash == disk.hash
    assert [n.text for n in mesh.notices if n.kind is NoticeKind.LINES_IGNORED] == [
        "cells that are not faces were ignored: 1 of type line"
    ]


def test_vtp_keeps_every_bit_and_tells_of_lines(disk, tmp_path):
    pyvista = pytest.importorskip("pyvista")
    faces = np.column_stack([np.full(disk.m, 3), disk.F])
    for binary in (False, True):
        data = pyvista.PolyData(disk.V, faces=faces.ravel(), lines=[2, 0, 1])
        data.save(tmp_path / "a.vtp", binary=binary)
        mesh = read_mesh(tmp_path / "a.vtp", TriangleMesh)
        assert np.array_equal(mesh.F, disk.F)
        assert np.allclose(mesh.V, disk.V, rtol=0 if binary else 1e-6, atol=0 if binary else 1e-6)
        assert [n.text for n in mesh.notices if n.kind is NoticeKind.LINES_IGNORED] == [
            "cells that are not faces were ignored: 1 of type line"
        ]
    strips = pyvista.PolyData(disk.V, strips=[4, 0, 1, 2, 3])
    strips.save(tmp_path / "strips.vtp")
    assert read_soup(tmp_path / "strips.vtp").triangles.tolist() == [[0, 1, 2], [2, 1, 3]]
    pyvista.PolyData(disk.V).save(tmp_path / "points.vtp")
    with pytest.raises(MeshError):
        read_mesh(tmp_path / "points.vtp")


def test_gltf_with_the_seams_closed(disk, tmp_path):
    pytest.importorskip("trimesh")
    write_mesh(tmp_path / "a.glb", disk, disk.V[:, 0] + 1j * disk.V[:, 1])
    mesh = read_mesh(tmp_path / "a.glb", TriangleMesh)
    assert (mesh.n, mesh.m) == (disk.n, disk.m)
    size = np.abs(disk.V).max()
    assert np.allclose(np.sort(mesh.V, axis=0), np.sort(disk.V, axis=0), atol=1e-6 * size)


def test_gifti(disk, tmp_path):
    nibabel = pytest.importorskip("nibabel")
    gifti = nibabel.gifti
    arrays = [
        gifti.GiftiDataArray(disk.V.astype(np.float32), "NIFTI_INTENT_POINTSET"),
        gifti.GiftiDataArray(disk.F.astype(np.int32), "NIFTI_INTENT_TRIANGLE"),
    ]
    nibabel.save(gifti.GiftiImage(darrays=arrays), tmp_path / "a.gii")
    mesh = read_mesh(tmp_path / "a.gii", TriangleMesh)
    assert np.array_equal(mesh.F, disk.F)
    assert np.array_equal(mesh.V, disk.V.astype(np.float32))
    nibabel.save(gifti.GiftiImage(darrays=arrays[:1]), tmp_path / "b.gii")
    with pytest.raises(MeshError, match=r"holds 1 sets of points and 0 of triangles"):
        read_mesh(tmp_path / "b.gii")


@pytest.mark.usefixtures("forked_readers")
@pytest.mark.parametrize("suffix", [".vtk", ".vtu", ".vtp", ".glb", ".gii"])
def test_a_file_cut_short_or_of_another_kind_is_an_error(disk, tmp_path, suffix, capfd):
    pytest.importorskip("meshio")
    pytest.importorskip("vtk")
    pytest.importorskip("nibabel")
    whole = tmp_path / f"whole{suffix}"
    if suffix in (".glb", ".vtp"):
        write_mesh(whole, disk)
    elif suffix == ".gii":
        test_gifti(disk, tmp_path)
        (tmp_path / "a.gii").rename(whole)
    else:
        write_by_meshio(whole, disk)
    content = whole.read_bytes()
    for size in {5, len(content) // 3, len(content) // 2, len(content) - 40}:
        (tmp_path / f"cut{suffix}").write_bytes(content[:size])
        with pytest.raises(MeshError):
            read_mesh(tmp_path / f"cut{suffix}", TriangleMesh)
    (tmp_path / f"text{suffix}").write_text("hello")
    with pytest.raises(MeshError, match="cannot be read as"):
        read_mesh(tmp_path / f"text{suffix}", TriangleMesh)
    assert not capfd.readouterr().err, "a library prints on the terminal"


@pytest.mark.parametrize(
    ("suffix", "module", "extra"),
    [
        (".vtu", "meshio", "formats"),
        (".glb", "trimesh", "formats"),
        (".vtp", "vtk", "vtp"),
    ],
)
def test_a_missing_library_is_named_with_its_extra(monkeypatch, tmp_path, suffix, module, extra):
    for one in {module, "vtk"}:  # which reads VTU too
        monkeypatch.setitem(__import__("sys").modules, one, None)
    (tmp_path / f"a{suffix}").write_bytes(b"x")
    with pytest.raises(MissingExtra, match=rf"{module}.*cembench\[{extra}\]"):
        read_mesh(tmp_path / f"a{suffix}")


def test_a_library_that_never_ends_is_stopped(tmp_path, monkeypatch):
    (tmp_path / "endless.py").write_text("def read(path):\n    while True:\n        pass\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(isolated, "_SECONDS", 2.0)
    reader = isolated.isolated(import_module("endless").read, Extra.FORMATS, "numpy")
    monkeypatch.setitem(files.READERS, ".vtk", reader)
    (tmp_path / "a.vtk").write_bytes(b"# vtk DataFile Version 3.0")
    with pytest.raises(MeshError, match=r"a\.vtk: numpy did not finish .* 2 seconds.*export"):
        read_soup(tmp_path / "a.vtk")
