"""Notes on surfaces that cannot be what was meant, and none on those that can."""

import numpy as np
import pytest

import cembench
from cembench.core.notices import NoticeKind
from cembench.mesh.defects import UnusableMeshError
from cembench.mesh.plausibility import implausible
from tests import gallery


def hill(size=20, scale=1.0):
    V, F = gallery.flat_rectangle(size, size)
    V = V / size
    V[:, 2] = 0.3 * np.sin(3 * V[:, 0]) * np.cos(2 * V[:, 1])
    return scale * V, F


def kinds(V, F):
    return [notice.kind for notice in implausible(V, F)]


@pytest.mark.parametrize("offset", [1e7, 4.5e6])
def test_single_precision_far_from_the_origin(offset):
    V, F = hill()
    far = (V + np.array([offset / 8, offset, 0])).astype(np.float32).astype(float)
    (note,) = [n for n in implausible(far, F) if n.kind is NoticeKind.COARSE_COORDINATES]
    assert "single precision holds coordinates" in note.text
    assert "Subtract an offset such as (" in note.text
    assert kinds(V + np.array([offset / 8, offset, 0]), F) == []
    assert (
        kinds((100 * V + np.array([offset / 100, 0, 0])).astype(np.float32).astype(float), F) == []
    )


def test_a_refusal_names_coordinates_that_are_too_coarse():
    V, F = hill(60)
    far = (V + np.array([5e5, 4.5e6, 0])).astype(np.float32).astype(float)
    with pytest.raises(UnusableMeshError, match="Note: single precision holds coordinates"):
        cembench.TriangleMesh(far, F)


def test_degrees_and_metres():
    V, F = hill()
    V = V * [0.5, 0.4, 3000] + [7.2, 46.3, 500]
    (note,) = implausible(V, F)
    assert note.kind is NoticeKind.MIXED_UNITS
    factors = [float(word.strip(",")) for word in note.text.replace("*", " ").split()
               if word.strip(",").isdigit() and len(word) > 4]  # fmt: skip
    assert len(factors) == 2
    assert implausible(V * [*factors, 1], F) == ()


def test_a_tall_tube_and_a_steep_hill_are_no_mix_of_units():
    V, F = gallery.tube()
    assert kinds(V * [1, 1, 80], F) == []
    V, F = hill()
    assert kinds(V * [1, 1, 10], F) == []


@pytest.mark.parametrize("gap", [1e-9, 1e-6, 1e-5])
def test_pieces_a_tiny_distance_apart_and_the_weld_that_joins_them(gap):
    V, F = hill()
    W = V * [-1, 1, 1] - [gap, 0, 0]
    both = np.vstack([V, W]), np.vstack([F, F[:, ::-1] + len(V)])
    (note,) = implausible(*both)
    assert note.kind is NoticeKind.GAPS
    weld = float(note.text.split("--weld ")[1].split()[0])
    assert cembench.repair(both, weld=weld).kept.is_whole
    assert kinds(np.vstack([V, W - 0.1 * np.array([1, 0, 0])]), both[1]) == []


@pytest.mark.parametrize("gap", [1e-8, 1e-6])
def test_two_sheets_that_nearly_coincide(gap):
    sphere = cembench.surface("flat-disk", 400)
    V, F = sphere.V, sphere.F
    apart = np.vstack([V, V + np.array([0, 0, gap])]), np.vstack([F, F + len(V)])
    (note,) = implausible(*apart)
    assert note.kind in (NoticeKind.NEAR_SHEETS, NoticeKind.GAPS)
    weld = float(note.text.split("--weld ")[1].split()[0])
    assert cembench.repair(apart, weld=weld).mesh.m == len(F)
    closed, G = gallery.torus()
    thin = np.vstack([closed, closed * (1 + gap)]), np.vstack([G, G[:, ::-1] + len(closed)])
    assert kinds(*thin) == [NoticeKind.NEAR_SHEETS]


def test_nothing_is_said_of_sound_surfaces():
    for name in ("flat-disk", "hemi-ellipsoid", "cylinder-sheet", "disk-with-holes"):
        if name in cembench.list_surfaces():
            mesh = cembench.surface(name)
            assert implausible(mesh.V, mesh.F) == ()
    for V, F in (gallery.torus(), gallery.tube(), gallery.octahedron(), hill()):
        assert implausible(V, F) == ()


@pytest.mark.process
def test_the_notes_are_those_of_a_map_too(tmp_path):
    V, F = hill()
    V = V * [0.5, 0.4, 3000] + [7.2, 46.3, 500]
    (tmp_path / "a.obj").write_text(gallery.obj_text(V, F))
    (mapped,) = cembench.map_files(tmp_path / "a.obj")
    assert NoticeKind.MIXED_UNITS in {n.kind for n in mapped.surface.mesh.notices}
    result = cembench.parameterize(V, F, keep_invalid=True)
    assert any("look like degrees" in notice for notice in result.notices)
