import numpy as np
import pytest
from cembench.algorithms.direct_cem.disk import direct_cem
from cembench.surfaces.flat_disk import flat_disk

from cembench import DiskMesh, ParameterError, TriangleMesh
from cembench.conformal.metrics import all_metrics
from cembench.core.notices import NoticeKind, of_kind
from cembench.mesh.cut import cut_open
from cembench.mesh.defects import Defect, UnusableMeshError
from cembench.mesh.files import read_mesh
from tests import gallery
from tests.real_meshes import real_mesh


def surface(made, **more):
    return TriangleMesh.from_arrays(*made, **more)


def thin_torus(turns=60, around=10, radius=0.2):
    i, j, F = gallery.grid(around, turns, wrap_rows=True, wrap_columns=True)
    u, v = 2 * np.pi * i / around, 2 * np.pi * j / turns
    rho = 1 + radius * np.cos(u)
    return np.stack([rho * np.cos(v), rho * np.sin(v), radius * np.sin(u)], 1), F


def sphere(faces=600):
    """Two plane disks sewn together along their rims and blown up."""
    disk = flat_disk(faces // 2)
    z = disk.V[:, 0] + 1j * disk.V[:, 1]
    height = np.sqrt(np.maximum(0, 1 - abs(z) ** 2))
    upper = np.stack([z.real, z.imag, height], axis=1)
    inner = disk.interior
    number = np.arange(disk.n)
    number[inner] = disk.n + np.arange(len(inner))
    V = np.vstack([upper, upper[inner] * [1, 1, -1]])
    return V / np.linalg.norm(V, axis=1, keepdims=True), np.vstack(
        [disk.F, number[disk.F[:, ::-1]]]
    )


def check(mesh, cut):
    """The disk is the surface, cut: the same triangles, at the same places."""
    assert isinstance(cut.mesh, DiskMesh)
    np.testing.assert_array_equal(cut.origin[cut.mesh.F], mesh.F)
    np.testing.assert_array_equal(mesh.V[cut.origin], cut.mesh.V)
    np.testing.assert_array_equal(cut.origin[: mesh.n], np.arange(mesh.n))
    loops = sum(len(loop) for loop in mesh.loops)
    assert len(cut.mesh.boundary) == loops + 2 * len(cut.edges)
    ends = mesh.V[cut.edges]
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum() == pytest.approx(cut.length)


def test_a_torus_is_cut_along_its_shortest_loops():
    mesh = surface(thin_torus())
    cut = cut_open(mesh)
    check(mesh, cut)
    meridian, longitude = 20 * 0.2 * np.sin(np.pi / 10), 120 * 0.8 * np.sin(np.pi / 60)
    assert cut.length < 1.05 * (meridian + longitude)
    assert not of_kind(NoticeKind.DEFINITION_1, cut.mesh.notices)


def test_a_sphere_is_cut_between_far_points():
    mesh = surface(sphere())
    cut = cut_open(mesh)
    check(mesh, cut)
    assert 0.9 * np.pi < cut.length < 1.2 * np.pi
    assert len(np.unique(cut.edges)) == len(cut.edges) + 1  # one path


def test_a_sphere_is_cut_between_given_vertices():
    mesh = surface(sphere())
    a, b = 0, mesh.n // 2
    cut = cut_open(mesh, (a, b))
    check(mesh, cut)
    times = np.bincount(cut.edges.ravel())
    assert set(np.flatnonzero(times == 1).tolist()) == {a, b}


def test_neighbours_do_not_open_a_sphere():
    mesh = surface(sphere())
    with pytest.raises(ParameterError, match="are neighbours"):
        cut_open(mesh, mesh.F[0, :2].tolist())


@pytest.mark.parametrize("made", [gallery.tube, gallery.punctured_torus, gallery.torus])
def test_holes_and_handles_go(made):
    mesh = surface(made())
    check(mesh, cut_open(mesh))


def test_given_vertices_are_reached_on_any_surface():
    mesh = surface(thin_torus())
    through = (7, 333, 512)
    cut = cut_open(mesh, through)
    check(mesh, cut)
    assert set(through) <= set(cut.edges.ravel().tolist())


def test_a_disk_needs_no_cut():
    mesh = surface(gallery.flat_rectangle())
    cut = cut_open(mesh)
    check(mesh, cut)
    assert len(cut.edges) == 0
    assert NoticeKind.CUT_OPEN not in {notice.kind for notice in cut.mesh.notices}


def test_what_cannot_be_cut():
    with pytest.raises(UnusableMeshError) as refused:
        cut_open(surface(gallery.two_pieces()))
    assert [p.defect for p in refused.value.problems] == [Defect.components]
    with pytest.raises(ParameterError, match=r"no vertex 999 in mesh; allowed .* from 0 to 95\."):
        cut_open(surface(gallery.torus()), (0, 999))


@pytest.mark.parametrize(
    ("through", "first"), [([1.5, 2], "1.5"), ("ab", "ab"), ([[1, 2], [3]], r"\[1, 2\]")]
)
def test_what_are_no_numbers_of_vertices(through, first):
    with pytest.raises(ParameterError, match=f"no vertex {first} in mesh; allowed are whole"):
        cut_open(surface(gallery.torus()), through)


def test_numbers_of_vertices_may_come_as_an_array():
    mesh = surface(gallery.torus())
    assert cut_open(mesh, np.array([3, 50])).length == cut_open(mesh, [3, 50]).length


@pytest.mark.parametrize(
    "name",
    [
        "closed/goathead.obj",
        "closed/human_man.obj",
        "closed/skull_low_resolution.obj",
        "closed/spot_low_resolution.obj",
        "closed/torus.obj",
        "stress/punctured_torus.obj",
    ],
)
def test_real_surfaces_are_cut_and_mapped_without_folds(name):
    mesh = read_mesh(real_mesh(name), TriangleMesh)
    cut = cut_open(mesh)
    check(mesh, cut)
    assert not of_kind(NoticeKind.DEFINITION_1, cut.mesh.notices)
    assert all_metrics(cut.mesh, direct_cem(cut.mesh).uv)["flipped_triangles"] == 0
