"""Levers make surfaces harder to map, and change no count."""

import numpy as np
import pytest
from cembench.surfaces import catalogue
from cembench.surfaces.levers import NO_LEVERS, Levers, boundary_angles, hardened
from cembench.surfaces.rows import ROWS

import cembench
from cembench.conformal.laplacian import non_delaunay_share
from cembench.conformal.metrics import all_metrics
from cembench.mesh.triangle_mesh import DiskMesh
from cembench.registry import load_registry
from cembench.results.columns import FITTED

FAMILIES = [
    "cone", "flat-disk", "hemi-ellipsoid", "spherical-cap", "cylinder-sheet", "swiss-roll",
    "catenoid-sheet", "catenoid-ring", "holed-cap", "ho-face-with-holes", "holed-disk",
]  # fmt: skip


@pytest.fixture(scope="module")
def body() -> DiskMesh:
    return catalogue.stand_in("chinese-vase-stand-in", 2_000, levers=NO_LEVERS)


def counts(mesh):
    return mesh.n, mesh.m, [len(loop) for loop in mesh.loops]


def corners_at_the_boundary(mesh) -> np.ndarray:
    """The angle of the surface at each boundary vertex, in degrees."""
    total = np.zeros(mesh.n)
    for c in range(3):
        a, b = (mesh.V[mesh.F[:, c - k]] - mesh.V[mesh.F[:, c]] for k in (1, 2))
        sine = np.linalg.norm(np.cross(a, b), axis=1)
        np.add.at(total, mesh.F[:, c], np.degrees(np.arctan2(sine, (a * b).sum(axis=1))))
    return total[mesh.loops[0]]


@pytest.mark.parametrize(
    "levers",
    [
        Levers(jag=0.6),
        Levers(smooth=2),
        Levers(smooth=2, even=1),
        Levers(gain=1.5),
        Levers(non_delaunay=0.05),
        Levers(centred=True),
        Levers(0.4, 1, 0.5, 0.8, 0.1, True),
    ],
)
def test_no_lever_changes_a_count_and_a_seed_gives_the_same_bytes(body, levers):
    hard = hardened(body, levers, seed=3)
    assert counts(hard) == counts(body)
    assert hard.hash == hardened(body, levers, seed=3).hash != body.hash
    random = levers.jag or levers.non_delaunay
    assert (hard.hash != hardened(body, levers, seed=4).hash) == bool(random)


def test_without_levers_a_body_stays_as_it_is(body):
    assert hardened(body, NO_LEVERS) is body


def test_jag_scatters_the_angles_of_the_boundary_and_leaves_the_rest(body):
    scatter = [corners_at_the_boundary(hardened(body, Levers(jag=j))).std() for j in (0, 0.3, 0.9)]
    assert scatter[0] < 3 < 12 < scatter[1] < scatter[2]
    jagged = hardened(body, Levers(jag=0.9))
    near = np.isin(np.arange(body.n), body.loops[0])
    for _ in range(1):  # the vertices behind the boundary make room
        near[body.F[near[body.F].any(axis=1)]] = True
    np.testing.assert_array_equal(jagged.V[~near], body.V[~near])


def test_smoothing_holds_the_boundary_and_lowers_the_angle_errors(body):
    smooth = hardened(body, Levers(smooth=4))
    np.testing.assert_array_equal(smooth.V[body.loops[0]], body.V[body.loops[0]])
    maps = [cembench.parameterize(one, "fdm") for one in (body, smooth)]
    errors = [one.metrics["angle_error_mean_deg"] for one in maps]
    assert errors[1] < errors[0]


def test_no_gain_leaves_what_the_filter_of_the_relief_leaves(body):
    flat, smooth = hardened(body, Levers(gain=1e-12)), hardened(body, Levers(smooth=4))
    np.testing.assert_allclose(flat.V, smooth.V, atol=1e-9)


def test_the_share_of_non_delaunay_edges_is_the_one_asked_for(body):
    hard = hardened(body, Levers(non_delaunay=0.08))
    assert non_delaunay_share(body) == 0
    assert non_delaunay_share(hard) == pytest.approx(0.08, abs=0.01)


def test_centring_balances_the_boundary_as_the_middle_triangle_sees_it():
    body = catalogue.stand_in("nefertiti-stand-in", levers=NO_LEVERS)
    hard = hardened(body, Levers(centred=True))
    images = [np.exp(1j * boundary_angles(one.V, one.F, one.loops[0])) for one in (body, hard)]
    offsets = [abs(one.mean()) for one in images]
    assert offsets[0] > 0.1
    assert offsets[1] < 0.02


@pytest.mark.parametrize("name", FAMILIES)
def test_every_procedural_surface_has_a_jag_and_edges_that_are_not_delaunay(name):
    family = load_registry().surface(name)
    size = 5_000 if name == "ho-face-with-holes" else 2_000
    as_now = family.function(size)
    assert family.function(size, jag=0.0, non_delaunay=0.0, seed=0).hash == as_now.hash
    hard = family.function(size, jag=0.4, non_delaunay=0.05)
    assert counts(hard) == counts(as_now)
    assert non_delaunay_share(hard) > non_delaunay_share(as_now)
    assert hard.hash == family.function(size, jag=0.4, non_delaunay=0.05).hash
    other = family.function(size, jag=0.4, non_delaunay=0.05, seed=1)
    assert other.hash != hard.hash


def test_every_other_surface_of_meshes_gen_is_a_stand_in_or_of_measured_faces():
    ours = {name for name, one in load_registry().surfaces.items() if "surfaces" in one.module}
    names = {name for name in ours if load_registry().surface(name).module.startswith("cembench.s")}
    assert names - set(FAMILIES) - set(ROWS) <= {"ict-face", "tin"}


def test_a_stand_in_has_the_levers_of_its_row_unless_others_are_given(body):
    name = "chinese-vase-stand-in"
    family = load_registry().surface(name)
    row = ROWS[name]
    assert row.levers.centred
    assert row.levers.jag > 0
    assert family.arguments({})["jag"] == row.levers.jag
    assert family.fitted == row.fitted == "fdm"
    bare = dict.fromkeys(("jag", "smooth", "even", "non_delaunay", "cut"), 0.0)
    plain = family.function(2_000, **bare, gain=1.0, centred=False)
    assert plain.hash == body.hash != family.function(2_000).hash


def reached(name):
    row = ROWS[name]
    mapper = load_registry().algorithm(row.fitted)
    mesh = catalogue.stand_in(name)
    body = catalogue.body_mesh(name, row.faces, cut=row.levers.cut)
    assert (mesh.n, mesh.m, mesh.loops[0].size) == (body.n, body.m, body.loops[0].size)
    found = all_metrics(mesh, mapper.function(mesh, **mapper.arguments({})).uv)
    return {figure: found[figure] for figure in FITTED}


@pytest.mark.parametrize("name", ["nefertiti-stand-in", "chinese-vase-stand-in"])
def test_kept_levers_give_the_figures_that_are_kept_beside_them(name):
    assert reached(name) == pytest.approx(ROWS[name].reached, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name, row in ROWS.items() if row.faces < 400_000])
def test_all_kept_levers_give_the_figures_that_are_kept_beside_them(name):
    assert reached(name) == pytest.approx(ROWS[name].reached, rel=1e-3)
