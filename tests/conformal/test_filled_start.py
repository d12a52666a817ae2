import numpy as np
import pytest

from cembench import HoledMesh
from cembench.conformal.bordered import BorderedLaplacian
from cembench.conformal.circle_domain import BoundaryLoops
from cembench.conformal.filled_start import (
    CROWDED,
    arcs_of_measure,
    equilibrium_measures,
    filled_start,
    widest_start,
)
from cembench.conformal.gauge import gauge_measure
from cembench.conformal.harmonic import edge_lengths
from cembench.conformal.laplacian import laplacian
from tests import gallery


def pierced_tube(turns=16, rows=28):
    """A tube, a little wider at one end, with two windows."""
    i, j, F = gallery.grid(rows, turns, wrap_columns=True)
    angle = 2 * np.pi * (j + 0.5 * i) / turns
    radius = 1 + 0.02 * (rows - i) / rows
    V = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.35 * i], axis=1).astype(float)
    middle = V[F].mean(axis=1)
    window = (middle[:, 0] > 0.9) & (abs(abs(middle[:, 2] - 4.9) - 1.2) < 0.4)
    used, kept = np.unique(F[~window], return_inverse=True)
    return HoledMesh.from_arrays(V[used], kept.reshape(-1, 3))


def pieces(mesh):
    outer, holes = mesh.outer_and_holes()
    loops = (outer, *holes)
    bordered = BorderedLaplacian(mesh, laplacian(mesh), loops)
    S = bordered.dirichlet_to_neumann()
    seen = bordered.swept_to_boundary(gauge_measure(mesh, "triangle", outer)[:, None])[:, 0]
    return S, seen, [edge_lengths(mesh, loop) for loop in loops]


def test_harmonic_measure_is_one_in_sum_and_positive_on_a_delaunay_mesh():
    _, seen, _ = pieces(gallery.three_holes())
    assert abs(seen.sum() - 1) < 1e-12
    assert (seen > 0).all()


def test_on_round_holes_the_start_is_near_the_known_circles():
    start = filled_start(*pieces(gallery.three_holes()), 0)
    assert start.apart
    _, radii = gallery.THREE_HOLES
    np.testing.assert_allclose(np.sort(start.radii[1:]), np.sort(radii), rtol=0.35)


def test_down_a_tube_another_loop_is_outside_at_first():
    S, seen, lengths = pieces(pierced_tube())
    first, chosen = filled_start(S, seen, lengths, 0), widest_start(S, seen, lengths)
    assert first.radii.min() < CROWDED
    assert chosen.rims.outer != 0
    assert chosen.radii.min() > 10 * first.radii.min()
    assert chosen.apart


def test_on_a_concentric_ring_each_loop_has_an_even_equilibrium_measure():
    S, _, lengths = pieces(HoledMesh.from_arrays(*gallery.annulus()))
    rims = BoundaryLoops(tuple(map(len, lengths)))
    own = equilibrium_measures(S, rims)
    np.testing.assert_allclose(own * np.array(rims.sizes)[rims.loop], 1, rtol=0.2)
    np.testing.assert_allclose(rims.sums(own), 1)


def test_a_start_does_not_depend_on_what_is_seen_where_that_crowds_it():
    S, seen, lengths = pieces(HoledMesh.from_arrays(*gallery.annulus()))
    corner = np.zeros_like(seen)
    corner[0] = 1  # the origin would go to the boundary
    (circle,) = filled_start(S, corner, lengths, 0).radii[1:]
    assert circle == pytest.approx(0.5, rel=0.02)


def test_even_harmonic_measure_gives_arcs_in_proportion_to_length():
    lengths = np.array([1.0, 2.0, 3.0, 1.5])
    measure = (lengths + np.roll(lengths, 1)) / 2
    arcs = arcs_of_measure(measure, lengths)
    np.testing.assert_allclose(arcs / arcs.sum(), lengths / lengths.sum())


def test_measure_that_is_not_positive_still_gives_positive_arcs():
    assert (arcs_of_measure(np.array([1.0, -1e-9, 0.0, 2.0]), np.ones(4)) > 0).all()
