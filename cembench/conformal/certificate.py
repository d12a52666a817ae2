"""Error bounds without a known map: how far a mesh, and a map of it, is from the conformal map.

Four boundary points make a surface a quadrilateral. Its modulus is the Dirichlet energy of the
potential that is 0 on one side and 1 on the opposite side; that of the other pair of sides is the
reciprocal. Linear elements approximate each from above, so both together enclose the modulus of the
polyhedral surface, and their product exceeds 1 by the discretisation error (Hakula, Rasila &
Vuorinen 2011). A conformal map preserves the modulus, which is known exactly in the disk.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.conformal.annulus import conjugate_pair
from cembench.conformal.harmonic import edge_lengths, harmonic_extension
from cembench.conformal.laplacian import laplacian
from cembench.conformal.planar import fitted_circle, polygon_area
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.triangle_mesh import DiskMesh, HoledMesh, TriangleMesh

Complex = NDArray[np.complex128]

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

    corners: NDArray[np.int64]
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
        place = "within" if self.encloses(z) else f"{abs(self.off(z)):.2%} off, outside"
        return f"the surface's modulus is {bounds}; the map's is {own:.5g}, {place}"

    def encloses(self, z: Complex) -> bool:
        """Whether the modulus of the corners' images z (4,) lies between the two bounds."""
        return self.lower <= self.of_map(z) <= self.upper


@dataclass(frozen=True)
class RingCertificate(Certificate):
    """The modulus of a surface with one hole, with bounds: log(1 / r) / 2 pi if that has radius r.

    `corners` are the vertices of the hole, `upper` and `conjugate` come from the angle around it
    and from the potential between the boundaries.
    """

    def of_map(self, z: Complex) -> float:
        """Return the modulus of the unit disk without the circle through z (k,)."""
        centre, radius = fitted_circle(z)
        wide = (1 + radius**2 - abs(centre) ** 2) / (2 * radius)
        return float(np.arccosh(wide) / (2 * np.pi)) if wide >= 1 else float("nan")

    def words(self, z: Complex) -> str:
        """Return what the bounds say; the circle is that of the polygon's vertices, a bit large."""
        return super().words(z).removesuffix(", outside")


def certificate_of(mesh: TriangleMesh, z: Complex, target: str) -> Certificate | None:
    """Return the bounds for a map z (n,) of this target; None if it is not one with bounds.

    Raises
    ------
    AlgorithmFailed
        The boundary has fewer than four vertices, or there are several holes.

    """
    if target == "disk" and isinstance(mesh, DiskMesh):
        return certify(mesh)
    if target == "circular holes" and isinstance(mesh, HoledMesh):
        return certify_ring(mesh, int(max(mesh.loops, key=lambda loop: polygon_area(z[loop]))[0]))
    return None


def certify_ring(mesh: HoledMesh, outer: int | None = None) -> RingCertificate:
    """Enclose the modulus of a surface with one hole by two conjugate harmonic functions.

    `outer` is a vertex of the outer boundary (default: of the widest).

    Raises
    ------
    AlgorithmFailed
        The surface has more than one hole.

    Examples
    --------
    >>> import cembench
    >>> found = certify_ring(cembench.surface("catenoid-ring", 2000))
    >>> found.lower < found.upper, abs(2 * np.pi * found.modulus - 1) < 1e-3
    (True, True)

    """
    boundary, holes = mesh.outer_and_holes(outer)
    if len(holes) != 1:
        raise AlgorithmFailed(
            f"{mesh.name} has {len(holes)} holes; bounds are known for a disk or one hole"
        )
    pair = conjugate_pair(mesh, boundary, holes[0])
    return RingCertificate(holes[0], pair.circulation / (4 * np.pi**2), pair.capacity)


def certify(mesh: DiskMesh, corners: NDArray[np.int64] | None = None) -> Certificate:
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


def _energy(L: sparse.csc_array, low: NDArray[np.int64], high: NDArray[np.int64]) -> float:
    """Return the integral of |grad u|^2 for the u that is 0 on one side and 1 on the other."""
    fixed = np.concatenate([low, high])
    u = harmonic_extension(L, fixed, np.repeat([0.0, 1.0], [len(low), len(high)]))
    return float(u @ (L @ u))


def four_points(mesh: DiskMesh) -> NDArray[np.int64]:
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
    here, there = abs(a - b) * abs(c - d) / whole, abs(b - c) * abs(d - a) / whole
    return float(ellipkm1(there) / ellipkm1(here))
