import re

import numpy as np
import pytest
from cembench.algorithms.harmonic_circle import harmonic_circle
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from scipy.sparse.csgraph import connected_components

from cembench import DiskMesh, HoledMesh, MeshError, TriangleMesh
from cembench.conformal.metrics import all_metrics
from cembench.core.errors import ParameterError
from cembench.core.notices import NoticeKind
from cembench.mesh import topology
from cembench.mesh.defects import Defect, UnusableMeshError
from tests import gallery


def defects_of(kind, V, F):
    """The defects for which a surface is refused, and how many there are of each."""
    with pytest.raises(UnusableMeshError) as refused:
        kind.from_arrays(V, F)
    return [(problem.defect, problem.count) for problem in refused.value.problems]


def test_a_checked_mesh_is_frozen_and_owns_its_arrays():
    V, F = gallery.flat_rectangle()
    mesh = DiskMesh.from_arrays(V, F)
    V[0] = 7
    assert mesh.V[0, 0] == 0
    with pytest.raises(ValueError, match="read-only"):
        mesh.V[0] = 1
    with pytest.raises(ValueError, match="read-only"):
        mesh.F[0] = 1
    with pytest.raises(AttributeError):
        mesh.V = V


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda V: V[:-1], r"^\d+ positions for \d+ vertices; allowed is one each\.$"),
        (lambda V: V[:, :2], r"shape \(\d+, 2\); allowed is \(n, 3\)"),
        (lambda V: V * 1j, "of type complex128; allowed are real"),
        (lambda V: np.where(V > 4, np.inf, V), "positions are NaN or infinite at vertex 5, "),
    ],
)
def test_a_surface_moves_to_finite_positions_of_its_vertices_only(change, message):
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle())
    with pytest.raises(MeshError, match=message):
        mesh.moved(change(mesh.V))


def test_a_moved_surface_owns_its_positions():
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle())
    there = mesh.V + 1
    moved = mesh.moved(there)
    there[:] = 0
    assert moved.V.tolist() == mesh.moved((mesh.V + 1).tolist()).V.tolist() != there.tolist()
    with pytest.raises(ValueError, match="read-only"):
        moved.V[0] = 1


def test_types_are_the_contract_s_whatever_comes_in():
    V, F = gallery.flat_rectangle()
    mesh = DiskMesh.from_arrays(V.astype(np.float32), F.astype(np.uint16))
    assert mesh.V.dtype == np.float64
    assert mesh.F.dtype == np.int64


def test_boundary_runs_with_the_surface_on_its_left():
    mesh = DiskMesh.from_arrays(*gallery.flat_rectangle(3, 4))
    x, y = mesh.V[mesh.boundary, :2].T
    facing = np.cross(*(mesh.V[mesh.F[0, k]] - mesh.V[mesh.F[0, 0]] for k in (1, 2)))[2]
    area = 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()
    assert area * np.sign(facing) == pytest.approx(12)
    assert len(mesh.boundary) == 14
    assert sorted([*mesh.boundary, *mesh.interior]) == list(range(mesh.n))


def test_orientation_is_repaired_towards_the_majority_with_a_notice():
    V, F = gallery.flat_rectangle()
    wrong = F.copy()
    wrong[[0, 5, 9]] = wrong[[0, 5, 9]][:, ::-1]
    mesh = DiskMesh.from_arrays(V, wrong)
    assert any("3 of 40 triangles" in notice.text for notice in mesh.notices)
    before, after = (
        np.cross(V[T[:, 1]] - V[T[:, 0]], V[T[:, 2]] - V[T[:, 0]])[:, 2] for T in (F, mesh.F)
    )
    np.testing.assert_array_equal(np.sign(before), np.sign(after))


def test_hash_depends_on_content_and_not_on_name():
    V, F = gallery.flat_rectangle()
    one, other = (DiskMesh.from_arrays(V, F, name=name) for name in ("a", "b"))
    assert one.hash == other.hash
    assert DiskMesh.from_arrays(V + 1e-12, F).hash != one.hash


def test_a_tube_is_holed_and_a_disk_is_not():
    assert len(HoledMesh.from_arrays(*gallery.tube()).loops) == 2
    assert defects_of(HoledMesh, *gallery.flat_rectangle()) == [(Defect.no_hole, 1)]


def test_definition_1_is_reported_where_it_fails():
    V, F = gallery.flat_rectangle(1, 5)  # a strip: no interior vertex at all
    assert any("no interior vertex" in notice.text for notice in DiskMesh.from_arrays(V, F).notices)
    V, F = gallery.flat_rectangle(4, 4)  # two corners lie in a single triangle
    notices = DiskMesh.from_arrays(V, F).notices
    assert any("(iv) broken" in notice.text for notice in notices)
    assert flat_disk(600).notices == ()


