"""A disk with defects, each in a place of its own, so that any of them can come together."""

from functools import cache
from itertools import combinations

import numpy as np
from cembench.surfaces.hemi_ellipsoid import hemi_ellipsoid

from cembench.mesh.defects import Defect


@cache
def _whole():
    return hemi_ellipsoid(400)


class Draft:
    """Vertices and polygons under work."""

    def __init__(self):
        mesh = _whole()
        self.points = mesh.V.tolist()
        self.faces = mesh.F.tolist()
        self.boundary = mesh.boundary.tolist()
        middle = mesh.V[mesh.F].mean(axis=1)
        #: Triangles inside, far from each other.
        self.places = []
        rim = np.isin(mesh.F, mesh.boundary).any(axis=1)
        near = rim.copy()
        for t in np.argsort(-middle[:, 2] + 0.01 * np.arange(mesh.m) / mesh.m):
            if not near[t]:
                self.places.append(int(t))
                near |= np.linalg.norm(middle - middle[t], axis=1) < 0.3

    def add(self, *point):
        self.points.append([float(x) for x in point])
        return len(self.points) - 1

    def corners(self, place):
        return self.faces[self.places[place]]

    def at(self, vertex):
        return np.array(self.points[vertex])


def open_seam(d):
    """Every face on one side gets vertices of its own along the seam."""
    left = [np.mean([d.points[v] for v in face], axis=0)[0] < -0.6 for face in d.faces]
    right = {v for face, here in zip(d.faces, left, strict=True) if not here for v in face}
    seam = right & {v for face, here in zip(d.faces, left, strict=True) if here for v in face}
    copies = {v: d.add(*d.points[v]) for v in sorted(seam)}
    for k in np.flatnonzero(left):
        d.faces[k] = [copies.get(v, v) for v in d.faces[k]]


def flat_triangle(d):
    """One of two neighbours is cut in two at the middle of their edge, a flat triangle between."""
    a, b, c = d.corners(0)
    m = d.add(*(d.at(a) + d.at(b)) / 2)
    d.faces[d.places[0]] = [a, m, c]
    d.faces += [[m, b, c], [a, b, m]]


def repeated_corner(d):
    a, b, _ = d.corners(1)
    d.faces.append([a, b, b])


def duplicate(d):
    a, b, c = d.corners(2)
    d.faces += [[b, c, a], [c, b, a]]


def turned(d):
    d.faces[d.places[3]] = d.corners(3)[::-1]


def touching(d):
    """A small pyramid stands on its tip."""
    tip = d.corners(4)[0]
    ring = [
        d.add(*(d.at(tip) + np.array([0.1 * x, 0.1 * y, 0.3]))) for x, y in ((0, 0), (1, 0), (0, 1))
    ]
    d.faces += [[tip, ring[0], ring[1]], [tip, ring[1], ring[2]]]


def fin(d):
    a, b, _ = d.corners(5)
    tip = d.add(*((d.at(a) + d.at(b)) / 2 + np.array([0, 0, 0.3])))
    d.faces.append([a, b, tip])


def ear(d):
    a, b = d.boundary[:2]
    tip = d.add(*(1.2 * (d.at(a) + d.at(b)) / 2))
    d.faces.append([b, a, tip])


def crumb(d):
    corners = [d.add(x, y, 5) for x, y in ((0, 0), (1, 0), (0, 1))]
    d.faces.append(corners)


def isolated(d):
    d.add(7, 7, 7)


def polygon(d):
    """Two triangles become a pentagon with a straight corner, where a fan is flat."""
    a, b, c = d.corners(6)
    m = d.add(*(d.at(b) + d.at(c)) / 2)
    other = next(k for k, face in enumerate(d.faces) if {b, c} <= set(face) and a not in face)
    (far,) = set(d.faces[other]) - {b, c}
    d.faces[d.places[6]] = [b, m, c, a]
    d.faces[other] = [b, far, c, m]


def not_a_number(d):
    bad = d.add(float("nan"), 0, 0)
    a, b, _ = d.corners(7)
    d.faces.append([b, a, bad])


#: Each defect, and the kinds that the checks name it by; none where the surface is accepted.
DEFECTS = {
    open_seam: {Defect.coincident, Defect.components},
    flat_triangle: {Defect.degenerate},
    repeated_corner: {Defect.degenerate},
    duplicate: {Defect.duplicate, Defect.edges},
    turned: set(),
    touching: {Defect.vertices},
    fin: {Defect.edges},
    ear: set(),
    crumb: {Defect.components},
    isolated: set(),
    polygon: set(),
    not_a_number: {Defect.not_finite},
}

ALONE_AND_IN_PAIRS = [(one,) for one in DEFECTS] + list(combinations(DEFECTS, 2))


def broken(*defects):
    draft = Draft()
    for defect in defects:
        defect(draft)
    return draft
