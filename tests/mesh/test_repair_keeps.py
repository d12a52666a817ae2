"""A repair loses nothing without being asked: families of seams, soups, pieces and T-junctions."""

import numpy as np
import pytest

import cembench
from cembench import DiskMesh, HoledMesh, TriangleMesh
from cembench.mesh import topology
from cembench.mesh.cut import cut_open
from cembench.mesh.defects import Defect, RepairLossError, UnusableMeshError
from cembench.mesh.files import read_soup, repair_soup, write_mesh
from cembench.mesh.gluing import edges_of_half_edges, glue, paired_half_edges
from cembench.mesh.repair import Step, repair
from cembench.mesh.soup import Soup
from tests import gallery


def area(V, F):
    return float(np.linalg.norm(np.cross(*np.diff(V[F], axis=1).swapaxes(0, 1)), axis=1).sum() / 2)


def steps_taken(repaired):
    return {step: n for step, n in repaired.steps.items() if n}


def patch(rows, columns, height=0.3):
    """A hilly patch on [0, 1]^2, its rows along x."""
    u, v = (k.ravel() for k in np.mgrid[0 : rows + 1, 0 : columns + 1])
    u, v = u / rows, v / columns
    _, _, F = gallery.grid(rows, columns)
    return u, v, height * np.sin(3 * u) * np.cos(2 * v), F


def sphere(u, v, h):
    return [np.cos(2 * np.pi * u) * np.sin(np.pi * v), np.sin(2 * np.pi * u) * np.sin(np.pi * v),
            np.cos(np.pi * v)]  # fmt: skip


def tube(u, v, h):
    return [np.cos(2 * np.pi * u), np.sin(2 * np.pi * u), 3 * v]


def torus(u, v, h):
    rho = 3 + np.cos(2 * np.pi * v)
    return [rho * np.cos(2 * np.pi * u), rho * np.sin(2 * np.pi * u), np.sin(2 * np.pi * v)]


#: Surface, its boundary loops and its Euler characteristic when its seams and poles are closed.
CLOSED = {sphere: (0, 2), tube: (2, 0), torus: (0, 0)}


def grid_of(shape, rows, columns, *, swap=False, poles=True, single=False):
    """A regular grid with copies of vertices at seams and poles, as 3-D libraries export it."""
    u, v, h, F = patch(rows, columns)
    V = np.stack(shape(*((v, u) if swap else (u, v)), h), axis=1)
    if not poles:  # no triangles without area
        sizes = np.linalg.norm(np.cross(*np.diff(V[F], axis=1).swapaxes(0, 1)), axis=1)
        F = F[sizes > 1e-9]
    return (V.astype(np.float32).astype(float) if single else V), F


@pytest.mark.parametrize("shape", CLOSED)
@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("poles", [False, True])
@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("size", [(12, 9), (5, 23)])
def test_copies_at_seams_and_poles_of_grids_are_welded(shape, swap, poles, single, size):
    V, F = grid_of(shape, *size, swap=swap, poles=poles, single=single)
    repaired = repair(V, F)
    mesh = TriangleMesh.from_arrays(*repaired.surfaces[0])
    loops, characteristic = CLOSED[shape]
    assert len(mesh.loops) == loops
    assert topology.euler_characteristic(mesh.F, mesh.n) == characteristic
    assert area(mesh.V, mesh.F) == pytest.approx(area(V, F), rel=1e-9)
    assert repaired.steps[Step.ears] == 0


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply"])
@pytest.mark.parametrize("shape", [sphere, tube, torus])
def test_what_a_user_cut_stays_cut_in_any_format_and_numbering(shape, suffix, tmp_path):
    V, F = repair(*grid_of(shape, 12, 9)).surfaces[0]
    disk = cut_open(TriangleMesh.from_arrays(V, F)).mesh
    order = np.random.default_rng(0).permutation(disk.n)
    place = np.argsort(order)
    for name, mesh in (("cut", disk), ("shuffled", DiskMesh(disk.V[order], place[disk.F]))):
        write_mesh(tmp_path / f"{name}{suffix}", mesh)
        result = cembench.repair(tmp_path / f"{name}{suffix}")
        assert result.steps["vertices_welded"] == 0
        assert result.steps["coincident_vertices_kept"] > 0
        assert (result.mesh.n, result.mesh.m) == (disk.n, disk.m)
    assert cembench.repair(disk).steps["vertices_welded"] == 0
    closed = cembench.repair(tmp_path / f"cut{suffix}", weld=0.0)
    assert closed.mesh.n == len(V)


