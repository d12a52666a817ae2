import numpy as np
import pytest

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
    F = triangulate(V, [np.arange(c)[None]])
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
    blocks = [np.array([[0, 1, 2]]), np.array([[1, 2, 3, 0]])]
    assert triangulate(V, blocks).tolist() == [[0, 1, 2], [1, 2, 3], [1, 3, 0]]


@pytest.mark.parametrize(
    "polygon",
    [
        [(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0)],  # crosses itself
        [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)],  # lies on a line
        [(0, 0, 0), (1, 0, 0), (0, 0, 0), (0, 1, 0)],  # meets itself
    ],
)
def test_what_has_no_triangulation_is_a_fan(polygon):
    assert triangulate(np.array(polygon, float), [np.arange(4)[None]]).tolist() == [
        [0, 1, 2],
        [0, 2, 3],
    ]
