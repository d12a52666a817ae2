"""Every disk ends in a valid map, and the last resort says what it did."""

import numpy as np
import pytest
from cembench.algorithms.bff.disk import bff
from cembench.algorithms.cem import cem
from cembench.algorithms.cetm.flips import cetm_flips
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.tin import tin

from cembench import AlgorithmFailed, DiskMesh
from cembench.conformal.harmonic import harmonic_extension
from cembench.conformal.laplacian import laplacian
from cembench.conformal.last_resort import MIN_ARC, valid_map
from cembench.conformal.metrics import (
    MapFigures,
    all_metrics,
    flipped_triangles,
    is_disk_map,
)
from cembench.conformal.planar import turns
from cembench.conformal.untangling import _Patches, untangled
from cembench.core.notices import NoticeKind
from cembench.running.quality import quality_notes
from tests import gallery
from tests.campaign.hard_meshes import pinched_boundary

TOOLS = [direct_cem, bff, cetm_flips]


def long_band():
    """A planar band 40 times as long as wide: arcs of a conformal map fall to exp(-60)."""
    return DiskMesh.from_arrays(*gallery.flat_rectangle(4, 160))


def is_valid(mesh, uv):
    return is_disk_map(mesh, uv) and turns(uv[mesh.boundary]) == (1, 1, 0)


@pytest.mark.parametrize("method", TOOLS)
def test_a_band_too_long_for_doubles_has_a_valid_map_by_every_tool(method):
    mesh = long_band()
    result = method(mesh)
    assert is_valid(mesh, result.uv)
    assert not flipped_triangles(mesh, result.uv)
    assert result.extras["last_resort"]["moved_boundary_vertices"] > 0


@pytest.mark.parametrize("method", TOOLS)
def test_without_interior_vertices_the_boundary_is_all_of_the_map(method):
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle(1, 5))
    result = method(mesh)
    assert is_valid(mesh, result.uv)
    assert not flipped_triangles(mesh, result.uv)


def test_an_own_failure_is_recorded_and_told():
    mesh = long_band()
    result = bff(mesh)
    assert "too crowded" in result.extras["failure"]
    note = quality_notes("disk", MapFigures(mesh, result.uv), result.extras)[0]
    assert note.kind is NoticeKind.LAST_RESORT
    assert "too crowded" in note.text
    assert "--target plane" in note.text


def test_a_valid_map_stays_as_it_is():
    mesh = flat_disk(600)
    own = direct_cem(mesh, repair=False).uv
    uv, extras = valid_map(mesh, own)
    assert uv is own
    assert extras == {"fold_repairs": 0, "folded_before_repair": 0}


def test_corners_too_close_for_doubles_are_moved_apart_and_hardly_anything_else():
    V, F = gallery.flat_rectangle(6, 9)
    mesh = DiskMesh.from_arrays(V, F)
    b = mesh.boundary
    ear = mesh.F[np.isin(mesh.F, b).all(axis=1)][0]
    tip = next(k for k, v in enumerate(b) if {v, b[k - 1], np.roll(b, -1)[k]} == set(ear.tolist()))
    arcs = np.ones(len(b))
    arcs[[tip - 1, tip]] = 1e-12
    circle = np.exp(2j * np.pi * (np.cumsum(arcs) - arcs) / arcs.sum())
    own = harmonic_extension(laplacian(mesh), b, circle)
    assert flipped_triangles(mesh, own)
    uv, extras = valid_map(mesh, own)
    assert not flipped_triangles(mesh, uv)
    assert 0 < extras["last_resort"]["moved_boundary_vertices"] <= 3
    assert extras["last_resort"]["mean_value_vertices"] == 0
    assert abs(uv - own).max() < 4 * MIN_ARC


def test_a_map_whose_patches_cannot_be_laid_out_becomes_convex_near_its_folds():
    mesh = flat_disk(600)
    own = mesh.V[:, 0] + 1j * mesh.V[:, 1]
    own[mesh.boundary] /= np.abs(own[mesh.boundary])
    mirrored = own.copy()
    inner = np.abs(own) < 0.3
    mirrored[inner] = np.conj(own[inner])  # half a turn of it cannot be undone by patches alone
    uv, extras = valid_map(mesh, mirrored)
    assert not flipped_triangles(mesh, uv)
    assert extras["before_repair"]["flipped_triangles"] > 0


def test_a_map_turned_over_ends_valid():
    mesh = flat_disk(150)
    uv, extras = valid_map(mesh, mesh.V[:, 0] - 1j * mesh.V[:, 1])
    assert is_valid(mesh, uv)
    assert extras["last_resort"]["mean_value_vertices"] == len(mesh.interior)


def test_the_paper_s_algorithms_have_it_on_request_only():
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle(1, 5))
    with pytest.raises(AlgorithmFailed):
        cem(mesh)
    assert is_valid(mesh, cem(mesh, last_resort=True).uv)
    with pytest.raises(AlgorithmFailed):
        cem(mesh, last_resort=True, repair=False)


@pytest.mark.parametrize("seed", range(6))
def test_the_whole_interior_is_laid_out_in_few_steps_or_not_at_all(seed, monkeypatch):
    mesh = DiskMesh.from_arrays(*pinched_boundary(np.random.default_rng(seed)))
    steps, step = [], _Patches.newton_step

    def counted(*arguments, **more):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(_Patches, "newton_step", lambda *k: steps.append(k) or step(*k))
            return untangled(*arguments, **more)

    monkeypatch.setattr("cembench.conformal.last_resort.untangled", counted)
    assert is_valid(mesh, direct_cem(mesh, splits=0).uv)
    assert len(steps) <= 3 * 8  # of patches, and twice of all


def test_the_repair_of_a_survey_s_folds_keeps_the_energy():
    mesh = tin(2_000, seed=20, twins=0.2, relief=1.0)
    made = direct_cem(mesh, delaunay=False, back=0.0, even=0)
    before = made.extras["before_repair"]
    assert is_valid(mesh, made.uv)
    assert before["flipped_triangles"] > 10
    assert made.extras["last_resort"]["mean_value_vertices"] < 30
    assert all_metrics(mesh, made.uv)["conformal_energy"] < 1.01 * before["conformal_energy"]
