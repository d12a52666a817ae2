"""Error bounds without a known map: how far a mesh, and a map of it, is from the conformal map.

Four boundary points make a surface a quadrilateral. Its modulus is the Dirichlet energy of the
potential that is 0 on one side and 1 on the opposite side; that of the other pair of sides is the
reciprocal. Linear elements approximate each from above, so both together enclose the modulus of the
polyhedral surface, and their product exceeds 1 by the discretisation error (Hakula, Rasila &
Vuorinen 2011). A conformal map preserves the modulus, which is known exactly in the disk. For a
surface with holes the same two principles enclose the matrix of its capacities.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from cembench.conformal.circle_capacities import circle_capacities
from cembench.conformal.conjugate_functions import conjugate_functions
from cembench.conformal.harmonic import edge_lengths, harmonic_extension
from cembench.conformal.laplacian import laplacian
from cembench.conformal.planar import fitted_circle, polygon_area
from cembench.core.arrays import Complex, Indices, Real
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh

#: Positions of the four points along the boundary. On a symmetric surface quarters would be
#: symmetric under every map, and could not distinguish maps.
SHARES = (0.0, 0.15, 0.45, 0.7)


@dataclass(frozen=True)
class Certificate:
    """The modulus of a surface with four boundary points, with bounds.

    Parameters
    ----------
    corners : int64 (4,)
        The four vertices, counter-clockwise.
    upper : float
        Energy of the potential from the side between the first two corners to the opposite side;
        for a rectangle the length of these sides over their distance. An upper bound of the
        modulus.
    conjugate : float
        The same for the other two sides: an upper bound of the reciprocal modulus.
    """

    corners: Indices
    upper: float
    conjugate: float

    @property
    def lower(self) -> float:
        """A lower bound of the modulus."""
        return 1 / self.conjugate

    @property
    def modulus(self) -> float:
        """The geometric mean of the two bounds."""
        return float(np.sqrt(self.upper / self.conjugate))

    @property
    def reciprocal_error(self) -> float:
        """The excess over 1 of the product of the two energies: the discretisation error."""
        return self.upper * self.conjugate - 1

    def off(self, z: Complex) -> float:
        """Return the relative signed error of the modulus of a map to the disk.

        z (4,) are the images of the corners, on the unit circle; NaN if they are not in order.
        """
        return self.of_map(z) / self.modulus - 1

    def of_map(self, z: Complex) -> float:
        """Return the modulus of a map to the disk, z (4,) as in :meth:`off`."""
        return disk_modulus(z)

    def words(self, z: Complex) -> str:
        """Return what the bounds say of a map to the disk, z (4,) as in :meth:`off`."""
        bounds = f"between {self.lower:.5g} and {self.upper:.5g}"
        own = self.of_map(z)
        if not np.isfinite(own):
            return f"the surface's modulus is {bounds}; the map's corners are not in order"
        if self.encloses(z):
            return f"the surface's modulus is {bounds}; the map's is {own:.5g}, within"
        outside = max(own / self.upper, self.lower / own) - 1
        return (
            f"the surface's modulus is {bounds}; the map's is {own:.5g}, {outside:.2%} outside. "
            f"{_beside(outside, self.reciprocal_error)}"
        )

    def encloses(self, z: Complex) -> bool:
        """Whether the modulus of the corners' images z (4,) lies between the two bounds."""
        return self.lower <= self.of_map(z) <= self.upper


