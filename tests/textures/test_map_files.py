"""What people take home of a map, as the command line and `Result` write it."""

import io
import json
import re

import numpy as np
import OpenEXR
import pytest
import pyvista
import trimesh
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.textures import geometry_images
from PIL import Image

import cembench
from cembench.api.save_map import save_map
from cembench.mesh.files import read_mesh, write_mesh
from tests import gallery
from tests.commands.test_cli import FAULTY


@pytest.fixture(scope="module")
def result():
    return cembench.parameterize(hemi_ellipsoid(300), "harmonic-circle")


@pytest.fixture
def given(tmp_path):
    """A flat square whose own texture coordinates are its coordinates, and a texture for them."""
    V, F = gallery.flat_rectangle()
    uv = (V[:, :2] - V[:, :2].min(axis=0)) / np.ptp(V[:, :2], axis=0)
    lines = ["mtllib mine.mtl", "usemtl mine"]
    lines += [f"v {x} {y} {z}" for x, y, z in V] + [f"vt {u} {v}" for u, v in uv]
    lines += ["f " + " ".join(f"{k + 1}/{k + 1}" for k in face) for face in F]
    (tmp_path / "flat.obj").write_text("\n".join(lines) + "\n")
    u = np.linspace(0, 255, 128).astype(np.uint8)
    pixels = np.stack([*np.meshgrid(u, u[::-1]), np.zeros((128, 128), np.uint8)], axis=2)
    Image.fromarray(pixels).save(tmp_path / "paint.png")
    return tmp_path / "flat.obj"


def uv_of(path):
    return trimesh.load_mesh(path, process=False).visual.uv


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb"])
def test_texture_coordinates_lie_in_the_unit_square_unless_asked(result, suffix, tmp_path):
    uv = uv_of(result.save(tmp_path / f"a{suffix}"))
    np.testing.assert_allclose(uv, (result.uv + 1) / 2, atol=1e-6)
    assert 0 <= uv.min() <= 0.01
    assert 0.99 <= uv.max() <= 1
    uv = uv_of(result.save(tmp_path / f"b{suffix}", uv="disk"))
    np.testing.assert_allclose(uv, result.uv, atol=1e-6)
    with pytest.raises(
        cembench.ParameterError, match="write one of 'unit', 'square', 'world', 'disk'"
    ):
        result.save(tmp_path / f"c{suffix}", uv="round")


def test_a_checkerboard_is_found_from_obj_and_from_ply(result, tmp_path):
    result.save(tmp_path / "a.obj", checker=True)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.mtl", "a.obj", "a_texture.png"]
    picture = trimesh.load_mesh(tmp_path / "a.obj").visual.material.image
    assert picture.size == (1024, 1024)
    with pytest.raises(cembench.ParameterError, match=r"a_texture\.png already exists"):
        result.save(tmp_path / "a.ply", checker=True)
    result.save(tmp_path / "b.ply", checker=True)
    assert b"TextureFile b_texture.png" in (tmp_path / "b.ply").read_bytes()
    with pytest.raises(cembench.ParameterError, match=r"cannot refer to a texture; .* with \.glb"):
        result.save(tmp_path / "a.vtp", checker=True)


def test_triangles_that_rounding_folds_are_counted(tmp_path):
    mesh = hemi_ellipsoid(300)
    z = (mesh.V[:, 0] + 1j * mesh.V[:, 1]) / np.abs(mesh.V[:, :2]).max()
    inner = np.setdiff1d(np.arange(mesh.n), mesh.boundary)
    z[inner] *= 1e-12  # the disk's middle, as on a long finger
    assert save_map(tmp_path / "a.obj", mesh, z, "disk") == ()
    (notice,) = save_map(tmp_path / "a.ply", mesh, z)
    assert notice.kind == "folded_by_rounding"
    assert "single precision" in str(notice)
    z[inner] *= 1e-6
    (notice,) = save_map(tmp_path / "a.npz", mesh, z)
    assert "(uv: disk) stay as they are" in str(notice)
    assert "--" not in str(notice)


