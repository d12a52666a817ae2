"""Where texture coordinates lie: the unit square, the whole of it, or the surface's own units."""

import json

import numpy as np
import pytest

import cembench
from cembench import ParameterError
from cembench.conformal.metrics import angle_errors
from cembench.conformal.planar import signed_areas
from cembench.conformal.resample import disk_to_square, square_to_disk
from cembench.mesh.files import read_soup, write_mesh
from tests import gallery


@pytest.fixture(scope="module")
def cap():
    mesh = cembench.surface("spherical-cap", 800)
    return mesh.moved(3.7 * mesh.V)


def surface_area(V, F):
    return np.linalg.norm(np.cross(*np.diff(V[F], axis=1).swapaxes(0, 1)), axis=1).sum() / 2


def uv_of(path):
    soup = read_soup(path, uv=True)
    return soup.uv[soup.uv_triangles]


def area_of(corners):
    return np.abs(signed_areas(corners.ravel(), np.arange(corners.size).reshape(-1, 3))).sum()


def test_the_disk_and_the_square_are_inverse_and_corners_go_to_corners():
    rng = np.random.default_rng(0)
    w = rng.uniform(-1, 1, 500) + 1j * rng.uniform(-1, 1, 500)
    np.testing.assert_allclose(disk_to_square(square_to_disk(w)), w, atol=1e-12)
    corner = np.exp(0.25j * np.pi * np.array([1, 3, 5, 7]))
    np.testing.assert_allclose(disk_to_square(corner), np.sqrt(2) * corner, atol=1e-9)
    rim = disk_to_square(np.exp(1j * np.linspace(0, 7, 1000)))
    np.testing.assert_allclose(np.maximum(abs(rim.real), abs(rim.imag)), 1, atol=1e-12)


def test_the_disk_goes_to_the_square_conformally():
    z = 0.6 * np.exp(1j * np.linspace(0, 6, 50))
    step = 1e-6
    along, up = (disk_to_square(z + s) - disk_to_square(z) for s in (step, 1j * step))
    np.testing.assert_allclose(up / along, 1j, atol=1e-5)


@pytest.mark.parametrize("algorithm", ["direct-cem", "lscm"])
def test_the_surface_s_own_units_have_its_area(cap, algorithm, tmp_path, cli):
    write_mesh(tmp_path / "a.obj", cap)
    arguments = ("-a", algorithm, "-o", "b.obj", "--uv", "world", "--flat", "c.off", "--json")
    code, out, err = cli("map", tmp_path / "a.obj", *arguments)
    assert code == 0, err
    area = surface_area(cap.V, cap.F)
    assert area_of(uv_of(cli.folder / "b.obj")) == pytest.approx(area)
    told = json.loads(out)
    assert told["flat"] == "c.off"
    result = cembench.parameterize(cap, algorithm)
    image = np.abs(signed_areas(result.z, cap.F)).sum()
    assert told["uv_scale"] == pytest.approx(np.sqrt(area / image))
    flat = read_soup(cli.folder / "c.off")
    assert not flat.V[:, 2].any()
    assert surface_area(flat.V, flat.triangles) == pytest.approx(area)
    assert flat.triangles.tolist() == cap.F.tolist()
    np.testing.assert_allclose(result.flat().V, flat.V, atol=1e-9)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".glb"])
def test_a_map_of_the_disk_fills_the_square(cap, suffix, tmp_path):
    result = cembench.parameterize(cap, "direct-cem")
    result.save(tmp_path / f"a{suffix}", uv="square")
    if suffix == ".glb":
        return
    corners = uv_of(tmp_path / f"a{suffix}")
    assert (corners.real.min(), corners.real.max()) == pytest.approx((0, 1), abs=1e-6)
    assert (corners.imag.min(), corners.imag.max()) == pytest.approx((0, 1), abs=1e-6)
    assert area_of(corners) == pytest.approx(1, abs=0.02)
    if suffix == ".obj":
        soup = read_soup(tmp_path / "a.obj", uv=True)
        assert (signed_areas(soup.uv, soup.uv_triangles) > 0).all()
        inside = angle_errors(cap, soup.uv).reshape(-1, 3).mean()
        assert inside < 2 * angle_errors(cap, result.z).mean() + 1


def test_only_a_disk_fills_the_square(cap, tmp_path, cli):
    write_mesh(tmp_path / "a.obj", cap)
    arguments = ("map", tmp_path / "a.obj", "-a", "lscm", "-o", "b.obj", "--uv", "square")
    code, _, err = cli(*arguments)
    assert code == 2
    assert "uv='square' needs a map onto the disk, and lscm maps" in " ".join(err.split())
    assert not (cli.folder / "b.obj").exists()
    with pytest.raises(ParameterError, match="needs a map onto the disk"):
        cembench.parameterize(cap, "lscm").save(tmp_path / "c.obj", uv="square")
    assert not (tmp_path / "c.obj").exists()


def test_a_square_takes_the_disk_by_itself(cap, tmp_path):
    write_mesh(tmp_path / "a.obj", cap)
    output = tmp_path / "b.obj"
    (mapped,) = cembench.map_files(tmp_path / "a.obj", output=output, uv="square")
    assert mapped.record.cell.algorithm == "direct-cem"
    assert area_of(uv_of(output)) == pytest.approx(1, abs=0.02)


def test_a_flat_mesh_of_a_cut_surface_has_the_disk_s_vertices(tmp_path):
    (tmp_path / "torus.obj").write_text(gallery.obj_text(*gallery.torus()))
    (mapped,) = cembench.map_files(
        tmp_path / "torus.obj", "direct-cem", cut=True, flat=tmp_path / "flat.ply"
    )
    assert mapped.written["flat"] == str(tmp_path / "flat.ply")
    flat = read_soup(tmp_path / "flat.ply")
    assert len(flat.V) == mapped.surface.mesh.n
    assert mapped.uv_scale is not None
