"""Faces of the ICT model: parts, correspondence, seeds, expressions, and files that are missing."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from cembench.surfaces import ict_model
from cembench.surfaces.ict_face import LANDMARKS, PARTS, ict_face, landmarks, sample, triangulation

import cembench
from cembench.core.errors import DatasetError, ParameterError
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh
from tests.real_meshes import real_mesh


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(autouse=True)
def model(monkeypatch, cache):
    """The model's files that are published beside the real meshes."""
    monkeypatch.setenv("CEMBENCH_CACHE", str(cache))
    folder = real_mesh("ict/generic_neutral_mesh.obj").parent
    monkeypatch.setenv("CEMBENCH_ICT_FACE", str(folder))
    return folder


@pytest.mark.parametrize("part", PARTS)
def test_every_part_has_its_counts_and_holes(part):
    mesh = ict_face(part=part, seed=5)
    extent = PARTS[part]
    assert (mesh.n, mesh.m) == (extent.vertices, extent.triangles)
    assert isinstance(mesh, DiskMesh if part == "disk" else HoledMesh)
    assert len(mesh.loops) == (1 if part == "disk" else 4)


@pytest.mark.parametrize("part", PARTS)
def test_a_decimated_part_keeps_its_topology_and_takes_vertices_of_the_sample(part):
    mesh = ict_face(2_000, part=part, seed=5, expression="jawOpen")
    made = triangulation(part, 2_000)
    assert 1_900 < mesh.m <= 2_000
    assert len(mesh.loops) == (1 if part == "disk" else 4)
    whole = sample(ict_model.load_model(), 5, "jawOpen")
    assert np.array_equal(mesh.V, whole[made.kept])


def test_samples_correspond_vertex_by_vertex_and_differ_in_shape():
    one, other = ict_face(seed=1), ict_face(seed=2, expression="mouthSmile")
    assert np.array_equal(one.F, other.F)
    apart = np.linalg.norm(one.V - other.V, axis=1)
    assert 0.05 < apart.mean() < 3
    assert one.name == "ict-face-1"
    assert other.name == "ict-face-2-mouthSmile"


def test_the_same_seed_gives_the_same_bytes():
    assert ict_face(seed=7).hash == ict_face(seed=7).hash
    assert ict_face(seed=7, expression="random").hash == ict_face(seed=7, expression="random").hash
    assert ict_face(seed=7).hash != ict_face(seed=8).hash


def test_coefficients_are_standard_normal():
    model = ict_model.load_model()
    mode = model.identities["identity000"]
    others = [m.ravel() for name, m in model.identities.items() if name != "identity000"]
    basis = np.stack([mode.ravel(), *others], axis=1)
    moved = np.stack([(sample(model, seed) - model.V).ravel() for seed in range(60)], axis=1)
    found = np.linalg.lstsq(basis, moved, rcond=None)[0].ravel()
    assert abs(found.mean()) < 4 / np.sqrt(found.size)
    assert 0.8 < found.std() < 1.2


def test_a_seed_gives_the_same_coefficients_where_modes_are_missing(model, tmp_path, monkeypatch):
    for name in ("generic_neutral_mesh", "identity001"):
        shutil.copy(model / f"{name}.obj", tmp_path)
    whole = ict_model.load_model()
    monkeypatch.setenv("CEMBENCH_ICT_FACE", str(tmp_path))
    fewer = ict_model.load_model()
    assert list(fewer.identities) == ["identity001"]
    part = sample(fewer, 3) - fewer.V
    mode = whole.identities["identity001"]
    c = float((part * mode).sum() / (mode**2).sum())
    assert np.allclose(part, c * mode)
    all_modes = np.stack([m.ravel() for m in whole.identities.values()], axis=1)
    found = np.linalg.lstsq(all_modes, (sample(whole, 3) - whole.V).ravel(), rcond=None)[0]
    assert c == pytest.approx(found[list(whole.identities).index("identity001")])