def test_map_bakes_a_texture_for_the_new_coordinates(cli, given):
    call = ("map", given, "-a", "harmonic-circle", "-o", "new.obj")
    code, _, err = cli(*call, "--bake", given.parent / "paint.png")
    assert code == 0, err
    mesh = trimesh.load_mesh(cli.folder / "new.obj", process=False)
    picture = np.asarray(mesh.visual.material.image.convert("RGB")).astype(float)
    side = len(picture)
    old = read_mesh(given).V[:, :2]
    old = (old - old.min(axis=0)) / np.ptp(old, axis=0)
    inner = np.abs(mesh.visual.uv - 0.5).max(axis=1) < 0.3
    assert inner.sum() > 3
    column, row = (mesh.visual.uv * [1, -1] + [0, 1])[inner].T * side
    seen = picture[row.astype(int), column.astype(int), :2] / 255
    np.testing.assert_allclose(seen, old[inner], atol=0.06)
    text = (cli.folder / "new.obj").read_text()
    assert text.startswith("mtllib new.mtl\nusemtl map\n")
    assert "mine" not in text


def test_map_bakes_into_glb_too(cli, given):
    code, _, err = cli("map", given, "-o", "new.glb", "--bake", given.parent / "paint.png")
    assert code == 0, err
    material = trimesh.load_mesh(cli.folder / "new.glb").visual.material
    assert material.baseColorTexture.size == (128, 128)
    assert [p.name for p in cli.folder.iterdir()] == ["new.glb"]


def test_several_surfaces_share_the_square_in_one_file(cli, given):
    write_mesh(given.parent / "dome.obj", hemi_ellipsoid(300))
    files = (given, given.parent / "dome.obj")
    for name in ("all.glb", "all.obj"):
        code, _, err = cli("map", *files, "-a", "harmonic-circle", "-o", name, "--checker")
        assert code == 0, err
    scene = trimesh.load_scene(cli.folder / "all.glb")
    uv = {name: mesh.visual.uv for name, mesh in scene.geometry.items()}
    assert set(uv) == {"flat", "dome"}
    boxes = [np.concatenate([found.min(axis=0), found.max(axis=0)]) for found in uv.values()]
    assert min(box.min() for box in boxes) >= 0
    assert max(box.max() for box in boxes) <= 1
    one, other = boxes
    assert (one[2:] < other[:2]).any() or (other[2:] < one[:2]).any()
    whole = trimesh.load_mesh(cli.folder / "all.obj", process=False)
    assert len(whole.faces) == sum(len(mesh.faces) for mesh in scene.geometry.values())
    code, _, err = cli("map", *files, "-o", "all.glb", "--uv", "disk")
    assert (code, "share the unit square" in err) == (2, True)


def test_a_geometry_image_is_written_for_other_programs(cli, result, tmp_path):
    write_mesh(tmp_path / "dome.obj", result.mesh)
    for name in ("a.npy", "a.exr", "a.png"):
        call = ("map", tmp_path / "dome.obj", "-a", "harmonic-circle", "--side", "17")
        code, _, err = cli(*call, "--geometry-image", name)
        assert code == 0, err
    samples = np.load(cli.folder / "a.npy")
    np.testing.assert_array_equal(samples, result.geometry_image(17))
    with OpenEXR.File(str(cli.folder / "a.exr")) as file:
        np.testing.assert_allclose(file.channels()["RGB"].pixels, samples, atol=1e-6)
    loaded = pyvista.read(cli.folder / "a.png")
    pixels = loaded["PNGImage"].reshape(17, 17, 4)[::-1].astype(float) / 65535
    low, extent = result.mesh.V.min(axis=0), np.ptp(result.mesh.V, axis=0).max()
    np.testing.assert_allclose(pixels[..., :3] * extent + low, samples, atol=2e-5 * extent)
    assert (pixels[..., 3] == 1).all()
    assert Image.open(io.BytesIO((cli.folder / "a.png").read_bytes())).size == (17, 17)