def test_definition_1_of_ragged_disks_as_by_its_words():
    """Where no chord joins two boundary vertices the graph is not searched; the answer is equal."""
    whole = flat_disk(400)
    centres = whole.V[whole.F].mean(axis=1)
    rng = np.random.default_rng(4)
    seen = []
    for _ in range(60):
        away = np.linalg.norm(centres - rng.uniform(-0.8, 0.8, 3) * [1, 1, 0], axis=1)
        F = whole.F[away < rng.uniform(0.2, 0.6)]
        used, F = np.unique(F, return_inverse=True)
        try:
            disk = DiskMesh.from_arrays(whole.V[used], F.reshape(-1, 3))
        except MeshError:
            continue
        inside = np.zeros(disk.n, dtype=bool)
        inside[disk.interior] = True
        graph = topology.vertex_graph(disk.F, disk.n)
        pieces, _ = connected_components(graph[inside][:, inside])
        ears = (graph[~inside][:, inside].sum(axis=1) == 0).any()
        seen.append((pieces > 1, bool(ears)))
        message = " ".join(notice.text for notice in disk.notices)
        assert ("pieces, not one" in message, "(iv) broken" in message) == seen[-1]
    assert {(False, False), (False, True)} <= set(seen)


V, F = gallery.flat_rectangle()


@pytest.mark.parametrize(
    ("V", "F", "message"),
    [
        (V[:, :2], F, r"vertices have shape \(30, 2\); allowed is \(n, 3\)"),
        (V, F[:, :2], r"faces have shape \(40, 2\); allowed is \(m, 3\)"),
        (V, F[:0], "no faces"),
        (V, F.astype(float), "face indices are of type float64; allowed are integers"),
    ],
)
def test_arrays_of_another_form_are_refused_with_the_allowed_one(V, F, message):
    with pytest.raises(MeshError, match=message):
        TriangleMesh.from_arrays(V, F)


@pytest.mark.parametrize(
    ("V", "F", "defects"),
    [
        (np.where(V == 3, np.nan, V), F, {Defect.not_finite: 10}),
        (V, np.where(F == 5, 77, F), {Defect.out_of_range: 1, Defect.isolated: 1}),
        (V, np.where(F == 5, -1, F), {Defect.out_of_range: 1, Defect.isolated: 1}),
        (np.vstack([V, [[9, 9, 9]]]), F, {Defect.isolated: 1}),
        (np.where(V == 0, V[1], V), F, {Defect.coincident: 5, Defect.degenerate: 8}),
        (V, np.vstack([F, [[0, 0, 1]]]), {Defect.degenerate: 1, Defect.edges: 1}),
        (*gallery.three_triangles_on_an_edge(), {Defect.edges: 1}),
        (*gallery.bow_tie(), {Defect.vertices: 1}),
        (*gallery.moebius_strip(), {Defect.one_sided: 2}),
    ],
)
def test_what_is_no_surface_is_refused(V, F, defects):
    assert dict(defects_of(TriangleMesh, V, F)) == defects


def test_a_refusal_says_where_and_what_is_allowed():
    with pytest.raises(UnusableMeshError) as refused:
        TriangleMesh.from_arrays(np.where(V == 3, np.nan, V), np.where(F == 5, 77, F))
    for text in ("infinite at vertex 3, 9", "allowed is 0 to 29", "in no triangle: 5"):
        assert text in str(refused.value)


@pytest.mark.parametrize(
    ("surface", "defects"),
    [
        (gallery.two_pieces, {Defect.components: 2}),
        (gallery.tetrahedron, {Defect.closed: 1}),
        (gallery.torus, {Defect.closed: 1, Defect.handles: 1}),
        (gallery.tube, {Defect.holes: 1}),
        (gallery.punctured_torus, {Defect.handles: 1}),
    ],
)
def test_what_is_no_disk_is_refused(surface, defects):
    mesh = TriangleMesh.from_arrays(*surface())
    assert dict(defects_of(DiskMesh, mesh.V, mesh.F)) == defects


def test_the_widest_loop_is_the_outer_one_unless_a_vertex_names_another():
    mesh = gallery.three_holes()
    outer, holes = mesh.outer_and_holes()
    assert abs(mesh.V[outer]).max() == pytest.approx(1)
    assert len(outer) > len(holes[0]) > len(holes[1]) > 0
    named, others = mesh.outer_and_holes(int(holes[1][3]))
    assert (named == holes[1]).all()
    assert (others[0] == outer).all()
    assert len(others) == 3


