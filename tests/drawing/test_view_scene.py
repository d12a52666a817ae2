import gzip
import json

import numpy as np
import pytest
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench.conformal.metrics import angle_errors
from cembench.drawing.view_scene import (
    DEGREES,
    MOST,
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
    for name, kind, size in head["arrays"]:
        arrays[name] = np.frombuffer(content, f"<{kind}", size, place)
        place += -(-arrays[name].nbytes // 4) * 4
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
    np.testing.assert_array_equal(arrays["F"].reshape(-1, 3), mesh.F)
    extent = np.ptp(mesh.V, axis=0).max()
    points = arrays["V"].reshape(-1, 3) / 65535 * extent + mesh.V.min(axis=0)
    np.testing.assert_allclose(points, mesh.V, atol=1e-5 * extent)
    error = np.minimum(angle_errors(mesh, z).max(axis=1), DEGREES)
    np.testing.assert_allclose(arrays["angle0"] / 255 * DEGREES, error, atol=DEGREES / 500)
    assert not len(arrays["folded0"])
    assert 0 < len(arrays["folded1"]) < 30
    np.testing.assert_array_equal(arrays["uv0"], arrays["uv2"])
    assert block == view_scene(mesh, maps, "Bowl")


def test_few_maps_keep_their_digits(bowl):
    mesh, z = bowl
    _, arrays = unpacked(view_scene(mesh, [ViewedMap("a", z)], "Bowl"))
    assert arrays["uv0"].dtype == np.float32


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
    assert triangles_per_surface(1) == MOST
    assert triangles_per_surface(20) == 10_000
    assert triangles_per_surface(1000) == 5_000
