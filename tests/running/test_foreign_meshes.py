"""Meshes of other libraries: taken, or refused with an expression that works."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

import cembench
from cembench import DiskMesh, HoledMesh, MeshError
from tests import gallery

V, F = gallery.flat_rectangle(6, 7)
V = V + np.array([0, 0, 0.2]) * np.sin(V[:, :1])
QUADS = np.column_stack([F[: len(F) // 2], F[len(F) // 2 :, 2]])
CELLS = np.arange(len(QUADS))


class Labelled:
    """What xarray's DataArray has: values, dimensions and their coordinates."""

    def __init__(self, values, **coords):
        self.values, self.dims = values, tuple(coords) or ("y", "x")
        self.coords = {k: Labelled(v) for k, v in coords.items() if v is not None}


def gifti():
    nibabel = pytest.importorskip("nibabel")
    arrays = [
        nibabel.gifti.GiftiDataArray(data, intent=f"NIFTI_INTENT_{intent}")
        for data, intent in ((V.astype("f4"), "POINTSET"), (F.astype("i4"), "TRIANGLE"))
    ]
    return nibabel.gifti.GiftiImage(darrays=arrays)


def triangulation(flat=V):
    tri = pytest.importorskip("matplotlib.tri")
    return tri.Triangulation(flat[:, 0], flat[:, 1], F)


TAKEN = {
    "open3d": lambda: SimpleNamespace(vertices=V, triangles=F),
    "nilearn": lambda: SimpleNamespace(coordinates=V, faces=F),
    "nibabel": gifti,
    "vedo": lambda: SimpleNamespace(vertices=V, cells=QUADS.tolist()),
    "dictionary": lambda: {"v": V, "f": F, "uv": V[:, :2]},
    "a dictionary of loadmat": lambda: {"__header__": b"MATLAB", "V": V, "F": F + 1.0},
    "quads": lambda: (V, QUADS),
    "quads, some of them triangles": lambda: (
        V,
        np.vstack([QUADS[1:], [[*QUADS[0, :3], QUADS[0, 2]], [*QUADS[0, [0, 2, 3]], -1]]]),
    ),
    "float F": lambda: (V, F.astype(float)),
    "lists of quads": lambda: (V.tolist(), QUADS.tolist()),
    "Triangulation and heights": lambda: (triangulation(), V[:, 2]),
}


@pytest.mark.parametrize("name", TAKEN)
def test_what_is_sure_is_taken(name):
    mesh = cembench.load_surface(TAKEN[name]())
    assert (mesh.n, mesh.m) == (len(V), len(F))
    np.testing.assert_allclose(mesh.V, V, atol=1e-6)
    assert cembench.repair(TAKEN[name]()).mesh.m == len(F)


def test_a_triangulation_without_heights_is_flat_and_its_mask_counts():
    mesh = cembench.load_surface(triangulation())
    assert not mesh.V[:, 2].any()
    masked = triangulation()
    masked.set_mask(np.arange(len(F)) == 9)
    assert cembench.load_surface(masked).m == len(F) - 1


def test_points_of_the_plane_and_their_simplices_are_flat():
    scipy_spatial = pytest.importorskip("scipy.spatial")
    points = np.random.default_rng(0).random((50, 2))
    mesh = cembench.load_surface(scipy_spatial.Delaunay(points))
    assert mesh.n == 50
    assert not mesh.V[:, 2].any()


Z = 0.4 * np.exp(-np.add.outer(np.linspace(-1, 1, 9) ** 2, np.linspace(-1, 1, 12) ** 2))
X, Y = np.linspace(3, 5, 12), np.linspace(2, 0, 9)


