"""UVs that exist are measured as an independent computation says."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cembench
from cembench.core.errors import MeshError
from cembench.mesh.files import write_soup
from cembench.mesh.soup import Soup


def square(n=6, size=1.0, at=0.0):
    """A flat square of n x n squares, its UVs (of the unit square times `size`), and its F."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    k = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[1:, :-1], k[1:, 1:], k[:-1, 1:]))
    F = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    V = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    return V, F, V[:, :2] / n * size + at


def stretches(V, F, uv):
    """Singular values of each triangle's map, by its 2 x 2 matrix."""
    found = []
    for t, image in zip(V[F], uv, strict=True):
        e1, e2 = t[1] - t[0], t[2] - t[0]
        x = e1 / np.linalg.norm(e1)
        y = e2 - (e2 @ x) * x
        y /= np.linalg.norm(y)
        space = np.array([[e1 @ x, e2 @ x], [e1 @ y, e2 @ y]])
        plane = np.stack([image[1] - image[0], image[2] - image[0]], axis=1)
        found.append(np.linalg.svd(plane @ np.linalg.inv(space), compute_uv=False))
    return np.array(found)


def areas_of(V, F):
    return np.linalg.norm(np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]), axis=1) / 2


@pytest.fixture(scope="module")
def mapped():
    return cembench.parameterize(cembench.surface("hemi-ellipsoid", 800), "bff-free")


def test_figures_are_those_of_an_independent_computation(mapped):
    V, F, uv = mapped.mesh.V, mapped.mesh.F, mapped.uv
    found = cembench.measure(V, F, uv).metrics
    areas = areas_of(V, F)
    values = stretches(V, F, uv[F])
    values *= np.sqrt(areas.sum() / (areas @ values.prod(axis=1)))
    assert_allclose(
        found["symmetric_dirichlet"],
        (areas @ (values**2 + values**-2.0).sum(axis=1)) / areas.sum(),
        rtol=1e-9,
    )
    assert_allclose(found["dilatation_max"], (values[:, 0] / values[:, 1]).max(), rtol=1e-9)
    assert values[:, 0].min() <= found["largest_stretch_1%"] <= found["largest_stretch_50%"]
    for name in ("angle_error_mean_deg", "dirichlet_energy", "texel_density_ratio"):
        assert_allclose(found[name], mapped.metrics[name], rtol=1e-9)


def test_arrays_a_file_a_pair_and_objects_give_the_same(mapped, tmp_path):
    trimesh, pyvista = pytest.importorskip("trimesh"), pytest.importorskip("pyvista")
    V, F, uv = mapped.mesh.V, mapped.mesh.F, mapped.uv
    cembench.write_mesh(tmp_path / "a.obj", mapped.mesh, uv)
    cembench.write_mesh(tmp_path / "a.npz", mapped.mesh, uv)
    np.savez(tmp_path / "corners.npz", V=V, F=F, uv=uv[F])
    np.savez(tmp_path / "complex.npz", V=V, F=F, uv=mapped.z[F])
    textured = pyvista.make_tri_mesh(V, F)
    textured.active_texture_coordinates = uv
    plain = cembench.measure(V, F, uv).metrics
    visual = trimesh.visual.TextureVisuals(uv=uv)
    for one in (
        cembench.measure((V, F), uv[F]),
        cembench.measure(mapped.mesh, mapped.z),
        cembench.measure(tmp_path / "a.obj"),
        cembench.measure(tmp_path / "a.npz"),
        cembench.measure(tmp_path / "corners.npz"),
        cembench.measure(tmp_path / "complex.npz"),
        cembench.measure({"V": V, "F": F, "uv": uv}),
        cembench.measure(trimesh.Trimesh(V, F, visual=visual, process=False)),
        cembench.measure(textured),
    ):
        assert_allclose(one.metrics["angle_error_mean_deg"], plain["angle_error_mean_deg"])
        assert one.metrics["islands"] == 1


