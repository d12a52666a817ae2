"""What a note or a failure recommends was tried on that surface, or is sure by a theorem."""

import re

import numpy as np
import pytest

import cembench
from cembench import DiskMesh, HoledMesh
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.cut import cut_open
from cembench.running.quality import free_map
from tests import gallery

FREE = [a.name for a in cembench.list_algorithms() if a.target == "free boundary" and a.usual]
OURS = ["abf++", "abf-linear", "angenent-haker", "bff-free", "cetm-free", "lscm", "scp"]


def strip(n, rise=0.3, seed=0):
    """A bent strip of n quadrilaterals without interior vertices."""
    rng = np.random.default_rng(seed)
    x = np.cumsum(rng.uniform(0.5, 1.5, n + 1))
    z = rise * np.sin(x)
    V = np.stack([np.repeat(x, 2), np.tile([0.0, 1.0], n + 1), np.repeat(z, 2)], axis=1)
    a = 2 * np.arange(n)
    return V, np.concatenate([np.stack([a, a + 2, a + 1], 1), np.stack([a + 1, a + 2, a + 3], 1)])


def fan(n):
    """Triangles around a boundary vertex of a cone, no two in one plane."""
    angle = np.linspace(0, 1.2 * np.pi, n + 1)
    rim = np.stack([np.cos(angle), np.sin(angle), 0.5 + 0.2 * np.cos(3 * angle)], axis=1)
    k = np.arange(1, n + 1)
    return np.vstack([np.zeros(3), rim]), np.stack([0 * k, k, k + 1], axis=1)


def tube(n=12):
    angle = 2 * np.pi * np.arange(n) / n
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    i, j = np.arange(n), (np.arange(n) + 1) % n
    F = np.concatenate([np.stack([i, j, j + n], 1), np.stack([i, j + n, i + n], 1)])
    return np.vstack([ring, ring + np.array([0, 0, 2])]), F


@pytest.mark.parametrize("name", OURS)
@pytest.mark.parametrize("surface", [strip(1), strip(29), strip(400), fan(9)])
def test_a_free_boundary_unrolls_what_has_no_interior_vertex_exactly(name, surface):
    result = cembench.parameterize(*surface, algorithm=name)
    assert result.metrics["angle_error_mean_deg"] < 1e-6
    assert result.metrics["flipped_triangles"] == 0


def test_these_are_all_of_ours():
    assert set(FREE) <= set(OURS)


def advised(text):
    """The options of the last algorithm that a text recommends."""
    return re.findall(r"(--cut )?-a ([\w+-]+)((?: -p \w+=\w+)*)", text)[-1]


def followed(mesh, text):
    cut, name, parameters = advised(text)
    mesh = cut_open(mesh).mesh if cut else mesh
    values = dict(re.findall(r"-p (\w+)=(\w+)", parameters))
    return cembench.parameterize(mesh, name, **{k: v == "true" for k, v in values.items()})


@pytest.mark.parametrize("surface", [strip(29), fan(9)])
def test_the_notes_on_a_strip_recommend_what_is_exact(surface):
    mesh = DiskMesh.from_arrays(*surface)
    result = cembench.parameterize(mesh, "direct-cem", keep_invalid=True)
    texts = [text for text in result.notices if "-a " in text]
    assert texts
    for text in texts:
        assert followed(mesh, text).metrics["angle_error_mean_deg"] < 1e-6


def test_a_tube_without_interior_vertices_is_told_what_is_exact():
    mesh = HoledMesh.from_arrays(*tube())
    with pytest.raises(AlgorithmFailed, match="unrolls it exactly: --cut -a lscm") as failed:
        cembench.parameterize(mesh, "direct-cem-holes")
    assert followed(mesh, str(failed.value)).metrics["angle_error_mean_deg"] < 1e-6


@pytest.mark.parametrize("mesh", [gallery.three_holes(), cembench.surface("hemi-ellipsoid", 400)])
def test_the_map_that_is_named_has_the_error_that_is_named(mesh):
    error, advice = free_map(mesh)
    reached = followed(mesh, advice).metrics["angle_error_mean_deg"]
    assert reached == pytest.approx(error, rel=1e-6, abs=1e-9)
