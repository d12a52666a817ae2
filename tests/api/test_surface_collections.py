"""Surfaces of a folder, of archives, and of a local stand-in for the package thingi10k."""

from __future__ import annotations

import inspect
import io
import sys
import tarfile
import types
import zipfile

import igl
import numpy as np
import pytest
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.holed_disk import holed_disk
from cembench.surfaces.sets import surfaces_of_thingi10k

from cembench.api import surface_collections
from cembench.api.parameterize import parameterize
from cembench.api.surface_collections import (
    surfaces_of_archive,
    surfaces_of_folder,
)
from cembench.core.errors import ParameterError
from cembench.mesh.files import write_mesh
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh
from tests import gallery

BALL = TriangleMesh.from_arrays(*igl.upsample(*gallery.octahedron(), 3))
TORUS = TriangleMesh.from_arrays(*gallery.torus())


@pytest.fixture
def folder(tmp_path):
    where = tmp_path / "meshes"
    (where / "deeper").mkdir(parents=True)
    write_mesh(where / "disk.obj", flat_disk(100))
    write_mesh(where / "deeper" / "holes.ply", holed_disk(600))
    write_mesh(where / "ball.off", BALL)
    write_mesh(where / "torus.stl", TORUS)
    (where / "broken.obj").write_text("v 0 0 0\nf 1 2 3\n")
    (where / "notes.txt").write_text("no mesh")
    return where


def check(found):
    assert sorted(found) == ["ball", "broken", "disk", "holes", "torus"]
    assert isinstance(found["disk"].mesh, DiskMesh)
    assert isinstance(found["holes"].mesh, HoledMesh)
    ball = found["ball"]
    assert ball.cut
    assert isinstance(ball.mesh, DiskMesh)
    assert ball.mesh.name == "ball"
    assert parameterize(ball.mesh, "direct-cem").metrics["flipped_triangles"] == 0
    assert "only closed surfaces of genus 0 are cut" in found["torus"].error
    assert "index out of range" in found["broken"].error
    assert [one.mesh is None for one in found.values()].count(True) == 2


def test_a_folder_gives_all_its_surfaces_and_says_what_cannot_be_used(folder):
    by_key = {p.name.removeprefix("deeper-"): p for p in surfaces_of_folder(folder)}
    check(by_key)
    assert len(list(surfaces_of_folder(folder, limit=2))) == 2
    with pytest.raises(ParameterError, match="is not a folder"):
        list(surfaces_of_folder(folder / "disk.obj"))


@pytest.mark.parametrize("name", ["a.zip", "a.tar", "a.tar.gz"])
def test_an_archive_gives_the_same(folder, tmp_path, name):
    path = tmp_path / name
    if name.endswith(".zip"):
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for file in sorted(folder.rglob("*.*")):
                archive.write(file, f"set/{file.relative_to(folder)}")
    else:
        with tarfile.open(path, "w:gz" if name.endswith("gz") else "w") as archive:
            archive.add(folder, "set")
    check({p.name: p for p in surfaces_of_archive(path)})


def test_an_archive_is_not_trusted(tmp_path, monkeypatch):
    outside = tmp_path / "outside.obj"
    content = io.BytesIO()
    write_mesh(tmp_path / "disk.obj", flat_disk(100))
    good = (tmp_path / "disk.obj").read_bytes()
    with tarfile.open(tmp_path / "bad.tar", "w") as archive:
        for name in ("../outside.obj", "/outside.obj", "again/disk.obj", "disk.obj"):
            info = tarfile.TarInfo(name)
            info.size = len(good)
            archive.addfile(info, io.BytesIO(good))
        for kind in (tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.FIFOTYPE):
            info = tarfile.TarInfo("link.obj")
            info.type, info.linkname = kind, "/etc/passwd"
            archive.addfile(info)
    before = sorted(tmp_path.iterdir())
    results = list(surfaces_of_archive(tmp_path / "bad.tar"))
    assert [p.name for p in results] == ["outside", "outside-2", "disk", "disk-2"]
    assert all(p.mesh is not None for p in results)
    assert sorted(tmp_path.iterdir()) == before
    assert not outside.exists()

    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("bomb.obj", b"0" * 3_000_000)
    (tmp_path / "bomb.zip").write_bytes(content.getvalue())
    monkeypatch.setattr(surface_collections, "LARGEST_MEMBER", 1_000_000)
    (bomb,) = surfaces_of_archive(tmp_path / "bomb.zip")
    assert "more than allowed" in bomb.error


@pytest.mark.parametrize("packing", ["gz", "bz2", "xz"])
def test_a_tar_archive_is_not_unpacked_without_bounds(tmp_path, monkeypatch, packing):
    path = tmp_path / "a.tar"
    with tarfile.open(path, f"w:{packing}") as archive:
        info = tarfile.TarInfo("disk.obj")
        info.pax_headers = {"comment": "x" * 2**25}
        archive.addfile(info, io.BytesIO(b""))
    assert path.stat().st_size < 2**20
    with pytest.raises(ParameterError, match=r"a header of 33,\d+,\d+ bytes"):
        list(surfaces_of_archive(path))
    with tarfile.open(path, f"w:{packing}") as archive:
        for name in ("a.bin", "b.obj"):
            info = tarfile.TarInfo(name)
            info.size = 2**25
            archive.addfile(info, io.BytesIO(bytes(info.size)))
    monkeypatch.setattr(surface_collections, "LARGEST_MEMBER", 1_000_000)
    with pytest.raises(ParameterError, match="it unpacks to more than"):
        list(surfaces_of_archive(path))