@dataclass(frozen=True)
class HolesCertificate:
    """The capacities of the holes of a surface, with bounds.

    Capacity C_ij is the integral of the product of the gradients of the harmonic functions that are
    1 on hole i, or j, and 0 on all other boundaries; C = 2 pi / log(1 / r) for one round hole of
    radius r in the middle of the unit disk. Conformal maps keep C, and a K-quasiconformal one
    changes a^T C a, for any a, by at most the factor K. C determines the domain up to conformal
    maps: it is the period matrix of its double (Torelli's theorem).

    Parameters
    ----------
    corners : int64 (b,)
        The vertices of all holes, one hole after another.
    sizes : tuple of int
        The number of vertices of each.
    upper : float (k, k)
        Energies of linear elements: a^T upper a >= a^T C a (Dirichlet's principle).
    conjugate : float (k, k)
        Those of the conjugate functions, of period 1: a^T conjugate a >= a^T C^-1 a (Thomson's
        principle), so the inverse is a lower bound.
    """

    corners: Indices
    sizes: tuple[int, ...]
    upper: Real
    conjugate: Real

    @property
    def lower(self) -> Real:
        """A lower bound of the capacities (k, k), as a quadratic form."""
        return np.asarray(np.linalg.inv(self.conjugate), dtype=np.float64)

    @property
    def reciprocal_error(self) -> float:
        """The largest ratio of both bounds, less 1: the discretisation error."""
        return _largest_ratio(self.upper, self.lower) - 1

    def of_map(self, z: Complex) -> tuple[Real, float]:
        """Return the capacities (k, k) of the unit disk without the circles of a map, and their
        error; z (b,) are the images of `corners`.

        Raises
        ------
        AlgorithmFailed
            The image of a hole is not a circle to :data:`ROUND`, or circles meet.
        """
        loops = np.split(z, np.cumsum(self.sizes)[:-1])
        centres, radii = map(np.array, zip(*map(fitted_circle, loops), strict=True))
        for loop, centre, radius, k in zip(loops, centres, radii, range(len(radii)), strict=True):
            off = float(np.abs(np.abs(loop - centre) / radius - 1).max())
            if not off < ROUND:
                vertex = self.corners[sum(self.sizes[:k])]
                raise AlgorithmFailed(
                    f"the image of the hole with vertex {vertex} is off a circle by {off:.1g} of "
                    "its radius, and only capacities of circles are known; direct-cem-holes makes "
                    "circles"
                )
        return circle_capacities(centres, radii)

    def off(self, z: Complex) -> tuple[float, float]:
        """Return by how much the capacities of a map's circles differ, at least and at most.

        Let r be the largest of a^T C' a / a^T C a and its inverse over all a, for the circles' C'
        and the surface's C; r - 1 is in this interval. Every map of the surface to these circles
        has a dilatation K of at least r somewhere. z (b,) as in :meth:`of_map`.
        """
        own, error = self.of_map(z)
        least = max(_largest_ratio(own, self.upper), _largest_ratio(self.lower, own))
        most = max(_largest_ratio(own, self.lower), _largest_ratio(self.upper, own))
        error *= len(self.sizes)
        return max(least - 1 - error, 0.0), most - 1 + error

    def encloses(self, z: Complex) -> bool:
        """Whether the map's circles, with z as in :meth:`of_map`, may be the surface's."""
        return self.off(z)[0] == 0

    def words(self, z: Complex) -> str:
        """Return what the bounds say of a map; z (b,) as in :meth:`of_map`."""
        least, most = self.off(z)
        about = "the capacities of the holes and of the map's circles differ by"
        if least == 0:
            return (
                f"{about} at most {most:.2%}, within the bounds: these circles may be the "
                "surface's; angle errors tell of the map between them"
            )
        return f"{about} at least {least:.2%}. {_beside(least, self.reciprocal_error)}"


def _beside(outside: float, own: float) -> str:
    """Return how far outside the bounds a map is, compared with the distance of the bounds."""
    compared = (
        f"{outside / own:.1f} times that"
        if outside > own
        else "less than that, as of many maps close to conformal"
    )
    return f"The bounds, and so the triangles' own error, are {own:.2%} apart; this is {compared}"


#: How far the image of a hole may be off a circle, as a share of the radius.
ROUND = 1e-6


def _largest_ratio(A: Real, B: Real) -> float:
    """Return the largest a^T A a / a^T B a of two symmetric matrices, the second one positive."""
    from scipy.linalg import eigh  # imported here: rarely needed

    return float(eigh(A, B, eigvals_only=True)[-1])


def certificate_of(
    mesh: TriangleMesh, z: Complex, target: str
) -> Certificate | HolesCertificate | None:
    """Return the bounds for a map z (n,) of this target; None if it is not one with bounds.

    Raises
    ------
    AlgorithmFailed
        The boundary has fewer than four vertices.
    """
    if target == "disk" and isinstance(mesh, DiskMesh):
        return certify(mesh)
    if target == "circular holes" and isinstance(mesh, HoledMesh):
        outer = max(mesh.loops, key=lambda loop: polygon_area(z[loop]))
        return certify_holes(mesh, int(outer[0]))
    return None


