"""A file of several surfaces: each is mapped, and they share the unit square."""

import json

import numpy as np
import pytest
import trimesh
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from PIL import Image

from cembench.conformal.planar import signed_areas
from cembench.drawing import preview
from cembench.mesh.files import read_soup
from tests import gallery


def statements(*meshes):
    """An OBJ with a group for each mesh; one lies beside the other."""
    lines, before = ["# by hand"], 0
    for k, mesh in enumerate(meshes):
        lines.append(f"g part_{k}")
        lines += [f"v {x + 5 * k!r} {y!r} {z!r}" for x, y, z in mesh.V.tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (mesh.F + 1 + before).tolist()]
        before += mesh.n
    return "\n".join(lines) + "\n"


@pytest.fixture
def two(tmp_path):
    path = tmp_path / "two.obj"
    path.write_text(statements(hemi_ellipsoid(200), flat_disk(100)))
    return path


def uv_and_faces(path):
    words = [line.split() for line in path.read_text().splitlines()]
    uv = np.array([w[1:3] for w in words if w and w[0] == "vt"], dtype=float)
    corners = [[int(c.split("/")[1]) - 1 for c in w[1:]] for w in words if w and w[0] == "f"]
    return uv @ np.array([1, 1j]), np.array(corners)


@pytest.mark.parametrize("suffix", [".obj", ".glb", ".ply", ".vtp", ".npz"])
def test_each_surface_of_a_file_is_mapped_and_all_lie_apart(suffix, cli, two):
    code, out, err = cli("map", two, "-a", "harmonic-circle", "-o", f"uv{suffix}")
    assert code == 0, err
    lines = [line for line in out.splitlines() if line.strip()]
    assert [line.split()[:3] for line in lines] == [["1", "of", "2"], ["2", "of", "2"]]
    if suffix == ".obj":
        text = (cli.folder / "uv.obj").read_text()
        assert text.startswith("# by hand\ng part_0\n")
        uv, corners = uv_and_faces(cli.folder / "uv.obj")
        assert min(uv.real.min(), uv.imag.min()) >= 0
        assert max(uv.real.max(), uv.imag.max()) <= 1
        assert (signed_areas(uv, corners) > 0).all()
        first, other = uv[: hemi_ellipsoid(200).n], uv[hemi_ellipsoid(200).n :]
        radii = [np.ptp(part.real) / 2 for part in (first, other)]
        middles = [(part.real.max() + part.real.min()) / 2 for part in (first, other)]
        heights = [(part.imag.max() + part.imag.min()) / 2 for part in (first, other)]
        apart = np.hypot(np.diff(middles), np.diff(heights))[0]
        assert apart > sum(radii)


def test_a_foreign_reader_finds_the_coordinates(cli, two):
    code, _, err = cli("map", two, "-a", "harmonic-circle", "-o", "uv.glb", "--preview")
    assert code == 0, err
    mesh = trimesh.load_mesh(cli.folder / "uv.glb")
    assert len(mesh.faces) == len(read_soup(two).triangles)
    assert mesh.visual.uv.min() >= 0
    assert mesh.visual.uv.max() <= 1
    with Image.open(cli.folder / "uv.png") as picture:
        assert picture.size == preview.SIZE


def test_json_has_a_row_for_each_and_extras_are_refused(cli, two):
    code, out, _ = cli("map", two, "-a", "harmonic-circle", "--json")
    assert code == 0
    assert [row["mesh"] for row in json.loads(out)] == ["two 1", "two 2"]
    for wish, message in (
        (("--remesh", "a.obj"), "holds 2 surfaces"),
        (("-o", "a.obj", "--uv", "disk"), "share the unit square"),
    ):
        code, _, err = cli("map", two, *wish)
        assert (code, message in " ".join(err.split())) == (2, True)
    assert not list(cli.folder.iterdir())


def test_closed_surfaces_of_a_file_are_cut_each(cli, tmp_path):
    V = np.vstack([np.eye(3), -np.eye(3)])
    F = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    F = np.array(F)
    both = gallery.obj_text(np.vstack([V, V + 9.0]), np.vstack([F, F + len(V)]))
    (tmp_path / "two.obj").write_text(both)
    code, _, err = cli("map", tmp_path / "two.obj", "-a", "harmonic-circle")
    assert code == 2
    assert "surface 1 of the 2 in this file" in err
    assert "closed" in err
    code, _, err = cli("map", tmp_path / "two.obj", "--cut", "-a", "lscm", "-o", "uv.obj")
    assert code == 0, err
    uv, corners = uv_and_faces(cli.folder / "uv.obj")
    assert (signed_areas(uv, corners) > 0).all()
    assert len(corners) == 2 * len(F)


def test_a_file_of_many_loose_triangles_is_sent_to_repair(cli, tmp_path):
    mesh = flat_disk(200)
    soup = mesh.V[mesh.F].reshape(-1, 3)
    loose = gallery.obj_text(soup, np.arange(len(soup)).reshape(-1, 3))
    (tmp_path / "soup.obj").write_text(loose)
    code, _, err = cli("map", tmp_path / "soup.obj")
    assert (code, "connected components" in err) == (2, True)