def test_what_is_no_archive_or_a_damaged_one(tmp_path, folder):
    (tmp_path / "a.zip").write_text("hello")
    with pytest.raises(ParameterError, match="cannot be read as an archive"):
        list(surfaces_of_archive(tmp_path / "a.zip"))
    with tarfile.open(tmp_path / "a.tar.gz", "w:gz") as archive:
        archive.add(folder, "set")
    whole = (tmp_path / "a.tar.gz").read_bytes()
    (tmp_path / "a.tar.gz").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ParameterError, match="cannot be read as an archive"):
        list(surfaces_of_archive(tmp_path / "a.tar.gz"))


#: The parameters of thingi10k 1.5.0's `dataset` that are used, as its signature has them.
FILTERS = [
    "file_id",
    "thing_id",
    "author",
    "license",
    "category",
    "subcategory",
    "name",
    "tags",
    "num_vertices",
    "num_facets",
    "num_components",
    "num_boundary_edges",
    "closed",
    "self_intersecting",
    "manifold",
    "vertex_manifold",
    "edge_manifold",
    "oriented",
    "pwn",
    "solid",
    "euler",
    "genus",
    "query",
]


@pytest.fixture
def thingi10k(monkeypatch, tmp_path):
    """A module with the interface of thingi10k 1.5.0 on three local models."""
    module = types.ModuleType("thingi10k")
    state = {}

    def entry(number, mesh, licence, closed, genus):
        path = tmp_path / f"{number}.npz"
        np.savez(path, vertices=mesh.V, facets=mesh.F.astype(np.int32))
        return {
            "file_id": number,
            "file_path": str(path),
            "license": licence,
            "num_facets": mesh.m,
            "num_components": 1,
            "closed": closed,
            "genus": genus,
        }

    entries = [
        entry(11, BALL, "Creative Commons - Attribution", True, 0),
        entry(12, BALL, "All Rights Reserved", True, 0),
        entry(13, TORUS, "Creative Commons - Public Domain Dedication", True, 1),
        entry(14, flat_disk(200), "Public Domain", False, None),
    ]

    def init(variant=None, cache_dir=None, force_redownload=False):
        state.update(variant=variant, cache_dir=cache_dir)

    def dataset(**filters):
        import re

        assert state, "Dataset is not initialized. Call init() first."
        assert set(filters) <= set(FILTERS)
        assert filters["manifold"] is True
        low, high = filters["num_facets"]
        return [
            e
            for e in entries
            if (filters["license"] is None or re.search(filters["license"], e["license"], re.I))
            and (filters["genus"] is None or e["genus"] == filters["genus"])
            and (low or 0) <= e["num_facets"] <= (high or 10**9)
        ]

    def load_file(file_path):
        with np.load(file_path) as data:
            return np.asarray(data["vertices"], dtype=np.float64), data["facets"]

    module.init, module.dataset, module.load_file = init, dataset, load_file
    monkeypatch.setitem(sys.modules, "thingi10k", module)
    return module


def test_thingi10k_is_filtered_by_licence_and_genus_and_cut(thingi10k, tmp_path):
    (ball,) = surfaces_of_thingi10k(num_facets=(10, None), cache_dir=tmp_path)
    assert (ball.name, ball.cut) == ("thingi-11", True)
    assert ball.licence == "Creative Commons - Attribution"
    assert isinstance(ball.mesh, DiskMesh)
    every = {
        p.name: p for p in surfaces_of_thingi10k(license=None, genus=None, num_facets=(10, None))
    }
    assert sorted(every) == [f"thingi-{k}" for k in (11, 12, 13, 14)]
    assert "genus 0" in every["thingi-13"].error
    assert not every["thingi-14"].cut
    assert len(list(surfaces_of_thingi10k(license=None, num_facets=(10, None), limit=1))) == 1


def test_thingi10k_that_is_damaged_or_not_there(thingi10k, tmp_path, monkeypatch):
    (tmp_path / "11.npz").unlink()
    (gone,) = surfaces_of_thingi10k(num_facets=(10, None))
    assert "11.npz" in gone.error
    thingi10k.init = lambda **_: (_ for _ in ()).throw(RuntimeError("no network"))
    with pytest.raises(ParameterError, match="cannot fetch its models: RuntimeError: no network"):
        list(surfaces_of_thingi10k())
    monkeypatch.setitem(sys.modules, "thingi10k", None)
    with pytest.raises(ParameterError, match="pip install thingi10k"):
        list(surfaces_of_thingi10k())


def test_the_stand_in_has_the_interface_of_the_package():
    real = pytest.importorskip("thingi10k", reason="NOT CHECKED: thingi10k is not installed")
    assert list(inspect.signature(real.dataset).parameters) == FILTERS
    assert list(inspect.signature(real.init).parameters)[:2] == ["variant", "cache_dir"]