def test_a_regular_mesh_is_written_with_its_map(cli, result, tmp_path):
    write_mesh(tmp_path / "dome.obj", result.mesh)
    call = ("map", tmp_path / "dome.obj", "-a", "harmonic-circle", "--side", "17")
    code, out, err = cli(*call, "--remesh", "new.obj")
    assert code == 0, err
    assert "new.obj" in out
    new = read_mesh(cli.folder / "new.obj")
    assert new.hash == result.remesh(17).hash
    uv = uv_of(cli.folder / "new.obj")
    np.testing.assert_allclose(np.abs(2 * uv[:, 0] - 1 + 1j * (2 * uv[:, 1] - 1)).max(), 1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("-o", "a.fbx"), "allowed here: .obj, .ply, .glb, .vtp, .npz"),
        (("-o", "a.obj", "--bake", "nothing.png"), "nothing.png cannot be read: No such file"),
        (("-o", "a.obj", "--bake", "flat.obj"), "it is not a picture"),
        (("-o", "a.obj", "--bake", "paint.png", "--checker"), "each give a texture; choose one"),
        (("-o", "a.vtp", "--checker"), "cannot refer to a texture"),
        (("--checker",), "need a file that uses the texture"),
        (("--geometry-image", "a.tif"), "allowed: .npy, .exr, .png"),
        (("--geometry-image", "no/a.npy"), "there is no folder no"),
        (("--remesh", "a.fbx"), "is unknown; allowed here"),
        (("--html", "a.obj"), "use the suffix .html"),
        (("--html", "no/a.html"), "there is no folder no"),
        (("-o", "a.obj", "--uv", "round"), "'round' is not one of"),
        (("-a", "lscm", "--remesh", "a.obj"), "does not cover the disk"),
    ],
)
def test_bad_wishes_are_refused_before_anything_is_written(arguments, message, cli, given):
    for file in (given, given.parent / "paint.png"):
        (cli.folder / file.name).write_bytes(file.read_bytes())
    before = sorted(p.name for p in cli.folder.iterdir())
    code, _, err = cli("map", "flat.obj", *arguments)
    assert code == 2
    assert message in " ".join(err.split())
    assert sorted(p.name for p in cli.folder.iterdir()) == before


def test_a_texture_that_cannot_be_written_leaves_nothing(cli, given):
    (cli.folder / "a_texture.png").mkdir()
    code, _, err = cli("map", given, "-o", "a.obj", "--checker", "--force")
    assert code == 2
    assert "a_texture.png cannot be written: it is a folder" in " ".join(err.split())
    assert [p.name for p in cli.folder.iterdir()] == ["a_texture.png"]


def test_the_map_of_an_invalid_result_is_written_only_on_request(cli, given):
    broken = ("map", given, "-a", "mirrored", "--plugin", FAULTY)
    assert cli(*broken, "-o", "a.glb", "--geometry-image", "a.npy")[0] == 1
    assert not list(cli.folder.iterdir())
    assert cli(*broken, "-o", "a.glb", "--keep-invalid")[0] == 1
    assert (cli.folder / "a.glb").exists()


def test_a_page_to_turn_the_map_is_written_and_opened(cli, given, result, monkeypatch):
    code, out, err = cli("map", given, "-a", "harmonic-circle", "--html", "a.html")
    assert code == 0, err
    assert "a.html" in out
    text = (cli.folder / "a.html").read_text()
    assert 'class="view"' in text
    assert "http://" not in text
    assert "https://" not in text
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    page = result.show()
    assert opened == [page.as_uri()]
    assert page.read_text().startswith("<!DOCTYPE html>")
    with pytest.raises(cembench.RenderError, match="cannot be written"):
        result.show(given / "a.html")


def test_exr_says_what_it_needs(monkeypatch, tmp_path):
    import sys

    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(cembench.RenderError, match=r"pip install 'cembench\[formats\]'"):
        geometry_images.check_image_format(tmp_path / "a.exr")


@pytest.fixture
def bumpy(tmp_path):
    """A rough stretched rectangle in a file, many of whose edges are flipped."""
    V, F = gallery.flat_rectangle(8, 14)
    V[:, 0] *= 3
    V[:, 2] = 2 * np.random.default_rng(3).standard_normal(len(V))
    write_mesh(tmp_path / "bumpy.obj", cembench.DiskMesh.from_arrays(V, F))
    return tmp_path / "bumpy.obj"


