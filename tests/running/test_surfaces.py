"""One loader for files, names, arrays and the meshes of other libraries."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk

import cembench
from cembench import DiskMesh, HoledMesh, MeshError, TriangleMesh
from cembench.mesh.defects import Defect, UnusableMeshError
from cembench.registry import load_registry
from cembench.running.surfaces import KINDS, load_surface
from tests import gallery

DISK = flat_disk(60)


def pyvista_data(mesh):
    pyvista = pytest.importorskip("pyvista")
    return pyvista.PolyData(mesh.V, faces=np.column_stack([np.full(mesh.m, 3), mesh.F]).ravel())


def meshio_mesh(mesh):
    meshio = pytest.importorskip("meshio")
    return meshio.Mesh(mesh.V, [("triangle", mesh.F)])


def pymeshlab_mesh(mesh):
    return pytest.importorskip("pymeshlab").Mesh(mesh.V, mesh.F)


def trimesh_mesh(mesh):
    trimesh = pytest.importorskip("trimesh")
    return trimesh.Trimesh(mesh.V, mesh.F, process=False)


@pytest.mark.parametrize(
    "made",
    [
        lambda mesh: mesh,
        lambda mesh: (mesh.V, mesh.F),
        lambda mesh: [mesh.V.tolist(), mesh.F.tolist()],
        lambda mesh: (np.asfortranarray(mesh.V), mesh.F.astype(np.int32)),  # as igl returns them
        pyvista_data,
        meshio_mesh,
        pymeshlab_mesh,
        trimesh_mesh,
    ],
)
def test_a_mesh_of_any_library_is_the_same_surface(made):
    loaded = load_surface(made(DISK))
    assert isinstance(loaded, DiskMesh)
    assert loaded.hash == DISK.hash


def test_polygons_of_pyvista_are_cut_into_triangles():
    faces = np.array([4, 0, 1, 2, 3, 3, 1, 4, 2])
    V = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0.5, 0]])
    mesh = load_surface(SimpleNamespace(points=V, faces=faces))
    assert mesh.F.tolist() == [[0, 1, 2], [0, 2, 3], [1, 4, 2]]
    with pytest.raises(MeshError, match=r"faces\[5\] is 7, which is not the size of a polygon"):
        load_surface(SimpleNamespace(points=V, faces=np.where(np.arange(9) == 5, 7, faces)))


def test_a_name_a_file_and_its_faces(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cembench.load_surface("flat-disk", faces=60).hash == DISK.hash
    cembench.write_mesh("mine.obj", DISK)
    assert cembench.load_surface("mine.obj").name == "mine"
    with pytest.raises(MeshError, match=r"there is no such file.*Did you mean mine\.obj\?"):
        load_surface("mime.obj")
    with pytest.raises(MeshError, match=r"neither a file nor .*Did you mean flat-disk"):
        load_surface("flatdisk")
    with pytest.raises(MeshError, match=r"Did you mean mine\.obj\?"):
        load_surface("mine")


def test_holes_are_allowed_or_not():
    ring = gallery.tube()
    assert isinstance(load_surface(ring), HoledMesh)
    assert type(load_surface(ring, (TriangleMesh, HoledMesh))) is HoledMesh
    for surface, kinds, holes in (
        (ring, KINDS, False),
        (TriangleMesh.from_arrays(*ring), (DiskMesh,), True),
    ):
        with pytest.raises(UnusableMeshError) as refused:
            load_surface(surface, kinds, holes=holes)
        assert [problem.defect for problem in refused.value.problems] == [Defect.holes]


def test_a_file_with_holes_is_read_unless_a_disk_is_required(tmp_path):
    ring = load_surface(gallery.tube())
    cembench.write_mesh(tmp_path / "ring.obj", ring)
    assert isinstance(cembench.read_mesh(tmp_path / "ring.obj"), HoledMesh)
    with pytest.raises(MeshError, match="boundary loops"):
        cembench.read_mesh(tmp_path / "ring.obj", DiskMesh)


def test_a_surface_is_repaired_and_cut():
    torus = gallery.torus()
    cut = load_surface(torus, cut=True)
    assert isinstance(cut, DiskMesh)
    assert cut.m == len(torus[1])
    doubled = (DISK.V, np.vstack([DISK.F, DISK.F[:1]]))
    with pytest.raises(MeshError):
        load_surface(doubled)
    assert load_surface(doubled, repair=True).m == DISK.m


V, F = DISK.V, DISK.F


@pytest.mark.parametrize(
    ("surface", "message"),
    [
        ((V, F + 1), rf"count from 1: their indices are 1 to {len(V)}.* Write F - 1"),
        ((F, V), r"swapped.*Write \(V, F\)"),
        ((V, [[0, 1, 2], [0, 2, 3, 4]]), r"faces are a list .* row 1 .* 4 numbers.* Cut polygons"),
        (([[0, 0, 0], [1, 0], [1, 1, 0]], [[0, 1, 2]]), r"vertices are a list .* row 1 .* 2 num"),
        ((V, F, V), r"a surface is a mesh, .*; got tuple of 3 items"),
        (7, r"an object with vertices and faces; got int"),
        (SimpleNamespace(vertices=V, faces=F + 1), "count from 1"),
        ((V, [], [], F, [], []), r"tuple of 6 items\..*\(found\[0\], found\[3\]\)"),
        (SimpleNamespace(extract_surface=None), r"write extract_surface\(\) of it"),
        (V, r"ndarray without its faces: write \(V, F\)"),
    ],
)
def test_what_is_not_a_surface_gets_a_sentence_with_a_remedy(surface, message):
    with pytest.raises(MeshError, match=re.compile(message, re.DOTALL)):
        load_surface(surface)


def test_a_public_surface_that_is_not_here_says_how_to_fetch_it(monkeypatch, tmp_path):
    monkeypatch.setenv("CEMBENCH_CACHE", str(tmp_path))
    name = next(iter(load_registry().datasets))
    with pytest.raises(MeshError, match=f"`cembench fetch {name}`"):
        load_surface(name)
