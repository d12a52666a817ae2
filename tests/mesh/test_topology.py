import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cembench.mesh import topology
from tests import gallery


def reference_loops(F):
    """The slow, obvious way: follow half-edges without a twin."""
    directed = {(int(a), int(b)) for t in F for a, b in zip(t, np.roll(t, -1), strict=True)}
    after = {a: b for a, b in directed if (b, a) not in directed}
    loops = []
    while after:
        start = min(after)
        loop = [start]
        while (following := after.pop(loop[-1])) != start:
            loop.append(following)
        loops.append(loop)
    return loops


@pytest.mark.parametrize(
    "surface", [gallery.flat_rectangle, gallery.tube, gallery.torus, gallery.punctured_torus]
)
def test_loops_agree_with_the_obvious_way(surface):
    V, F = surface()
    items = [loop.tolist() for loop in topology.boundary_loops(F, len(V))]
    assert items == reference_loops(F)


@settings(max_examples=40, deadline=None)
@given(st.data())
def test_loops_of_rectangles_with_holes_and_shuffled_numbers(data):
    i, _, F = gallery.grid(6, 7)
    n = len(i)
    # Holes two cells apart, so that they touch neither each other nor the rim.
    cells = data.draw(st.sets(st.sampled_from([8, 10, 12, 22, 24, 26])))
    keep = np.ones(len(F), bool)
    keep[[k + half for k in cells for half in (0, 42)]] = False
    numbers = np.array(data.draw(st.permutations(range(n))))
    F = numbers[F[keep]]
    loops = topology.boundary_loops(F, n)
    assert [loop.tolist() for loop in loops] == reference_loops(F)
    assert len(loops) == 1 + len(cells)
    assert topology.euler_characteristic(F, n) == 1 - len(cells)


@pytest.mark.parametrize(
    ("surface", "euler"),
    [
        (gallery.flat_rectangle, 1),
        (gallery.tube, 0),
        (gallery.torus, 0),
        (gallery.punctured_torus, -1),
        (gallery.tetrahedron, 2),
    ],
)
def test_euler_characteristic(surface, euler):
    V, F = surface()
    assert topology.euler_characteristic(F, len(V)) == euler


def test_components_and_repeated_half_edges():
    V, F = gallery.two_pieces()
    count, labels = topology.components(F, len(V))
    assert count == 2
    assert np.bincount(labels).tolist() == [30, 30]
    assert len(topology.repeated_half_edges(F)) == 0
    turned = F.copy()
    turned[0] = turned[0, ::-1]
    assert len(topology.repeated_half_edges(turned)) > 0
