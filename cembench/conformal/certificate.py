"""How far is a mesh, and a map of it, from the conformal map, where none is known?

Four boundary points make a surface a quadrilateral. Its modulus is Dirichlet's energy of the
potential that is 0 on one side and 1 on the opposite one; that of the other pair of sides is its
reciprocal. Linear elements find each from above, so both together enclose the modulus of the
surface that the mesh is, and their product exceeds 1 by the error of the discretisation (Hakula,
Rasila & Vuorinen 2011). A conformal map keeps the modulus, which in the disk is known exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cembench.conformal.harmonic import edge_lengths, harmonic_extension
from cembench.conformal.laplacian import laplacian
from cembench.core.errors import AlgorithmFailed
from cembench.mesh.triangle_mesh import DiskMesh

Complex = NDArray[np.complex128]

#: Where on the boundary the four points lie. Quarters would lie where a surface is symmetric, as
#: every map is then: they could not tell one from another.
SHARES = (0.0, 0.15, 0.45, 0.7)


@dataclass(frozen=True)
class Certificate:
    """The modulus of a surface with four boundary points, and how sure it is.

    Parameters
    ----------
    corners : int64 (4,)
        The points, as vertices, counter-clockwise.
    upper : float
        Energy of the potential from the side between the first two corners to the opposite one:
        of a rectangle, the length of these sides over their distance. At least the modulus.
    conjugate : float
        The same for the other two sides: at least the modulus' reciprocal.

    """

    corners: NDArray[np.int64]
    upper: float
    conjugate: float

    @property
    def lower(self) -> float:
        """What the modulus is at least."""
        return 1 / self.conjugate

    @property
    def modulus(self) -> float:
        """The middle of the two bounds, in proportion."""
        return float(np.sqrt(self.upper / self.conjugate))

    @property
    def reciprocal_error(self) -> float:
        """By how much does the product of the two energies exceed 1? The discretisation's error."""
        return self.upper * self.conjugate - 1

    def off(self, z: Complex) -> float:
        """By how much is the modulus of a map to the disk off, relatively and with sign?

        z (4,) are the corners' images, on the unit circle; NaN where they are not in order.
        """
        return disk_modulus(z) / self.modulus - 1

    def encloses(self, z: Complex) -> bool:
        """Whether the modulus of the corners' images z (4,) lies between the two bounds."""
        return self.lower <= disk_modulus(z) <= self.upper


def certify(mesh: DiskMesh, corners: NDArray[np.int64] | None = None) -> Certificate:
    """Enclose the modulus of a surface with four boundary points: two harmonic functions.

    `corners` (4,) are vertices of the boundary, in its order; the default are those that
    :func:`four_points` finds.

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
            f"{chosen.tolist()} are not four vertices of the boundary in its order, which a "
            "quadrilateral needs"
        )
    sides = [
        np.roll(mesh.boundary, -place)[: step + 1]
        for place, step in zip(places, steps.tolist(), strict=True)
    ]
    L = laplacian(mesh)
    return Certificate(chosen, _energy(L, sides[0], sides[2]), _energy(L, sides[1], sides[3]))


def _energy(L: sparse.csc_array, low: NDArray[np.int64], high: NDArray[np.int64]) -> float:
    """The integral of |grad u|^2 of the u that is 0 on one side, 1 on the other."""
    fixed = np.concatenate([low, high])
    u = harmonic_extension(L, fixed, np.repeat([0.0, 1.0], [len(low), len(high)]))
    return float(u @ (L @ u))


def four_points(mesh: DiskMesh) -> NDArray[np.int64]:
    """Which four boundary vertices lie at :data:`SHARES` of its length, the first farthest out?

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
    for k in range(1, 4):  # apart also where an edge is long
        places[k] = min(max(places[k], places[k - 1] + 1), len(boundary) - 4 + k)
    return boundary[places]


def disk_modulus(z: Complex) -> float:
    """What is the modulus of the unit disk with four points (4,) of the circle?

    That of :class:`Certificate`, by their cross ratio and complete elliptic integrals; NaN where
    the points do not go round the circle once and counter-clockwise.
    """
    from scipy.special import ellipkm1  # here: few who measure need it

    arcs = np.angle(np.roll(z, -1) * np.conj(z)) % (2 * np.pi)
    if not (arcs > 0).all() or not np.isclose(arcs.sum(), 2 * np.pi):
        return float("nan")
    a, b, c, d = z.tolist()
    whole = abs(a - c) * abs(b - d)  # Ptolemy: the sum of the products of opposite sides
    here, there = abs(a - b) * abs(c - d) / whole, abs(b - c) * abs(d - a) / whole
    return float(ellipkm1(there) / ellipkm1(here))