def test_expressions_add_up_and_the_neutral_face_is_as_published(model):
    there = ict_model.load_model()
    smile = sample(there, 4, "mouthSmile") - sample(there, 4)
    sides = [sample(there, 4, f"mouthSmile_{side}") - sample(there, 4) for side in "LR"]
    assert np.allclose(smile, sides[0] + sides[1])
    half = sample(there, 4, "jawOpen:0.5+mouthSmile_L:0.25") - sample(there, 4)
    whole = there.expressions["jawOpen"] / 2 + there.expressions["mouthSmile_L"] / 4
    assert np.allclose(half, whole)
    published = np.loadtxt(
        [line[2:] for line in (model / "jawOpen.obj").read_text().splitlines() if line[:2] == "v "]
    )
    moved = there.V + there.expressions["jawOpen"]
    assert np.allclose(moved, published[: len(moved)], atol=1e-5)


@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("frown", r"expression 'frown' is unknown; available are: neutral, random, jawOpen"),
        ("eyeBlink", r"'eyeBlink' is not among the available files"),
        ("jawOpen:2", r"the weight '2' is not a number from 0 to 1"),
        ("jawOpen:wide", r"the weight 'wide' is not a number"),
    ],
)
def test_an_expression_that_cannot_be_made(expression, message):
    with pytest.raises(ParameterError, match=message):
        cembench.surface("ict-face", expression=expression)


def test_landmarks_are_found_on_every_part_and_size():
    for faces in (28_068, 3_000):
        mesh = ict_face(faces, part="narrow")
        placed = landmarks(mesh)
        assert list(placed) == list(LANDMARKS)
        assert len(set(placed.values())) == len(LANDMARKS)
        assert not set(placed.values()) & set(np.concatenate(mesh.loops).tolist())
        nose = mesh.V[placed["nose_tip"]]
        assert nose[2] > np.quantile(mesh.V[:, 2], 0.99)
        assert mesh.V[placed["eye_outer_right"], 0] < 0 < mesh.V[placed["eye_outer_left"], 0]


def test_landmarks_of_another_surface_are_refused():
    with pytest.raises(ParameterError, match="flat-disk has no landmarks: it is not"):
        landmarks(cembench.surface("flat-disk", 200))


def test_without_its_files_the_error_says_how_to_fetch(monkeypatch, tmp_path):
    monkeypatch.setenv("CEMBENCH_ICT_FACE", str(tmp_path / "nowhere"))
    with pytest.raises(DatasetError, match=r"cembench.fetch.*ict-face.*CEMBENCH_ICT_FACE"):
        cembench.surface("ict-face")


def test_a_file_of_another_mesh_or_cut_short_is_refused(model, monkeypatch, tmp_path):
    shutil.copy(model / "generic_neutral_mesh.obj", tmp_path)
    monkeypatch.setenv("CEMBENCH_ICT_FACE", str(tmp_path))
    (tmp_path / "identity000.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(DatasetError, match="has 3 vertices and 1 polygons; a file of the ICT"):
        cembench.surface("ict-face")
    content = (model / "identity000.obj").read_bytes()
    (tmp_path / "identity000.obj").write_bytes(content[: len(content) // 3])
    with pytest.raises(DatasetError, match="identity000"):
        cembench.surface("ict-face")


def test_small_files_are_read_and_a_damaged_one_is_told(model, monkeypatch, tmp_path):
    for name in ("generic_neutral_mesh", "identity000"):
        small = ict_model.small_arrays(model / f"{name}.obj")
        assert len(small) < 500_000
        (tmp_path / f"{name}.npz").write_bytes(small)
    monkeypatch.setenv("CEMBENCH_ICT_FACE", str(tmp_path))
    mesh = cembench.surface("ict-face", seed=1)
    assert mesh.m == 28_068
    (tmp_path / "identity000.npz").write_bytes(small[:-100])
    with pytest.raises(DatasetError, match=r"identity000\.npz is damaged"):
        cembench.surface("ict-face", seed=1)
