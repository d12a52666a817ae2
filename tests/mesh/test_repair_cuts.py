"""A repair keeps what a user cut, and no advice leads back to itself."""

import numpy as np
import pytest

import cembench
from cembench import DiskMesh, TriangleMesh
from cembench.mesh.cut import cut_open
from cembench.mesh.defects import Defect, Remedy, UnusableMeshError
from cembench.mesh.files import read_soup, repaired_soup, write_mesh
from cembench.mesh.repair import repair
from tests import gallery
from tests.hard_surfaces import hard_surface

SPHERE = TriangleMesh.from_arrays(*gallery.octahedron())


@pytest.mark.parametrize(
    "closed", [SPHERE, TriangleMesh.from_arrays(*gallery.torus())], ids=["S", "T"]
)
def test_a_seam_survives_a_file_and_a_repair(tmp_path, closed):
    disk = cut_open(closed).mesh
    path = tmp_path / "cut.obj"
    write_mesh(path, disk)
    soup, repaired = repaired_soup(read_soup(path), path)
    assert repaired.counts["vertices_welded"] == 0
    mended = DiskMesh.from_arrays(soup.V, soup.triangles)
    assert (mended.n, mended.m) == (disk.n, disk.m)
    assert cembench.repair(path).steps["vertices_welded"] == 0


def test_a_seam_stays_open_beside_degenerate_triangles_and_isolated_vertices():
    disk = cut_open(SPHERE).mesh
    i, j, k = disk.F[0]
    V = np.concatenate([disk.V, disk.V[[i, j]].mean(axis=0, keepdims=True), [[9, 9, 9]]])
    F = np.concatenate([disk.F[1:], [[i, disk.n, k], [disk.n, j, k], [i, j, disk.n]]])
    result = repair(V, F)
    assert result.counts["vertices_welded"] == 0
    assert result.counts["isolated_vertices_removed"] == 1


def test_a_seam_is_welded_on_request():
    disk = cut_open(SPHERE).mesh
    result = repair(disk.V, disk.F, weld=0.0)
    assert result.counts["vertices_welded"] == disk.n - SPHERE.n
    assert len(result.surfaces[0][0]) == SPHERE.n


def test_triangles_that_share_no_vertices_are_welded():
    V, F = gallery.flat_rectangle(3, 4)
    result = repair(V[F].reshape(-1, 3), np.arange(F.size).reshape(-1, 3))
    assert result.counts["vertices_welded"] == F.size - len(V)


def rescaled(V):
    return V / np.abs(V[np.isfinite(V).all(axis=1)]).max()


def with_more(V, F, vertices=(), triangles=()):
    """Vertices and triangles with some more of each; new vertices are counted from n."""
    V = np.concatenate([V, np.reshape(np.array(vertices, float), (-1, 3))])
    return V, np.concatenate([F, np.reshape(np.array(triangles, np.int64), (-1, 3))])


def defective():
    """One surface for each kind of defect, by its name."""
    V, F = gallery.flat_rectangle(4, 5)
    n, disk = len(V), cut_open(SPHERE).mesh
    yield "not finite", with_more(V, F, [[np.nan, 0, 0]], [[0, 1, n]])
    yield "out of range", with_more(V, F, (), [[0, 1, n + 7]])
    yield "scale", (1e70 * V, F)
    yield "coincident", (V[F].reshape(-1, 3), np.arange(F.size).reshape(-1, 3))
    yield "degenerate", with_more(V, F, [V[0]], [[0, 1, n]])
    yield "duplicate", with_more(V, F, (), F[:1])
    yield "edges", with_more(V, F, [[1, 1, 5]], [[F[4, 0], F[4, 2], n]])
    yield "vertices", with_more(V, F, V[:2] - np.array([3, 3, 1]), [[0, n, n + 1]])
    yield "orientation", (V, np.concatenate([F[:3, ::-1], F[3:]]))
    yield "one-sided", gallery.moebius_strip()
    yield "components", with_more(V, F, V[:3] + 9, [[n, n + 1, n + 2]])
    yield "isolated", with_more(V, F, [[7, 7, 7]])
    yield "holes", (V, np.delete(F, np.flatnonzero((F[13, 0] == F).any(axis=1)), axis=0))
    yield "closed", gallery.octahedron()
    yield "handles", gallery.torus()
    yield "cut, and a fin", with_more(disk.V, disk.F, [[0, 0, 5]], [[*disk.F[2, :2], disk.n]])
    yield "cut twice as often", with_more(disk.V, disk.F, (), disk.F[:1])
    yield "crumpled", (hard_surface(3).V, hard_surface(3).F)


def test_every_kind_of_defect_is_among_them():
    """But for a surface without the hole that an algorithm needs."""
    seen = set()
    for _, (V, F) in defective():
        try:
            DiskMesh.from_arrays(V, F)
        except UnusableMeshError as error:
            seen |= {problem.defect for problem in error.problems}
    assert seen == set(Defect) - {Defect.no_hole}


def followed(remedy, V, F, problems, options):
    """The surface after the advice of an error was followed."""
    if remedy is Remedy.rescale:
        return rescaled(V), F
    if remedy is Remedy.cut:
        disk = cut_open(TriangleMesh.from_arrays(V, F)).mesh
        return disk.V, disk.F
    edges = max(p.edges for p in problems) if remedy is Remedy.fill else 0
    return repair(V, F, fill_holes=edges, **options).surfaces[0]


@pytest.mark.parametrize(("V", "F"), [case[1] for case in defective()], ids=dict(defective()))
def test_the_advice_of_every_error_leads_to_a_disk_and_never_back(V, F):
    taken = []
    while True:
        try:
            DiskMesh.from_arrays(V, F)
            break
        except UnusableMeshError as error:
            advice = {p.remedy for p in error.problems}
            order = (Remedy.rescale, Remedy.repair, Remedy.fill, Remedy.cut)
            remedy = next(one for one in order if one in advice)
            assert remedy not in taken
            taken.append(remedy)
            V, F = followed(remedy, V, F, error.problems, error.options)