def test_islands_seams_mirrors_tiles_and_overlaps_are_found():
    V, F, uv = square(4)
    left = V[F][:, :, 0].mean(axis=1) < 2
    corners = uv[F].copy()
    corners[left, :, 0] = 0.5 - corners[left, :, 0] + 2.0  # mirrored, in the tile 1003
    found = cembench.measure(V, F, corners)
    m = found.metrics
    assert (m["islands"], m["mirrored_islands"], m["tiles"], m["flipped_triangles"]) == (2, 1, 2, 0)
    assert_allclose([m["seam_length"], m["covered_share"]], [4, 0.5])
    assert sorted(one["tile"] for one in found.islands) == [1001, 1003]
    assert m["overlap_between_islands"] == m["islands_beyond_their_tile"] == 0
    corners[left, :, 0] -= 1.75  # half of it over the other one
    m = cembench.measure(V, F, corners).metrics
    assert_allclose(m["overlap_between_islands"], 0.25, atol=1e-12)
    assert_allclose(m["overlap_inside_islands"], 0, atol=1e-12)
    assert_allclose(m["covered_share"], 0.75)


def test_stacked_islands_overlap_as_random_points_say():
    rng = np.random.default_rng(3)
    V, F, uv = square(5)
    turned = uv @ np.array([[0.8, -0.6], [0.6, 0.8]]) * 0.7 + 0.2
    both = np.concatenate([V, V + np.array([9, 0, 0])])
    found = cembench.measure(both, np.concatenate([F, F + len(V)]), np.concatenate([uv, turned]))
    points = rng.uniform(0, 1, (200_000, 2))
    back = (points - 0.2) / 0.7 @ np.array([[0.8, 0.6], [-0.6, 0.8]])
    share = ((back > 0) & (back < 1)).all(axis=1).mean() / (1 + 0.49)
    assert_allclose(found.metrics["overlap_between_islands"], share, rtol=0.02)


def test_an_island_over_itself_is_told_from_one_over_another():
    t = np.linspace(0, 3 * np.pi, 200)
    V = np.concatenate([np.stack([r * np.cos(t), r * np.sin(t), t], axis=1) for r in (1.0, 2.0)])
    k = np.arange(199)
    F = np.concatenate(
        [np.stack([k, k + 200, k + 201], axis=1), np.stack([k, k + 201, k + 1], axis=1)]
    )
    F = F[:, ::-1]
    found = cembench.measure(V, F, V[:, :2])  # the first half turn lies under the last
    assert_allclose(found.metrics["overlap_inside_islands"], 1 / 3, rtol=1e-3)
    assert found.metrics["overlap_between_islands"] == 0


def test_an_island_that_is_folded_lies_over_itself():
    V, F, uv = square(6)
    uv = uv.copy()
    uv[:, 0] = 0.1 + np.abs(uv[:, 0] - 1 / 3)  # the first third of it comes to lie on the second
    m = cembench.measure(V, F, uv).metrics
    assert m["flipped_triangles"] == len(F) / 3
    assert_allclose([m["overlap_inside_islands"], m["covered_share"]], [1 / 3, 2 / 3])
    assert m["overlap_between_islands"] == 0


def test_both_sides_of_a_sheet_at_the_same_uvs_overlap():
    V, F, uv = square(3)
    both = np.concatenate([F, F[:, ::-1]])  # joined along all edges: no side bounds the island
    m = cembench.measure(V, both, uv).metrics
    assert m["islands"] == 1
    assert_allclose([m["overlap_inside_islands"], m["covered_share"]], [0.5, 1])


def test_a_texture_that_repeats_is_no_tile_of_a_set():
    V, F, uv = square(4, size=3.0, at=-2.0)
    found = cembench.measure(V, F, uv)
    assert "1 of 1 island beyond one tile, where the texture repeats" in found.verdict
    assert "covered" not in found.verdict
    assert found.islands[0]["tile"] is None
    V, F, uv = square(4)
    tiles = np.concatenate([uv[F], uv[F] + np.array([2, 1])])
    both = np.concatenate([V, V + np.array([9, 0, 0])])
    found = cembench.measure(both, np.concatenate([F, F + len(V)]), tiles)
    assert [one["tile"] for one in found.islands] == [1001, 1013]
    assert "100 % of 2 tiles covered" in found.verdict


def test_a_triangle_that_has_collapsed_to_a_point_has_no_angles():
    V, F, uv = square(1)
    m = cembench.measure(V, F, np.where(np.isin(np.arange(4), F[0])[:, None], 0.0, uv)).metrics
    assert_allclose(m["angle_error_mean_deg"], 60)


def test_the_worst_places_are_apart_and_named_by_triangle():
    V, F, uv = square(20)
    uv = uv.copy()
    uv[[45, 46, 200, 330]] += [0.02, 0.03]
    found = cembench.measure(V, F, uv)
    triangles = [place.triangle for place in found.worst]
    K = stretches(V, F, uv[F])
    assert triangles[0] == np.argmax(K[:, 0] / K[:, 1])
    centres = V[F].mean(axis=1)[triangles]
    gaps = np.linalg.norm(centres[:, None] - centres[None], axis=2)[np.triu_indices(3, 1)]
    assert gaps.min() > 0.05 * np.linalg.norm([20, 20])