def test_a_hole_with_fingers_is_not_the_outer_one_though_it_is_the_longest():
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    star = (0.5 + 0.3 * np.cos(12 * angle)) * np.exp(1j * angle)
    z = np.concatenate([star, np.exp(1j * angle)])
    j, k = np.arange(200), np.roll(np.arange(200), -1)
    F = np.concatenate([np.stack([j, j + 200, k + 200], 1), np.stack([j, k + 200, k], 1)])
    mesh = HoledMesh.from_arrays(np.stack([z.real, z.imag, 0 * z.real], 1), F)
    outer, (hole,) = mesh.outer_and_holes()
    assert np.abs(np.diff(z[hole])).sum() > np.abs(np.diff(z[outer])).sum()
    assert set(outer) == set(range(200, 400))


@pytest.mark.parametrize(
    ("vertex", "message"),
    [(10_000, "is not a vertex"), (-1, "is not a vertex"), (320, "lies on no")],
)
def test_an_outer_boundary_that_is_not_there(vertex, message):
    mesh = gallery.three_holes(600)
    assert 320 in mesh.interior
    with pytest.raises(ParameterError, match=rf"outer={vertex}: .*{message}.*longest loops"):
        mesh.outer_and_holes(vertex)


def test_a_mask_is_refused_where_it_hides_something():
    V, F = gallery.flat_rectangle()
    with pytest.raises(MeshError, match="the vertices are an array of which a mask"):
        DiskMesh.from_arrays(np.ma.masked_less(V, 0.5)[-3:], F)
    with pytest.raises(MeshError, match="the faces are an array of which a mask"):
        DiskMesh.from_arrays(V, np.ma.masked_equal(F, F.max()))
    assert DiskMesh.from_arrays(np.ma.array(V), F).n == len(V)


@pytest.mark.parametrize("sizes", [(3, 3), (3, 4), (4, 3), (4, 3, 4), (3, 4, 3)])
def test_of_several_components_a_vertex_of_two_is_named_equal_or_not(sizes):
    parts = [gallery.flat_rectangle(k, k) for k in sizes]
    starts = np.cumsum([0, *(len(V) for V, _ in parts)])
    V = np.concatenate([V + k for k, (V, _) in enumerate(parts)])
    F = np.concatenate([F + k for (_, F), k in zip(parts, starts, strict=False)])
    with pytest.raises(UnusableMeshError, match="connected components") as no:
        DiskMesh.from_arrays(V, F)
    pattern = r"vertex (\d+) lies in the largest, with (\d+) of \d+ vertices, vertex (\d+) in"
    large, most, small = map(int, re.search(pattern, str(no.value)).groups())
    of = np.searchsorted(starts, [large, small], side="right") - 1
    assert of[0] != of[1]
    assert [len(parts[k][0]) for k in of] == [most, min(len(V) for V, _ in parts)]


@pytest.mark.parametrize(("scale", "count"), [(1e200, 29), (1e300, 29), (1e-200, 40), (1e-310, 40)])
def test_scales_that_overflow_or_vanish_are_refused(scale, count):
    V, F = gallery.flat_rectangle()
    assert defects_of(TriangleMesh, V * scale, F) == [(Defect.scale, count)]


@pytest.mark.parametrize("scale", [2.0**-180, 2.0**180])
def test_allowed_scales_change_no_figure(scale):
    mesh = hemi_ellipsoid(300)
    scaled = DiskMesh.from_arrays(mesh.V * scale, mesh.F)
    uv = harmonic_circle(mesh).uv
    np.testing.assert_array_equal(harmonic_circle(scaled).uv, uv)
    # All the same bits, but for logarithms of area ratios.
    assert all_metrics(scaled, uv) == pytest.approx(all_metrics(mesh, uv), rel=1e-14)


def test_slivers_are_reported():
    V, F = gallery.flat_rectangle()
    (notice,) = TriangleMesh.from_arrays(V * [1, 1e-7, 1], F).notices
    assert notice.kind is NoticeKind.SLIVERS
    assert notice.text.startswith(
        "slivers, with less area than 1e-06 of their longest edge squared: "
    )
    assert not TriangleMesh.from_arrays(V * [1, 1e-5, 1], F).notices


def test_an_ear_on_a_hole_is_told_with_its_loop_and_vertex():
    mesh, ear = gallery.eared_hole()
    hole = min(mesh.loops, key=len)
    (notice,) = [n for n in mesh.notices if f"boundary of vertex {hole.min()} " in n.text]
    assert f"without an interior neighbour: {ear}." in notice.text