def certify_holes(mesh: HoledMesh, outer: int | None = None) -> HolesCertificate:
    """Enclose the capacities of a surface with holes by harmonic functions and their conjugates.

    `outer` is a vertex of the outer boundary (default: of the widest).

    Examples
    --------
    >>> import cembench
    >>> found = certify_holes(cembench.surface("catenoid-ring", 2000))
    >>> low, high = found.lower[0, 0], found.upper[0, 0]
    >>> bool(low < high < 1.01 * low), bool(abs(high / (2 * np.pi) - 1) < 1e-2)
    (True, True)
    """
    boundary, holes = mesh.outer_and_holes(outer)
    pair = conjugate_functions(mesh, boundary, holes)
    sizes = tuple(map(len, holes))
    periods = pair.circulation / (4 * np.pi**2)
    return HolesCertificate(np.concatenate(holes), sizes, pair.capacity, periods)


def certify(mesh: DiskMesh, corners: Indices | None = None) -> Certificate:
    """Enclose the modulus of a surface with four boundary points by two harmonic functions.

    `corners` (4,) are boundary vertices in order (default: those of :func:`four_points`).

    Raises
    ------
    AlgorithmFailed
        There are no four such points.

    Examples
    --------
    >>> import cembench
    >>> disk = cembench.surface("flat-disk", 600)
    >>> found = certify(disk)
    >>> abs(found.off(disk.V[found.corners, 0] + 1j * disk.V[found.corners, 1])) < 0.01
    True
    """
    chosen = four_points(mesh) if corners is None else np.asarray(corners, dtype=np.int64)
    at = {int(vertex): k for k, vertex in enumerate(mesh.boundary)}
    places = [at.get(int(vertex), -1) for vertex in chosen]
    steps = np.mod(np.diff([*places, places[0]]), len(mesh.boundary)) if places else np.zeros(1)
    if len(places) != 4 or min(places) < 0 or 0 in steps or steps.sum() != len(mesh.boundary):
        raise AlgorithmFailed(
            f"{chosen.tolist()} are not four boundary vertices in boundary order, as a "
            "quadrilateral needs"
        )
    sides = [
        np.roll(mesh.boundary, -place)[: step + 1]
        for place, step in zip(places, steps.tolist(), strict=True)
    ]
    L = laplacian(mesh)
    return Certificate(chosen, _energy(L, sides[0], sides[2]), _energy(L, sides[1], sides[3]))


def _energy(L: sparse.csc_array, low: Indices, high: Indices) -> float:
    """Return the integral of |grad u|^2 for the u that is 0 on one side and 1 on the other."""
    fixed = np.concatenate([low, high])
    u = harmonic_extension(L, fixed, np.repeat([0.0, 1.0], [len(low), len(high)]))
    return float(u @ (L @ u))


def four_points(mesh: DiskMesh) -> Indices:
    """Return the boundary vertices at :data:`SHARES` of its length, starting at the farthest one.

    Raises
    ------
    AlgorithmFailed
        The boundary has fewer than four vertices.
    """
    boundary = mesh.boundary
    if len(boundary) < 4:
        raise AlgorithmFailed(f"the boundary has {len(boundary)} vertices; four are needed")
    off = mesh.V[boundary] - mesh.V[boundary].mean(axis=0)
    boundary = np.roll(boundary, -int(np.argmax(np.einsum("kd,kd->k", off, off))))
    lengths = edge_lengths(mesh, boundary)
    gone = np.concatenate([[0.0], np.cumsum(lengths)])
    places = [int(np.argmin(np.abs(gone[:-1] - gone[-1] * part))) for part in SHARES]
    for k in range(1, 4):  # distinct even if an edge is long
        places[k] = min(max(places[k], places[k - 1] + 1), len(boundary) - 4 + k)
    return boundary[places]


def disk_modulus(z: Complex) -> float:
    """Return the modulus of the unit disk with four points (4,) on the circle.

    As in :class:`Certificate`, from the cross ratio and complete elliptic integrals; NaN if the
    points do not go around the circle once and counter-clockwise.
    """
    from scipy.special import ellipkm1  # imported here: rarely needed

    arcs = np.angle(np.roll(z, -1) * np.conj(z)) % (2 * np.pi)
    if not (arcs > 0).all() or not np.isclose(arcs.sum(), 2 * np.pi):
        return float("nan")
    a, b, c, d = z.tolist()
    whole = abs(a - c) * abs(b - d)  # Ptolemy: the sum of the products of opposite sides
    near, far = abs(a - b) * abs(c - d) / whole, abs(b - c) * abs(d - a) / whole
    return float(ellipkm1(far) / ellipkm1(near))
