"""Every format that holds texture coordinates, opened by programs that are not ours."""

import json
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pygltflib
import pymeshlab
import pytest
import pyvista
import trimesh
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench import MeshError
from cembench.mesh.files import write_mesh, write_soup
from cembench.mesh.formats import gltf
from cembench.mesh.soup import Soup, Texture, columns, complex_of


@pytest.fixture(scope="module")
def surface():
    """A surface whose map is its shadow; far from the origin, so that middles matter."""
    mesh = hemi_ellipsoid(300)
    uv = (mesh.V[:, :2] - mesh.V[:, :2].min(axis=0)) / np.ptp(mesh.V[:, :2])
    V = mesh.V + np.array([1000, 0, 0])
    return Soup.of_triangles(V, mesh.F, complex_of(uv), name="shadow")


@pytest.fixture(scope="module")
def seamed(surface):
    """The same where the first triangle has texture coordinates of its own."""
    corners = surface.triangles.copy()
    corners[0] = len(surface.uv) + np.arange(3)
    uv = np.append(surface.uv, [1, 1j, 0])
    return Soup.of_triangles(surface.V, surface.triangles, uv, corners)


def by_trimesh(path):
    loaded = trimesh.load_mesh(path, process=False)
    return loaded.vertices[loaded.faces], loaded.visual.uv[loaded.faces]


def by_vtk(path):
    loaded = pyvista.read(path)
    F = loaded.regular_faces
    return loaded.points[F], loaded.active_texture_coordinates[F]


def by_meshlab(path):
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(path))
    loaded = meshes.current_mesh()
    F = loaded.face_matrix()
    if loaded.has_wedge_tex_coord():
        uv = loaded.wedge_tex_coord_matrix().reshape(-1, 3, 2)
    else:
        uv = loaded.vertex_tex_coord_matrix()[F]
    return loaded.vertex_matrix()[F], uv


def by_pygltflib(path):
    loaded = pygltflib.GLTF2.load(path)
    (primitive,) = loaded.meshes[0].primitives

    def array(index, columns):
        accessor = loaded.accessors[index]
        view = loaded.bufferViews[accessor.bufferView]
        kind = {5126: "<f4", 5125: "<u4"}[accessor.componentType]
        content = loaded.binary_blob()[view.byteOffset :][: view.byteLength]
        return np.frombuffer(content, kind).reshape(accessor.count, columns)

    F = array(primitive.indices, 1).reshape(-1, 3)
    V = array(primitive.attributes.POSITION, 3) + np.array(loaded.nodes[0].translation)
    uv = array(primitive.attributes.TEXCOORD_0, 2)
    return V[F], (uv * [1, -1] + [0, 1])[F]


def by_numpy(path):
    loaded = np.load(path)
    return loaded["V"][loaded["F"]], loaded["uv"][loaded["F_uv" if "F_uv" in loaded else "F"]]


READERS = [
    ("a.obj", by_trimesh),
    ("a.obj", by_meshlab),
    ("a.ply", by_trimesh),
    ("a.ply", by_vtk),
    ("a.ply", by_meshlab),
    ("a.glb", by_trimesh),
    ("a.glb", by_pygltflib),
    ("a.vtp", by_vtk),
    ("a.npz", by_numpy),
]


@pytest.mark.parametrize(("name", "read"), READERS)
@pytest.mark.parametrize("which", ["surface", "seamed"])
def test_a_foreign_reader_finds_corners_and_texture_coordinates(
    name, read, which, request, tmp_path
):
    fixture = request.getfixturevalue(which)
    write_soup(tmp_path / name, fixture)
    points, uv = read(tmp_path / name)
    np.testing.assert_allclose(points, fixture.V[fixture.triangles], rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(uv, columns(fixture.uv)[fixture.uv_triangles], atol=1e-6)


@pytest.mark.parametrize("name", ["a.vtp", "a.npz"])
def test_full_precision_is_kept_to_the_last_bit(name, surface, tmp_path):
    write_soup(tmp_path / name, surface)
    points, uv = {".vtp": by_vtk, ".npz": by_numpy}[name[1:]](tmp_path / name)
    np.testing.assert_array_equal(points, surface.V[surface.triangles])
    np.testing.assert_array_equal(uv, columns(surface.uv)[surface.triangles])


def test_glb_shows_the_texture_that_is_inside(surface, tmp_path):
    from PIL import Image

    from cembench.drawing.texture import checker_png

    write_soup(tmp_path / "a.glb", surface, Texture(checker_png()))
    loaded = trimesh.load_mesh(tmp_path / "a.glb")
    picture = loaded.visual.material.baseColorTexture.convert("RGB")
    assert isinstance(picture, Image.Image)
    assert len(picture.getcolors()) == 2


def test_glb_holds_several_surfaces_and_one_texture(surface, tmp_path):
    parts = [
        replace(surface, V=surface.V + np.array([k, 0, 0]), name=f"part {k}") for k in range(2)
    ]
    (tmp_path / "a.glb").write_bytes(gltf.write(*parts, texture=Texture(b"\x89PNG")))
    loaded = pygltflib.GLTF2.load(tmp_path / "a.glb")
    assert [node.name for node in loaded.nodes] == ["part 0", "part 1"]
    assert len(loaded.images) == len(loaded.textures) == len(loaded.materials) == 1


@pytest.mark.parametrize("name", ["a.glb", "a.stl"])
def test_what_single_precision_cannot_hold_is_refused(name, surface, tmp_path):
    with pytest.raises(MeshError, match=r"are too large for .* up to 3\.4e\+38"):
        write_soup(tmp_path / name, replace(surface, V=surface.V * 1e40, uv=None))
    assert not list(tmp_path.iterdir())


def test_unknown_formats_are_told_what_is_known(surface, tmp_path):
    mesh = hemi_ellipsoid(300)
    with pytest.raises(MeshError, match=r"'\.fbx' is unknown; allowed here: \.obj, \.ply, \.glb"):
        write_mesh(tmp_path / "a.fbx", mesh, np.zeros(mesh.n, complex))


@pytest.mark.slow
@pytest.mark.process
def test_the_validator_of_khronos_finds_nothing(surface, seamed, tmp_path):
    npm, node = shutil.which("npm"), shutil.which("node")
    if npm is None or node is None:
        pytest.skip("NOT CHECKED: glTF by Khronos' validator; install node and npm")
    got = subprocess.run(
        [npm, "install", "--no-audit", "--no-fund", "gltf-validator@2.0.0-dev.3.10"],
        cwd=tmp_path,
        capture_output=True,
        check=False,
        timeout=300,
    )
    if got.returncode:
        pytest.skip("NOT CHECKED: glTF by Khronos' validator; npm cannot get gltf-validator")
    from cembench.drawing.texture import checker_png

    for k, given in enumerate((surface, seamed)):
        content = gltf.write(given, given, texture=Texture(checker_png()))
        (tmp_path / f"{k}.glb").write_bytes(content)
        script = (
            "const v = require('gltf-validator'), fs = require('fs');"
            f"v.validateBytes(new Uint8Array(fs.readFileSync('{k}.glb')))"
            ".then(r => console.log(JSON.stringify(r)))"
        )
        result = subprocess.run(
            [node, "-e", script], cwd=tmp_path, capture_output=True, check=True, timeout=120
        )
        issues = json.loads(result.stdout)["issues"]
        assert issues["numErrors"] == issues["numWarnings"] == 0, issues["messages"]