def test_seams_are_found_where_a_file_has_copies_of_vertices(tmp_path):
    V, F, uv = square(4)
    corners = uv[F].copy()
    corners[V[F][:, :, 0].mean(axis=1) < 2] += [0, 3]
    z = corners.reshape(-1, 2) @ [1, 1j]
    soup = Soup.of_triangles(V, F, z, np.arange(F.size).reshape(-1, 3))
    for name in ("a.obj", "a.ply", "a.npz", "a.glb", "a.vtp"):
        write_soup(tmp_path / name, soup)
        m = cembench.measure(tmp_path / name).metrics
        assert (m["islands"], len(F)) == (2, 32)
        assert_allclose(m["seam_length"], 4, rtol=1e-6)


def test_best_maps_say_what_seams_bought():
    ball = cembench.surface("spherical-cap", 600)
    V, F = ball.V, ball.F
    left = V[F][:, :, 0].mean(axis=1) < 0
    corners = V[F][:, :, :2].copy()
    corners[left, :, 0] -= 3.0
    found = cembench.measure(V, F, corners, against="best")
    islands, whole = found.best["the same islands"], found.best["the surface without seams"]
    assert islands.angle_error_mean_deg < found.metrics["angle_error_mean_deg"]
    assert islands.share == pytest.approx(1)
    assert whole.share == pytest.approx(1)
    assert "the seams buy" in found.verdict


def test_a_triangle_without_uvs_is_left_out_and_said(tmp_path):
    lines = ["v 0 0 0", "v 1 0 0", "v 1 1 0", "v 0 1 0", "vt 0 0", "vt 1 0", "vt 1 1"]
    (tmp_path / "a.obj").write_text("\n".join([*lines, "f 1/1 2/2 3/3", "f 1 3 4", ""]))
    found = cembench.measure(tmp_path / "a.obj")
    assert found.mesh.m == 1
    assert "1 of 2 triangles have no UVs" in found.notices[0]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "holds no UVs"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/2 3/3\n", "UV number 1"),
    ],
)
def test_a_file_without_usable_uvs_says_so(tmp_path, content, words):
    (tmp_path / "a.obj").write_text(content)
    with pytest.raises(MeshError, match=words):
        cembench.measure(tmp_path / "a.obj")


def test_uvs_of_another_shape_or_missing_are_refused(mapped):
    with pytest.raises(MeshError, match="one for each vertex"):
        cembench.measure(mapped.mesh, mapped.uv[:-1])
    with pytest.raises(MeshError, match="no texture coordinates"):
        cembench.measure(mapped.mesh)
    with pytest.raises(MeshError, match="NaN"):
        cembench.measure(mapped.mesh, mapped.uv * np.nan)


def test_off_files_and_uvs_of_vertices_that_corners_do_not_name(tmp_path):
    lines = ["v 0 0 0", "v 1 0 0", "v 1 1 0", "vt 0 0", "vt 1 0", "vt 1 1", "f 1 2 3", ""]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    rows = ["STOFF", "3 1 0", "0 0 0 0 0", "1 0 0 1 0", "1 1 0 1 1", "3 0 1 2", ""]
    (tmp_path / "a.off").write_text("\n".join(rows))
    for name in ("a.obj", "a.off"):
        assert cembench.measure(tmp_path / name).metrics["symmetric_dirichlet"] == pytest.approx(4)


def test_points_with_uvs_and_no_faces_are_no_surface(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    points = pyvista.PolyData(np.eye(3))
    points.verts = np.empty(0, dtype=np.int64)
    points.active_texture_coordinates = np.eye(3)[:, :2]
    points.save(tmp_path / "a.vtp")
    for call in (cembench.read_mesh, cembench.measure):
        with pytest.raises(MeshError, match="no faces"):
            call(tmp_path / "a.vtp")


def test_overlaps_that_cannot_be_told_are_not_called_none(monkeypatch):
    monkeypatch.setattr("cembench.conformal.planar.MAX_CROSSINGS", -(10**9))
    V, F, uv = square(3)
    found = cembench.measure(V, F, uv)
    assert found.metrics["overlap_between_islands"] is None
    assert "overlaps between islands cannot be told" in found.verdict