def test_a_slit_in_a_plate_stays_open():
    V, F = gallery.flat_rectangle(8, 8)
    slit = np.array([38, 39, 40, 41, 42])
    above = np.isin(F, slit).any(axis=1) & (V[F].mean(axis=1)[:, 1] > V[slit[0], 1])
    copies = {v: len(V) + k for k, v in enumerate(slit[1:-1].tolist())}
    F[above] = [[copies.get(v, v) for v in face] for face in F[above].tolist()]
    V = np.vstack([V, V[slit[1:-1]]])
    assert len(HoledMesh.from_arrays(V, F).loops) == 2
    assert steps_taken(repair(V, F)) == {Step.kept_open: 3}


@pytest.mark.parametrize("slits", [1, 2, 9])
def test_several_slits_of_a_closed_surface_are_closed_and_a_single_one_stays(slits):
    V, F = repair(*grid_of(sphere, 12, 20)).surfaces[0]
    edges, edge, faces = edges_of_half_edges(F)
    pairs = paired_half_edges(edge, faces)
    middles = {60 + 19 * k for k in range(slits)}
    along = (np.diff(edges, axis=1)[:, 0] == 1) & (np.isin(edges, list(middles)).any(axis=1))
    G, origin = glue(F, pairs[~along[edge[pairs[:, 0]]]], len(V))
    assert len(topology.boundary_loops(G, len(origin))) == slits
    repaired = repair(V[origin], G)
    found = len(topology.boundary_loops(repaired.surfaces[0][1], len(repaired.surfaces[0][0])))
    assert found == (1 if slits == 1 else 0)
    assert repaired.kept.area == pytest.approx(1)


def test_vertices_with_a_texture_coordinate_each_are_copies(tmp_path):
    """However they are numbered: a program split the surface at the seams of its texture."""
    V, F = repair(*grid_of(sphere, 12, 9)).surfaces[0]
    disk = cut_open(TriangleMesh.from_arrays(V, F)).mesh
    write_mesh(tmp_path / "a.obj", disk, disk.V[:, 0] + 1j * np.arange(disk.n))
    assert cembench.repair(tmp_path / "a.obj").mesh.n == len(V)
    soup = read_soup(tmp_path / "a.obj")
    assert repair_soup(soup).steps[Step.weld] == 0


def soup_of(V, F, noise, seed=0):
    """Triangles without common vertices, whose corners differ by up to `noise`."""
    corners = V[F].reshape(-1, 3)
    away = np.random.default_rng(seed).uniform(-1, 1, corners.shape)
    return corners + noise * away, np.arange(F.size).reshape(-1, 3)


@pytest.mark.parametrize("noise", [1e-9, 1e-7, 3e-5, 1e-3])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize("size", [(5, 4), (20, 30)])
def test_a_soup_with_gaps_is_told_the_tolerance_that_closes_them(noise, scale, size):
    u, v, h, F = patch(*size)
    if noise > 0.01 / max(size):
        pytest.skip("the gaps are nearly as large as the edges")
    V = np.stack([u, v, h], axis=1)
    rough, G = soup_of(V, F, noise)
    with pytest.raises(RepairLossError) as lost:
        repair(scale * rough, G)
    assert lost.value.kept.pieces == 1
    (weld,) = lost.value.options.values()
    assert f"weld={weld!r}" in str(lost.value)
    repaired = repair(scale * rough, G, weld=weld)
    mesh = DiskMesh.from_arrays(*repaired.surfaces[0])
    assert (mesh.n, mesh.m) == (len(V), len(F))
    assert repaired.kept.is_whole
    with pytest.raises(UnusableMeshError) as refused:
        DiskMesh.from_arrays(scale * rough, G)
    assert refused.value.options == {"weld": weld}


