import numpy as np
import pytest
from cembench.algorithms.direct_cem.holes import direct_cem_holes

from cembench import DiskMesh, HoledMesh, MeshError, ParameterError, TriangleMesh
from cembench.conformal.metrics import all_metrics
from cembench.mesh import topology
from cembench.mesh.defects import degenerate, duplicates
from cembench.mesh.files import read_soup, repaired_soup
from cembench.mesh.repair import Step, repair
from tests import gallery
from tests.real_meshes import real_mesh


def steps_taken(repaired):
    return {step: n for step, n in repaired.steps.items() if n}


def without(F, *triangles):
    return np.delete(F, triangles, axis=0)


def test_a_fin_comes_off_and_the_sheet_stays_whole():
    V, F = gallery.flat_rectangle()
    fin = np.vstack([[[14, 15, 30]], F])
    repaired = repair(np.vstack([V, [[2.5, 2, 1]]]), fin, drop=True)
    mesh = DiskMesh.from_arrays(*repaired.surfaces[0])
    assert repaired.steps[Step.edges] == 1
    assert repaired.steps[Step.component_faces] == 1
    assert mesh.m == len(F) - repaired.steps[Step.ears]


def test_two_sheets_that_cross_come_apart_along_the_crossing():
    V, F = gallery.flat_rectangle(4, 6)
    upright = V[:, [0, 2, 1]] + [0, 2, -2]
    both = repair(np.vstack([V, upright]), np.vstack([F, F + len(V)]), components="all")
    assert both.steps[Step.weld] == 7
    assert both.steps[Step.edges] == 6
    assert [len(f) + both.steps[Step.ears] // 2 for _, f in both.surfaces] == [len(F)] * 2
    for surface in both.surfaces:
        DiskMesh.from_arrays(*surface)


def test_a_wall_inside_a_closed_surface_comes_out():
    V, F = gallery.tetrahedron()
    inside = np.vstack([V, V[1:].mean(axis=0)[None]])
    repaired = repair(inside, np.vstack([F, [[1, 2, 4]]]), drop=True)
    assert repaired.steps[Step.edges] == 1
    assert len(repaired.surfaces[0][1]) == 4


@pytest.mark.parametrize("tolerance", [0.0, 1e-3])
def test_welding_closes_a_seam(tolerance):
    V, F = gallery.tube()
    seam = np.flatnonzero(np.arange(len(V)) % 8 == 0)
    copies = dict(zip(seam.tolist(), range(len(V), len(V) + len(seam)), strict=True))
    last = np.isin(F, seam).any(axis=1) & (F % 8 >= 6).any(axis=1)
    open_tube = F.copy()
    for t in np.flatnonzero(last):
        open_tube[t] = [copies.get(v, v) for v in F[t].tolist()]
    apart = np.vstack([V, V[seam] + 0.9 * tolerance])
    closed = repair(apart, open_tube, weld=2 * tolerance)
    assert closed.steps[Step.weld] == len(seam)
    assert len(HoledMesh.from_arrays(*closed.surfaces[0]).loops) == 2
    if tolerance:
        assert repair(apart, open_tube).steps[Step.weld] == 0


def test_a_needle_is_collapsed_and_a_flat_triangle_flipped():
    V, F = gallery.flat_rectangle(6, 6)
    a, b, c = F[20].tolist()
    n = len(V)
    near = np.vstack([V, V[a] + [1e-13, 0, 0]])
    needle = np.vstack([F, [[a, b, n]]])
    needle[20] = [n, b, c]
    collapsed = repair(near, needle)
    assert collapsed.steps[Step.collapse] > 0
    assert len(collapsed.surfaces[0][1]) == len(F) - collapsed.steps[Step.ears]

    middle = np.vstack([V, (V[a] + V[b]) / 2])
    flat = np.vstack([F, [[n, b, c], [a, b, n]]])
    flat[20] = [a, n, c]
    flipped = repair(middle, flat)
    assert flipped.steps[Step.flip] == 1
    assert flipped.steps[Step.degenerate] == 0
    DiskMesh.from_arrays(*flipped.surfaces[0])


def test_closed_surfaces_face_outwards():
    V, F = gallery.torus()
    inside_out = repair(V, F[:, ::-1])
    right = repair(V, F)
    assert inside_out.steps[Step.outwards] + right.steps[Step.outwards] == 1
    np.testing.assert_array_equal(
        np.sort(inside_out.surfaces[0][1], axis=0), np.sort(right.surfaces[0][1], axis=0)
    )


def test_a_one_sided_surface_is_cut_into_a_disk():
    repaired = repair(*gallery.moebius_strip())
    assert repaired.steps[Step.one_sided] == 2
    DiskMesh.from_arrays(*repaired.surfaces[0])


def with_a_chain_of_ears(rows, loop):
    """A square with a hole, and two triangles that hang on one of its boundaries, one by one."""
    V, F = gallery.flat_rectangle(rows, rows)
    middle = (V[F].mean(axis=1) - rows / 2) ** 2
    F = F[middle[:, :2].max(axis=1) > 4]
    used, F = np.unique(F, return_inverse=True)
    V, F = V[used], F.reshape(-1, 3)
    mesh = HoledMesh.from_arrays(V, F)
    a, b = mesh.loops[loop][1:3].tolist()
    n, inwards = len(V), 0.2 if loop else -0.2
    tips = [V[k] + inwards * (rows / 2 - V[k]) * [1, 1, 0] for k in (a, b)]
    return mesh, np.vstack([V, *tips]), np.vstack([F, [[b, a, n], [b, n, n + 1]]])


def test_ears_of_holes_are_dropped_one_after_the_other():
    mesh, V, F = with_a_chain_of_ears(24, 1)
    repaired = repair(V, F)
    assert repaired.steps[Step.ears] == 2
    assert len(repaired.surfaces[0][1]) == mesh.m


@pytest.mark.parametrize(("rows", "loop"), [(24, 0), (6, 1)])
def test_ears_stay_at_the_outer_boundary_and_where_they_are_much_of_the_surface(rows, loop):
    _, V, F = with_a_chain_of_ears(rows, loop)
    repaired = repair(V, F)
    assert repaired.steps[Step.ears] == 0
    assert len(repaired.surfaces[0][1]) == len(F)


def test_the_corners_of_a_grid_stay():
    V, F = gallery.flat_rectangle(4, 6)
    repaired = repair(np.vstack([V, [[9, 9, 9]]]), F)
    assert steps_taken(repaired) == {Step.isolated: 1}
    assert len(repaired.surfaces[0][1]) == len(F)


@pytest.mark.parametrize("rows", [120, 160])
def test_the_ears_of_a_ragged_boundary_go(rows):
    V, F = gallery.flat_rectangle(rows, rows)
    x, y, _ = np.floor(V[F].mean(axis=1)).T
    teeth = F[(y < rows - 1) | (x % 2 == 0)]  # in the last row, with two triangles each
    repaired = repair(V, teeth)
    left = repaired.surfaces[0][1]
    assert len(teeth) - len(left) == repaired.steps[Step.ears] >= rows
    assert f"{100 * len(left) / len(teeth):.4g} % of the area" in repaired.notices[-1].text


@pytest.mark.parametrize("columns", [14, 40, 200])
def test_no_rectangle_loses_its_corners(columns):
    for rows in (1, 2, 5, 14):
        V, F = gallery.flat_rectangle(rows, columns)
        assert not steps_taken(repair(V, F))


def test_small_holes_are_filled_and_the_longest_loop_stays():
    V, F = gallery.flat_rectangle(9, 9)
    fan = np.flatnonzero((F == 44).any(axis=1))
    holed = without(F, 60, *fan)
    assert len(HoledMesh.from_arrays(*repair(V, holed).surfaces[0]).loops) == 3
    one = repair(V, holed, fill_holes=3)
    assert one.steps[Step.holes] == 1
    assert len(HoledMesh.from_arrays(*one.surfaces[0]).loops) == 2
    both = repair(V, holed, fill_holes=6)
    assert both.steps[Step.holes] == 2
    mesh = DiskMesh.from_arrays(*both.surfaces[0])
    assert mesh.m == len(F) - both.steps[Step.ears]
    area = np.linalg.norm(np.cross(*np.diff(mesh.V[mesh.F], axis=1).swapaxes(0, 1)), axis=1) / 2
    assert area.sum() == pytest.approx(81 - both.steps[Step.ears] / 2)


def test_components_are_surfaces_of_their_own_the_largest_first():
    V, F = gallery.torus()
    small, G = gallery.tetrahedron()
    both = repair(np.vstack([small, V + 9]), np.vstack([G, F + 4]), components="all")
    assert [len(f) for _, f in both.surfaces] == [len(F), 4]
    one = repair(np.vstack([small, V + 9]), np.vstack([G, F + 4]), drop=True)
    assert [len(f) for _, f in one.surfaces] == [len(F)]
    assert one.steps[Step.components] == 1
    assert one.steps[Step.component_faces] == 4


@pytest.mark.parametrize("seed", range(30))
def test_any_soup_becomes_manifolds(seed):
    """Random triangles on few vertices have every defect at once, many times."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(4, 12))
    V = rng.integers(0, 3, (n, 3)).astype(float)
    F = rng.integers(-1, n + 1, (int(rng.integers(1, 60)), 3))
    try:
        repaired = repair(V, F, components="all", fill_holes=int(rng.integers(0, 8)), drop=True)
    except MeshError:
        inside = F[((F >= 0) & (n > F)).all(axis=1)]
        assert degenerate(V, inside).all()
        return
    for surface in repaired.surfaces:
        mesh = TriangleMesh.from_arrays(*surface)
        assert topology.components(mesh.F, mesh.n)[0] == 1
        assert not mesh.notices


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"weld": -1.0}, "weld=-1.0 is not allowed"),
        ({"weld": np.nan}, "weld=nan is not allowed"),
        ({"fill_holes": -1}, "fill_holes=-1 is not allowed"),
        ({"components": "some"}, "allowed: 'largest', 'all'"),
    ],
)
def test_options_out_of_range(options, message):
    with pytest.raises(ParameterError, match=message):
        repair(*gallery.torus(), **options)


def test_of_duplicate_triangles_the_first_stays():
    V, F = gallery.flat_rectangle(8, 8)
    copies = [np.roll(F, k, axis=1)[np.random.default_rng(k).permutation(len(F))] for k in (1, 2)]
    twice = np.concatenate([F, *copies])
    assert np.flatnonzero(duplicates(twice)).tolist() == list(range(len(F), 3 * len(F)))
    assert repair(V, twice).surfaces[0][1].tolist() == repair(V, F).surfaces[0][1].tolist()


@pytest.mark.parametrize("weld", [1.2, 100.0])
def test_a_tolerance_that_leaves_nothing_is_named_as_the_cause(weld):
    V, F = gallery.flat_rectangle()
    with pytest.raises(ParameterError, match=rf"^weld={weld} leaves .* 1, the longest 1\.41; give"):
        repair(V, F, weld=weld)
    with pytest.raises(MeshError, match="damaged"):
        repair(V, F[:, [0, 0, 1]], weld=weld)


def test_nothing_left():
    with pytest.raises(MeshError, match="nothing can be repaired"):
        repair(np.zeros((3, 3)), np.array([[0, 1, 2]]))


def test_the_raw_bunny_maps_once_its_ears_are_gone():
    repaired = repaired_soup(read_soup(real_mesh("holes/bunny_raw.obj")))[1]
    assert steps_taken(repaired) == {Step.ears: 2}
    mesh = HoledMesh.from_arrays(*repaired.surfaces[0])
    metrics = all_metrics(mesh, direct_cem_holes(mesh).uv)
    assert metrics["flipped_triangles"] == 0
    assert metrics["angle_error_mean_deg"] < 1.7
