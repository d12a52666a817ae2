"""Files with somebody's maps: which surface a file belongs to, and what kind of map it is."""

from types import SimpleNamespace

import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.spherical_cap import spherical_cap

from cembench import HoledMesh, write_mesh
from cembench.core.errors import NotThere, ParameterError
from cembench.registry import declared_by
from cembench.running.external.exchange import ProgramFault, read_map
from cembench.running.given_maps import given_maps
from cembench.running.map_promises import faults

DISK, CAP = flat_disk(200), spherical_cap(300)
FLAT = CAP.V[:, 0] + 1j * CAP.V[:, 1]
OVAL = 0.5 + 0.25j + FLAT * (1 + 0.3 * FLAT.real)


class Heard(SimpleNamespace):
    """What is noted and warned of."""

    def __init__(self):
        super().__init__(notes=[], warnings=[])

    def note(self, text):
        self.notes.append(text)

    def warn(self, text):
        self.warnings.append(text)


def given(folder, *meshes, called="theirs", heard=None):
    return given_maps(called, folder, meshes or (DISK, CAP), heard or Heard())[0]


def obj(V, F, uv, uv_index=None, digits=17):
    """The lines of an OBJ file."""
    lines = [f"v {' '.join(f'{x:.{digits}g}' for x in row)}" for row in V]
    lines += [f"vt {z.real:.{digits}g} {z.imag:.{digits}g}" for z in uv]
    corners = zip(F + 1, (F if uv_index is None else uv_index) + 1, strict=True)
    lines += ["f " + " ".join(f"{v}/{t}" for v, t in zip(*row, strict=True)) for row in corners]
    return "\n".join(lines)


def test_a_file_is_known_by_its_mesh_whatever_its_name_and_order(tmp_path):
    rng = np.random.default_rng(67)
    order, triangles = rng.permutation(CAP.n), rng.permutation(CAP.m)
    F = np.roll(np.argsort(order)[CAP.F[triangles]], 1, axis=1)
    (tmp_path / "any name.obj").write_text(obj(CAP.V[order], F, OVAL[order]))
    np.testing.assert_array_equal(read_map(given(tmp_path), CAP).uv, OVAL)


@pytest.mark.parametrize("suffix", ["obj", "ply", "glb", "npz"])
def test_formats_with_copies_of_vertices_and_in_single_precision(tmp_path, suffix):
    path = tmp_path / f"map.{suffix}"
    uv = OVAL
    if suffix == "npz":
        np.savez(path, V=CAP.V, F=CAP.F, uv=np.column_stack([uv.real, uv.imag]))
    else:
        write_mesh(path, CAP, uv=uv)
    assert given(tmp_path).target == "free boundary"
    np.testing.assert_allclose(read_map(given(tmp_path), CAP).uv, uv, atol=2e-7)


def test_circles_of_few_digits_are_disks_and_are_put_on_the_unit_circle(tmp_path):
    uv = 0.5 + 0.5j + 0.4 * DISK.V[:, 0] + 0.4j * DISK.V[:, 1]
    (tmp_path / "a.obj").write_text(obj(DISK.V, DISK.F, uv, digits=7))
    maps = given(tmp_path)
    assert maps.target == "disk"
    assert faults(maps, DISK, read_map(maps, DISK).uv) == []


def test_a_map_that_is_cut_is_an_atlas(tmp_path):
    corners = np.arange(CAP.F.size).reshape(-1, 3)
    uv = FLAT[CAP.F].ravel() + corners.ravel()
    (tmp_path / "a.obj").write_text(obj(CAP.V, CAP.F, uv, corners))
    assert given(tmp_path).target == "atlas"
    with pytest.raises(ProgramFault, match="several UVs"):
        read_map(given(tmp_path, called="theirs:disk"), CAP)


