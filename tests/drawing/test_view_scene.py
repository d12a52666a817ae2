import gzip
import json

import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from scipy.spatial import cKDTree

from cembench.conformal.metrics import angle_errors
from cembench.drawing.view_scene import (
    DEGREES,
    MOST,
    TOGETHER,
    ViewedMap,
    rotated_to_match,
    triangles_per_surface,
    upright,
    view_scene,
)


@pytest.fixture(scope="module")
def bowl():
    mesh = hemi_ellipsoid(900)
    return mesh, (mesh.V[:, 0] + 1j * mesh.V[:, 1]) / np.abs(mesh.V[:, 0]).max()


def unpacked(block):
    content = gzip.decompress(block)
    length = int.from_bytes(content[:4], "little")
    head, place, arrays = json.loads(content[4 : 4 + length]), 4 + length, {}
    for name, size, width, many, base in head["arrays"]:
        planes = np.frombuffer(content, np.uint8, size * many, place).reshape(many, -1)
        differences = sum(plane.astype(np.int64) << 8 * k for k, plane in enumerate(planes))
        rows = differences.reshape(-1, width)
        rows = rows + arrays[base].reshape(-1, width) if base else rows.cumsum(axis=0)
        arrays[name] = (rows % 256**many).ravel()
        place += size * many
    assert place == len(content)
    return head, arrays


def test_a_scene_holds_the_surface_its_maps_and_their_distortions(bowl):
    mesh, z = bowl
    folded = z.copy()
    folded[mesh.interior[9]] *= -3
    maps = [ViewedMap("a", z, "a line"), ViewedMap("b", folded), ViewedMap("c", 2 * z)]
    block = view_scene(mesh, maps, "Bowl")
    head, arrays = unpacked(block)
    assert [m["label"] for m in head["maps"]] == ["a", "b", "c"]
    extent = np.ptp(mesh.V, axis=0).max()
    points = arrays["V"].reshape(-1, 3) / head["steps"]["V"] * extent + mesh.V.min(axis=0)
    away, own = cKDTree(mesh.V).query(points)  # in another order
    assert away.max() < 1e-4 * extent
    assert sorted(own) == list(range(mesh.n))
    F = own[arrays["F"].reshape(-1, 3)]
    turned = {tuple(np.roll(t, k)): place for place, t in enumerate(mesh.F) for k in range(3)}
    triangles = [turned[tuple(t)] for t in F]  # with their orientation
    assert sorted(triangles) == list(range(mesh.m))
    error = np.minimum(angle_errors(mesh, z).max(axis=1), DEGREES)[triangles]
    steps = head["steps"]["share"]
    np.testing.assert_allclose(
        arrays["angle0"] / steps * DEGREES, error, atol=0.51 * DEGREES / steps
    )
    u = arrays["uv0"].reshape(-1, 2) / head["steps"]["uv"]
    box = upright(mesh, z)[own]
    wide = max(np.ptp(box.real), np.ptp(box.imag))
    np.testing.assert_allclose(np.ptp(u[:, 0]), np.ptp(box.real) / wide, atol=1e-4)
    np.testing.assert_allclose(np.diff(u[:, 1]), np.diff(box.imag) / wide, atol=1e-4)
    assert not len(arrays["folded0"])
    assert 0 < len(arrays["folded1"]) < 30
    np.testing.assert_array_equal(arrays["uv0"], arrays["uv2"])
    assert block == view_scene(mesh, maps, "Bowl")


def test_few_maps_keep_their_digits(bowl):
    mesh, z = bowl
    _, arrays = unpacked(view_scene(mesh, [ViewedMap("a", z)], "Bowl"))
    assert arrays["uv0"].max() > 2**20


def test_a_large_surface_is_simplified_and_says_how_large_it_was(bowl):
    mesh, z = bowl
    head, arrays = unpacked(view_scene(mesh, [ViewedMap("a", z)], "Bowl", most=300))
    assert head["triangles"] == mesh.m
    assert len(arrays["F"]) <= 3 * 300
    assert arrays["F"].max() + 1 == len(arrays["V"]) / 3 == len(arrays["uv0"]) / 2
    assert len(arrays["mu0"]) == len(arrays["F"]) / 3


def test_maps_are_turned_alike(bowl):
    mesh, z = bowl
    first = upright(mesh, z)
    for angle in (0.3, 2, -3):
        np.testing.assert_allclose(upright(mesh, z * np.exp(1j * angle)), first, atol=1e-9)
        np.testing.assert_allclose(
            rotated_to_match(z * np.exp(1j * angle), first), first, atol=1e-9
        )
    np.testing.assert_array_equal(np.abs(np.abs(first) - np.abs(z)) < 1e-12, True)


def test_many_surfaces_share_what_a_page_may_hold():
    assert triangles_per_surface([90_000]) == MOST
    assert triangles_per_surface([90_000] * 10) == TOGETHER // 10
    assert triangles_per_surface([5_000, *[90_000] * 5]) == (TOGETHER - 5_000) // 5
    assert triangles_per_surface([90_000] * 1000) == 5_000
