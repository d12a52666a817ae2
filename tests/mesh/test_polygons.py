import numpy as np
import pytest

import cembench
from cembench.mesh.polygons import triangulate

L_SHAPE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
ARROW = [(0, 0), (2, 1), (0, 2), (1, 1)]
STRAIGHT_CORNERS = [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
TRIANGLE_WITH_A_POINT_ON_A_SIDE = [(0, 0), (1, 0), (2, 0), (1, 1)]
COMB = [
    (0, 0),
    (5, 0),
    (5, 2),
    (4, 2),
    (4, 1),
    (3, 1),
    (3, 2),
    (2, 2),
    (2, 1),
    (1, 1),
    (1, 2),
    (0, 2),
]
STAR = [
    (r * np.cos(t), r * np.sin(t))
    for r, t in zip([2, 0.7] * 7, np.arange(14) * np.pi / 7, strict=True)
]


def cut(V, *polygons):
    """Return the vertices of the triangles of these polygons."""
    corners = np.concatenate(polygons)
    return corners[triangulate(V, corners, np.array([len(polygon) for polygon in polygons]))]


def turned(F):
    """Return triangles as a set, each from its smallest corner."""
    return {tuple(np.roll(t, -t.argmin()).tolist()) for t in F}


def rotation(seed):
    return np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("start", [0, 1, 3])
@pytest.mark.parametrize(
    "polygon", [L_SHAPE, ARROW, STRAIGHT_CORNERS, TRIANGLE_WITH_A_POINT_ON_A_SIDE, COMB, STAR]
)
def test_triangles_cover_the_polygon_without_flat_ones(polygon, start, seed):
    flat = np.roll(np.array(polygon, float), start, axis=0)
    c = len(flat)
    V = np.column_stack([flat, np.zeros(c)]) @ rotation(seed).T + 7
    F = cut(V, list(range(c)))
    assert F.shape == (c - 2, 3)
    assert set(F.ravel().tolist()) == set(range(c))
    u, v = flat[F[:, 1]] - flat[F[:, 0]], flat[F[:, 2]] - flat[F[:, 0]]
    areas = (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / 2
    x, y = flat.T
    whole = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2
    assert areas.min() > 1e-3
    assert areas.sum() == pytest.approx(whole, rel=1e-12)
    sides = {(int(a), int(b)) for t in F for a, b in zip(t, np.roll(t, -1), strict=True)}
    assert all((k, (k + 1) % c) in sides for k in range(c))


def test_convex_polygons_are_fans_and_triangles_stay():
    V = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.1]])
    assert cut(V, [0, 1, 2], [1, 2, 3, 0]).tolist() == [[0, 1, 2], [1, 2, 3], [1, 3, 0]]


@pytest.mark.parametrize(
    "polygon",
    [
        [(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)],  # crosses itself
        [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)],  # lies on a line
        [(0, 0, 0), (1, 0, 0), (0, 0, 0), (0, 1, 0)],  # meets itself
        [(0, 0, 0), (1, 0, 0), (np.nan, 1, 0), (0, np.inf, 0)],
        [(0, 0, 0), (1e308, 0, 0), (1e308, 1e308, 0), (0, -1e308, 0)],
    ],
)
def test_what_has_no_triangulation_is_a_fan(polygon):
    assert cut(np.array(polygon, float), [0, 1, 2, 3]).tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("polygon", [L_SHAPE, ARROW, STRAIGHT_CORNERS, COMB, STAR])
def test_a_polygon_that_is_not_convex_is_cut_alike_from_whichever_corner(polygon):
    V = np.column_stack([polygon, np.zeros(len(polygon))]) @ rotation(1).T
    corners = np.arange(len(V))
    first, *others = (turned(cut(V, np.roll(corners, k))) for k in corners)
    assert all(one == first for one in others)


def test_a_corner_on_a_side_in_single_precision_makes_no_sliver():
    flat = np.column_stack([TRIANGLE_WITH_A_POINT_ON_A_SIDE, np.zeros(4)])
    for seed in range(20):
        V = (flat @ rotation(seed).T + 3).astype(np.float32).astype(float)
        assert turned(cut(V, range(4))) == {(0, 1, 3), (1, 2, 3)}


def test_polygons_of_many_sizes_stay_in_order():
    polygons = [[0, 1, 2], [0, 1, 2, 3, 4], [3, 4, 0, 1], [4, 0, 1], [1, 2, 3, 4, 0]]
    angle = np.arange(5) * 2 * np.pi / 5
    V = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    assert cut(V, *polygons).tolist() == [
        [p[0], *p[k : k + 2]] for p in polygons for k in range(1, len(p) - 1)
    ]


@pytest.mark.parametrize("polygon", [L_SHAPE, ARROW, STRAIGHT_CORNERS, COMB])
def test_a_file_of_a_polygon_is_the_same_surface_from_whichever_corner(tmp_path, polygon):
    lines = "".join(f"v {x} {y} 0\n" for x, y in polygon)
    surfaces = []
    for first in (0, 1, 3):
        corners = np.roll(np.arange(len(polygon)), -first) + 1
        (tmp_path / "a.obj").write_text(lines + "f " + " ".join(map(str, corners)))
        surfaces.append(cembench.read_mesh(tmp_path / "a.obj"))
    u, v = (surfaces[0].V[surfaces[0].F[:, k]] - surfaces[0].V[surfaces[0].F[:, 0]] for k in (1, 2))
    assert (np.cross(u, v)[:, 2] > 0).all()
    assert len({frozenset(turned(mesh.F)) for mesh in surfaces}) == 1
