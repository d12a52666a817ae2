"""Small surfaces, good and bad, that many tests use."""

import numpy as np
from cembench.surfaces.flat_disk import flat_disk
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid
from cembench.surfaces.holed_disk import disk_with_holes
from cembench.surfaces.spherical_cap import spherical_cap

from cembench import DiskMesh, HoledMesh


def obj_text(V, F):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(V, float).tolist()]
    lines += ["f " + " ".join(str(int(k) + 1) for k in face) for face in F]
    return "\n".join(lines) + "\n"


def grid(rows=4, columns=5, *, wrap_rows=False, wrap_columns=False, twist=False):
    """A rectangle of 2 rows columns triangles; wrapped it is a tube or a torus, twisted a Moebius
    strip."""
    r, c = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    last_row = rows if wrap_rows else rows + 1
    last_column = columns if wrap_columns else columns + 1

    def at(i, j):
        turned = (j == columns) & twist
        i = np.where(turned, rows - i, i)
        return (i % last_row) * last_column + j % last_column

    a, b = at(r, c).ravel(), at(r, c + 1).ravel()
    d, e = at(r + 1, c).ravel(), at(r + 1, c + 1).ravel()
    F = np.concatenate([np.stack([a, b, e], 1), np.stack([a, e, d], 1)])
    i, j = np.divmod(np.arange(last_row * last_column), last_column)
    return i, j, F


def flat_rectangle(rows=4, columns=5):
    i, j, F = grid(rows, columns)
    return np.stack([j, i, 0 * i], 1).astype(float), F


def tube():
    i, j, F = grid(4, 8, wrap_columns=True)
    angle = 2 * np.pi * j / 8
    return np.stack([np.cos(angle), np.sin(angle), i], 1).astype(float), F


def torus():
    i, j, F = grid(8, 12, wrap_rows=True, wrap_columns=True)
    u, v = 2 * np.pi * i / 8, 2 * np.pi * j / 12
    rho = 3 + np.cos(u)
    return np.stack([rho * np.cos(v), rho * np.sin(v), np.sin(u)], 1), F


def punctured_torus():
    V, F = torus()
    return V, F[1:]


def moebius_strip():
    i, j, F = grid(2, 15, wrap_columns=True, twist=True)
    v = 2 * np.pi * j / 15
    rho = 3 + (i - 1) * np.cos(v / 2)
    return np.stack([rho * np.cos(v), rho * np.sin(v), (i - 1) * np.sin(v / 2)], 1), F


def tetrahedron():
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
    return V, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def octahedron():
    V = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    F = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
    return V, np.array(F)


def bow_tie():
    """Two triangles that touch in one vertex."""
    V = np.array([[0, 0, 0], [1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]], float)
    return V, np.array([[0, 2, 1], [0, 3, 4]])


def three_triangles_on_an_edge():
    V = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, -1, 0]], float)
    return V, np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])


def two_pieces():
    V, F = flat_rectangle()
    return np.concatenate([V, V + 100]), np.concatenate([F, F + len(V)])


def uneven(faces=1500, x=2.0):
    """Half an ellipsoid with a little noise: no symmetry, and no edge between equals."""
    mesh = hemi_ellipsoid(faces, x=x)
    return mesh.moved(mesh.V + 0.01 * np.random.default_rng(7).standard_normal(mesh.V.shape))


def crumpled_disk():
    """So crumpled inside that many cotangent weights are negative and harmonic maps fold."""
    mesh = flat_disk(600)
    noise = 0.15 * np.random.default_rng(0).standard_normal(mesh.V.shape)
    inside = np.linalg.norm(mesh.V, axis=1) < 0.7
    return DiskMesh.from_arrays(mesh.V + inside[:, None] * noise, mesh.F, name="crumpled disk")


def annulus(inner=0.5, faces=600):
    """A plane ring about 0 out of rings of nearly equilateral triangles; V and F."""
    turns = max(6, round(np.sqrt(faces * np.pi / (np.log(1 / inner) * 2 * 0.866 / np.pi) / 2)))
    rings = max(2, round(np.log(1 / inner) * turns / (2 * np.pi * 0.866)))
    i, j, F = grid(rings, turns, wrap_columns=True)
    z = inner ** (i / rings) * np.exp(2j * np.pi * (j + 0.5 * i) / turns)
    return np.stack([z.real, z.imag, 0 * z.real], axis=1), F


def three_holes(faces=1200):
    """A plane disk with three round holes of different sizes."""
    return HoledMesh.from_arrays(*disk_with_holes(*THREE_HOLES, faces), name="three holes")


#: Centres and radii of three holes in the unit disk.
THREE_HOLES = ((0.45 + 0.1j, -0.3 + 0.4j, -0.15 - 0.45j), (0.2, 0.15, 0.25))


def hill_in_a_corner(rows=8, columns=14):
    """A flat rectangle with a hill near a corner: few boundary vertices for what they hold."""
    V, F = flat_rectangle(rows, columns)
    V[:, 2] = 8 * np.exp(-((V[:, 0] - 3) ** 2 + (V[:, 1] - 3) ** 2) / 4)
    return V, F


def eared_hole(rows=8, columns=8):
    """A flat rectangle with a hole of two triangles, one of whose vertices has no way inside.

    Returns the mesh, and that vertex.
    """
    V, F = flat_rectangle(rows, columns)
    middle = V[F].mean(axis=1)
    hole = (abs(middle[:, 0] - 4) < 1) & (abs(middle[:, 1] - 4) < 1)
    kept = F[~hole]
    used, kept = np.unique(kept, return_inverse=True)
    V, F = V[used], kept.reshape(-1, 3)
    mesh = HoledMesh.from_arrays(V, F)
    hole = min(mesh.loops, key=len)
    ear = len(V)
    a, b = hole[0], hole[1]
    tip = (V[a] + V[b]) / 2 + (V[hole].mean(axis=0) - (V[a] + V[b]) / 2) / 2
    eared = HoledMesh.from_arrays(np.vstack([V, tip]), np.vstack([F, [b, a, ear]]))
    return eared, ear


def mapped_cap():
    """A cap and its exact conformal map, the stereographic projection."""
    mesh = spherical_cap(4000)
    z = (mesh.V[:, 0] + 1j * mesh.V[:, 1]) / (1 + mesh.V[:, 2])
    z /= np.abs(z[mesh.boundary]).max()
    z[mesh.boundary] /= np.abs(z[mesh.boundary])
    return mesh, z