def test_holes_that_are_circles_or_not(tmp_path):
    ring = np.exp(2j * np.pi * np.arange(12) / 12)
    z = np.concatenate([ring, 0.5 * ring])
    k = np.arange(12)
    F = np.array([[k, (k + 1) % 12, k + 12], [(k + 1) % 12, (k + 1) % 12 + 12, k + 12]])
    F = F.transpose(2, 0, 1).reshape(-1, 3)
    V = np.column_stack([z.real, z.imag, np.abs(z)])
    mesh = HoledMesh(V, F)
    shifted = np.where(np.arange(24) < 12, z, z.real + 0.7j * z.imag)
    for uv, target in (
        (z, "circular holes"),
        (shifted, "disk with holes"),
        (z * (1 + 0.2 * (np.arange(24) < 3)), "free boundary"),
    ):
        (tmp_path / "a.obj").write_text(obj(V, F, uv))
        assert given(tmp_path, mesh).target == target


def test_mixed_kinds_are_of_the_weaker_target_and_noted(tmp_path):
    (tmp_path / "a.obj").write_text(obj(DISK.V, DISK.F, DISK.V[:, 0] + 1j * DISK.V[:, 1]))
    (tmp_path / "b.obj").write_text(obj(CAP.V, CAP.F, FLAT + 0.1 * FLAT**2))
    heard = Heard()
    assert given(tmp_path, heard=heard).target == "free boundary"
    assert "a.obj (disk)" in heard.notes[0]
    assert given(tmp_path, called="theirs:disk", heard=(quiet := Heard())).target == "disk"
    assert quiet.notes == []


def test_a_file_of_no_surface_is_left_out_by_name(tmp_path):
    (tmp_path / "a.obj").write_text(obj(DISK.V, DISK.F, DISK.V[:, 0] + 1j * DISK.V[:, 1]))
    (tmp_path / "turned.obj").write_text(obj(CAP.V[:, [0, 2, 1]], CAP.F, FLAT))
    (tmp_path / "stranger.obj").write_text(obj(DISK.V, DISK.F[1:], DISK.V[:, 0] + 0j))
    V = CAP.V.copy()
    V[len(V) // 2] += 1e-3
    (tmp_path / "noise.obj").write_text(obj(V, CAP.F, FLAT))
    write_mesh(tmp_path / "no_uv.obj", CAP)
    heard = Heard()
    maps = given(tmp_path, heard=heard)
    assert [len(maps.maps.files), len(heard.warnings)] == [1, 4]
    told = dict(zip(("no_uv", "noise", "stranger", "turned"), heard.warnings, strict=True))
    for name, words in (
        ("no_uv", "it holds no UVs"),
        ("noise", "vertex"),
        ("stranger", f"has its {DISK.m - 1} triangles"),
        ("turned", "Forward Y, Up Z"),
    ):
        assert told[name].startswith(f"{tmp_path / name}.obj is left out: ")
        assert words in told[name]
    with pytest.raises(NotThere, match="holds a map of this surface"):
        read_map(maps, CAP)


def test_what_is_refused(tmp_path):
    with pytest.raises(ParameterError, match="no map of a surface of this run"):
        given(tmp_path)
    with pytest.raises(ParameterError, match="cannot be listed"):
        given(tmp_path / "none")
    for name in ("a", "b"):
        (tmp_path / f"{name}.obj").write_text(obj(CAP.V, CAP.F, FLAT))
    with pytest.raises(ParameterError, match=r"a\.obj and b\.obj are both maps of"):
        given(tmp_path)
    with pytest.raises(ParameterError, match="allowed: disk, free boundary"):
        given(tmp_path, called="theirs:plane")


def test_the_plug_in_declares_the_same_algorithm(tmp_path):
    (tmp_path / "a.obj").write_text(obj(CAP.V, CAP.F, FLAT))
    algorithm, plugin = given_maps("theirs", tmp_path, [CAP], Heard())
    (again,) = declared_by(plugin)
    assert (again.maps, again.target, again.name) == (algorithm.maps, "disk", "theirs")