@pytest.mark.parametrize("count", [2, 3, 101])
def test_pieces_are_lost_only_on_request(count):
    V, F = gallery.flat_rectangle(2, 2)
    all_V = np.vstack([V + np.array([4 * k, 0, 0]) for k in range(count)])
    all_F = np.vstack([F + k * len(V) for k in range(count)])
    with pytest.raises(RepairLossError, match=f"1 of {count} pieces") as lost:
        repair(all_V, all_F)
    assert lost.value.options == {"components": "all"}
    assert "`cembench.repair(surface, components='all').mesh` keeps every piece" in str(lost.value)
    assert "`cembench.repair(surface, drop=True).mesh` allows the loss" in str(lost.value)
    assert len(repair(all_V, all_F, components="all").surfaces) == count
    one = repair(all_V, all_F, drop=True)
    assert len(one.surfaces) == 1
    assert one.kept.area == pytest.approx(1 / count)
    assert any(f"1 of {count} pieces are kept" in str(notice) for notice in one.notices)


def test_half_of_a_bow_tie_is_not_dropped():
    with pytest.raises(RepairLossError, match="50 % of the area"):
        repair(*gallery.bow_tie())
    assert len(repair(*gallery.bow_tie(), components="all").surfaces) == 2


def test_small_fragments_that_come_off_are_dropped_but_not_whole_pieces():
    V, F = gallery.flat_rectangle(12, 12)
    fin = np.vstack([V, [[2.5, 2, 1]]]), np.vstack([F, [[30, 31, len(V)]]])
    assert repair(*fin).kept.area == pytest.approx(1, abs=0.01)
    crumb = np.vstack([V, [[0, 0, 5], [0.1, 0, 5], [0, 0.1, 5]]])
    with pytest.raises(RepairLossError, match="1 of 2 pieces"):
        repair(crumb, np.vstack([F, [len(V) + np.arange(3)]]))


def turned(points, seed=1):
    rng = np.random.default_rng(seed)
    return points @ np.linalg.qr(rng.normal(size=(3, 3)))[0]


@pytest.mark.parametrize("sides", [(1, 2), (4, 12), (4, 6), (3, 7), (1, 40)])
@pytest.mark.parametrize("digits", [None, 7, 6])
def test_t_junctions_are_split(sides, digits):
    """Two patches that meet along a line, with different numbers of edges there."""
    parts = []
    for k, side in enumerate(sides):
        V, F = gallery.flat_rectangle(side, 3)
        parts.append((V / [3, side, 1] + [k, 0, 0], F))
    (V, F), (W, G) = parts
    both = turned(np.vstack([V, W]))
    both = both if digits is None else np.round(both, digits)
    repaired = repair(both, np.vstack([F, G + len(V)]))
    mesh = DiskMesh.from_arrays(*repaired.surfaces[0])
    assert area(mesh.V, mesh.F) == pytest.approx(2, rel=1e-5)
    met = np.gcd(*sides) - 1
    assert repaired.steps[Step.t_junctions] == sides[0] - 1 + sides[1] - 1 - 2 * met
    assert repaired.kept.is_whole
    assert len(repaired.surfaces[0][1]) == len(F) + len(G) + repaired.steps[Step.t_junctions]


def test_a_mesh_refined_in_a_corner_becomes_one_disk():
    """Hanging vertices on all sides of a refined square, as quadtrees have them."""
    V, F = gallery.flat_rectangle(8, 8)
    inner = (np.abs(V[F].mean(axis=1)[:, :2] - 4) < 2).all(axis=1)
    W, G = gallery.flat_rectangle(8, 8)
    points = turned(np.vstack([V, W / 2 + [2, 2, 0]]))
    repaired = repair(points, np.vstack([F[~inner], G + len(V)]))
    mesh = DiskMesh.from_arrays(*repaired.surfaces[0])
    assert area(mesh.V, mesh.F) == pytest.approx(64)
    assert repaired.steps[Step.t_junctions] == 16


def test_a_vertex_on_a_side_where_nothing_meets_is_left_alone():
    V = np.array([[0, 0, 0], [2, 0, 0], [1, 1, 0], [1, 0, 0], [0.5, -1, 0], [1.5, -1, 0]], float)
    found = repair(V, [[0, 1, 2], [3, 4, 5]], components="all")
    assert found.steps[Step.t_junctions] == 0