@pytest.mark.parametrize(
    ("x", "y"),
    [(X, Y), (X, Y[::-1]), np.meshgrid(X, Y), (X[::-1], Y), (X[None, :], Y[:, None])],
    ids=["rows go south", "north", "arrays", "west", "broadcast"],
)
def test_terrain_faces_up_and_keeps_positions(x, y):
    mesh = cembench.terrain(Z, x, y)
    assert isinstance(mesh, DiskMesh)
    assert (mesh.n, mesh.m) == (108, 176)
    normals = np.cross(*np.diff(mesh.V[mesh.F], axis=1).swapaxes(0, 1))
    assert (normals[:, 2] > 0).all()
    assert np.ptp(mesh.V[:, 0]) == pytest.approx(2)
    np.testing.assert_allclose(mesh.V[:, 2].reshape(Z.shape), Z)
    assert cembench.parameterize(mesh).ok


def test_terrain_by_distances_of_neighbours():
    assert np.ptp(cembench.terrain(Z, 30.0, 10.0).V[:, :2], axis=0).tolist() == [330, 80]
    assert np.ptp(cembench.terrain(Z).V[:, :2], axis=0).tolist() == [11, 8]


def test_missing_heights_are_holes():
    gap = Z.copy()
    gap[4, 5] = np.nan
    mesh = cembench.terrain(gap)
    assert isinstance(mesh, HoledMesh)
    assert (mesh.n, mesh.m) == (107, 168)
    hidden = np.ma.masked_array(Z, np.isnan(gap))
    assert cembench.terrain(hidden).hash == mesh.hash
    gap[:, 5] = np.nan
    with pytest.raises(MeshError, match="2 connected components"):
        cembench.terrain(gap)
    with pytest.raises(MeshError, match="no four neighbouring heights are finite"):
        cembench.terrain(np.full((4, 4), np.nan))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((Z[0],), r"heights have shape \(12,\); allowed is \(rows, columns\)"),
        ((Z, Y, X), r"x has shape \(9,\).*each of the 12 columns, or an array of shape \(9, 12\)"),
        ((Z, X, X), r"y has shape \(12,\).*each of the 9 rows"),
        ((Z.astype(complex),), "heights are of type complex128"),
    ],
)
def test_heights_that_do_not_fit(arguments, message):
    with pytest.raises(MeshError, match=message):
        cembench.terrain(*arguments)


def test_labelled_heights_bring_their_positions():
    labelled = Labelled(Z, lat=Y, lon=X)
    assert cembench.terrain(labelled).hash == cembench.terrain(Z, X, Y).hash
    assert cembench.load_surface(labelled).hash == cembench.terrain(Z, X, Y).hash
    with pytest.raises(MeshError, match=r"no coordinates along lat and lon\. Write cembench\.terr"):
        cembench.load_surface(Labelled(Z, lat=None, lon=None))


def test_xarray_itself_if_it_is_here():
    xarray = pytest.importorskip("xarray")
    data = xarray.DataArray(Z, coords={"y": Y, "x": X}, dims=("y", "x"))
    assert cembench.load_surface(data).hash == cembench.terrain(Z, X, Y).hash
    assert cembench.terrain(data).hash == cembench.terrain(Z, X, Y).hash


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (Z, r"if these are heights, write cembench\.terrain\(z, x, y\)"),
        (V, r"without its faces: write \(V, F\)"),
        (V[F], r"corners T of triangles, write \(T\.reshape"),
        ((V, F + 1.0), r"Write F - 1"),
        ((V, QUADS + 1), r"Write F - 1"),
        ((V, F, V), r"write \(found\[0\], found\[1\]\)"),
        (SimpleNamespace(to_legacy=1), r"write to_legacy\(\) of it"),
        (SimpleNamespace(extract_surface=1), r"write extract_surface\(\) of it"),
    ],
)
def test_what_is_not_sure_is_answered_with_the_expression(given, said):
    with pytest.raises(MeshError, match=said):
        cembench.load_surface(given)


def test_the_expressions_work():
    T = V[F]
    with pytest.raises(MeshError) as no:
        cembench.load_surface(T)
    expression = re.search(r"write (\(T.*\))\.$", str(no.value)).group(1)
    arrays = eval(expression, {"T": T, "np": np})
    assert cembench.repair(arrays).mesh.m == len(F)
    assert cembench.load_surface((V, F + 1.0 - 1)).m == len(F)