def test_an_overlay_is_written_as_the_refined_mesh(cli, bumpy):
    options = ("-a", "cetm-flips", "--overlay", "-o", "fine.obj", "--preview")
    code, out, err = cli("map", bumpy, *options)
    assert code == 0, err
    given, fine = read_mesh(bumpy), read_mesh(cli.folder / "fine.obj")
    assert f"{fine.m:,} triangles, the {given.m:,} of bumpy cut along" in " ".join(out.split())
    np.testing.assert_allclose(fine.V[: given.n], given.V)
    uv = uv_of(cli.folder / "fine.obj")
    result = cembench.parameterize(bumpy, "cetm-flips", overlay=True)
    np.testing.assert_allclose(uv, (result.uv + 1) / 2, atol=1e-7)
    assert (cli.folder / "fine.png").exists()
    code, out, _ = cli("map", bumpy, "-a", "cetm-flips", "--overlay", "--json")
    assert code == 0
    assert "flipped triangulation" in json.loads(out)["overlay"]


def test_overlays_of_several_surfaces_go_to_one_file_or_to_several(cli, bumpy, given):
    for output in ("all.obj", "maps"):
        call = ("map", bumpy, given, "-a", "cetm-flips", "--overlay", "-o", output)
        code, _, err = cli(*call)
        assert code == 0, err
    fine = [read_mesh(cli.folder / "maps" / name).m for name in ("bumpy.obj", "flat.obj")]
    assert fine[0] > read_mesh(bumpy).m
    together = trimesh.load_mesh(cli.folder / "all.obj", process=False)
    assert len(together.faces) == sum(fine)
    both = cli.folder / "both.obj"  # without UVs, in one file, whose overlay is written
    trimesh.util.concatenate([trimesh.load_mesh(bumpy), trimesh.load_mesh(given)]).export(both)
    code, _, err = cli("map", both, "-a", "cetm-flips", "--overlay", "-o", "again.obj")
    assert code == 0, err
    again = trimesh.load_mesh(cli.folder / "again.obj", process=False)
    assert len(again.faces) == sum(fine)
    np.testing.assert_allclose(np.sort(again.area_faces), np.sort(together.area_faces), rtol=1e-4)


@pytest.mark.parametrize(
    ("options", "remedy"),
    [
        ((), "plane has no `overlay`, .* use algorithm='cetm-flips'"),
        (("-a", "cem"), "cem has no `overlay`, .* use algorithm='cetm-flips'"),
        (("-a", "cetm-flips", "--cut"), "leave out `cut`, and map what `cembench cut"),
        (("-a", "cetm-flips", "--bake", "paint.png", "-o", "x.obj"), "leave out `bake`"),
        (
            ("-a", "cetm-flips", "--timeout", "5"),
            "leave out `timeout`, `memory_bytes` and `threads`",
        ),
        (
            ("-a", "cetm-flips", "--threads", "2"),
            "leave out `timeout`, `memory_bytes` and `threads`",
        ),
    ],
)
def test_an_overlay_says_what_it_does_not_go_with(cli, bumpy, options, remedy):
    code, _, err = cli("map", bumpy, "--overlay", *options)
    assert code == 2
    assert re.search(remedy, " ".join(err.split())), err
    assert not (cli.folder / "x.obj").exists()


def test_a_map_that_no_texture_fits_ends_with_what_to_do(cli):
    cylinder = cembench.surface("cylinder-sheet", 400)
    long = cembench.DiskMesh.from_arrays(cylinder.V * [1, 1, 40], cylinder.F)
    cembench.write_mesh(cli.folder / "long.obj", long)
    code, out, err = cli("map", "long.obj", "-a", "direct-cem", "-o", "uv.obj")
    assert code == 0, err
    last = " ".join(out.split()).partition("output")[2]
    assert "Not usable as a texture in one piece: try a free boundary first" in last
    assert "cembench[xatlas]" in last
    assert "Definition 1" not in err


def test_a_map_that_is_not_written_is_said_so_beside_a_picture(cli):
    cembench.write_mesh(cli.folder / "cap.obj", cembench.surface("spherical-cap", 200))
    code, out, _ = cli("map", "cap.obj", "--preview")
    assert code == 0
    assert "The map was not written: add -o FILE.obj" in " ".join(out.split())