@pytest.mark.parametrize("seed", range(8))
def test_old_numbers_lead_back_to_the_input(seed):
    """Positions of vertices, and triangles as parts of their polygons."""
    rng = np.random.default_rng(seed)
    V, F = gallery.flat_rectangle(6, 7)
    order = rng.permutation(len(V) + 3)
    points = np.vstack([V, 9 + rng.random((3, 3))])[order]
    F = np.argsort(order)[F]
    points, F = np.vstack([points, points[:5]]), np.vstack([F, F[:2]])
    result = cembench.repair((points, F[rng.permutation(len(F))]), fill_holes=9)
    np.testing.assert_array_equal(points[result.vertices], result.mesh.V)
    quads = np.concatenate([[0, 1, 2, 3], [1, 4, 5, 2], [9, 0, 1]])
    soup = Soup.from_arrays(rng.random((10, 3)), quads, [4, 4, 3])
    fixed = repair(soup.V, soup.corners, soup.sizes, drop=True)
    vertices, faces = fixed.origins[0]
    polygons = np.split(quads, [4, 8])
    for face, triangle in zip(faces, fixed.surfaces[0][1], strict=True):
        assert set(vertices[triangle].tolist()) <= set(polygons[face].tolist())


def test_new_vertices_and_triangles_have_no_old_number():
    V, F = gallery.flat_rectangle(9, 9)
    F = F[~(F == 44).any(axis=1)]
    result = cembench.repair((V, F), fill_holes=6)
    assert (result.vertices == -1).sum() == 1
    assert (result.faces == -1).sum() == 6
    kept = result.faces >= 0
    np.testing.assert_array_equal(
        np.sort(result.vertices[result.mesh.F[kept]], axis=1),
        np.sort(F[result.faces[kept]], axis=1),
    )


@pytest.mark.parametrize(("rows", "columns"), [(20, 10), (60, 24), (7, 30)])
def test_a_klein_bottle_is_named_and_its_remedy_works(rows, columns, tmp_path):
    V, F = klein_bottle(rows, columns)
    path = tmp_path / "klein.obj"
    path.write_text(gallery.obj_text(V, F))
    with pytest.raises(UnusableMeshError, match=r"closed and one-sided \(like a Klein") as no:
        cembench.read_mesh(path, DiskMesh)
    assert "once it is cut, the surface has" in str(no.value)
    assert "fill_holes" not in str(no.value)
    assert {p.defect for p in no.value.problems} >= {Defect.one_sided}
    repaired = repair(V, F)
    assert repaired.kept.is_whole
    disk = cembench.cut(cembench.repair(path).mesh).mesh
    assert disk.m == len(F)
    assert cembench.parameterize(disk).ok


def klein_bottle(rows, columns):
    i, j = (k.ravel() for k in np.mgrid[0:rows, 0:columns])

    def at(i, j):
        return (i % rows) * columns + np.where(i >= rows, -j, j) % columns

    a, b, c, d = at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)
    u, v = 2 * np.pi * i / rows, 2 * np.pi * j / columns
    rho = 3 + np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v)
    z = np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v)
    V = np.stack([rho * np.cos(u), rho * np.sin(u), z], axis=1)
    return V, np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])


@pytest.mark.process
def test_map_drops_stray_vertices_with_a_note_and_keeps_the_file(tmp_path):
    V, F = gallery.flat_rectangle(4, 5)
    text = "# mine\n" + gallery.obj_text(np.vstack([[9, 9, 9], V, [7, 7, 7]]), F + 1)
    (tmp_path / "a.obj").write_text(text)
    (mapped,) = cembench.map_files(tmp_path / "a.obj", output=tmp_path / "b.obj")
    assert mapped.ok
    mesh = mapped.surface.mesh
    assert (mesh.n, mesh.m) == (len(V), len(F))
    assert any("2 vertices in no triangle" in str(notice) for notice in mesh.notices)
    written = (tmp_path / "b.obj").read_text()
    kept = [line for line in written.splitlines() if not line.startswith(("vt", "f"))]
    assert kept == [line for line in text.splitlines() if not line.startswith("f")]
    uv = read_soup(tmp_path / "b.obj", uv=True)
    assert uv.uv is not None
    moved = uv.uv[np.unique(uv.uv_triangles)]
    assert len(moved) == len(V)
    with pytest.raises(UnusableMeshError, match="isolated vertices"):
        cembench.parameterize(np.vstack([[9, 9, 9], V]), F + 1)
