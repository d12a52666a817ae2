"""The twenty rows of the paper's Table 2: what each stand-in has to match."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

#: Where the counts were taken from.
SOURCE = "An Efficient Energy Minimization for Conformal Parameterizations, Tables 1 and 2"


@dataclass(frozen=True)
class Row:
    """A model of the paper: its printed name and counts."""

    model: str
    vertices: int
    faces: int

    @property
    def boundary(self) -> int:
        """Boundary vertices of a disk with these counts (Euler characteristic 1)."""
        return 2 * self.vertices - self.faces - 2

    def boundary_at(self, faces: int) -> int:
        """Boundary vertices at another size: they grow as the square root of the triangles.

        Of the parity that a disk with so many triangles has.
        """
        count = max(12, round(self.boundary * float(np.sqrt(faces / self.faces))))
        return count + (count - faces) % 2


#: The rows in the paper's order, under the names of their stand-ins.
ROWS: Mapping[str, Row] = {
    "nefertiti": Row("Nefertiti", 299, 562),
    "cowboy-hat": Row("Cowboy Hat", 2327, 4604),
    "chinese-vase": Row("Chinese Vase", 2809, 5592),
    "bourbon-bottle": Row("Bourbon Bottle", 6569, 13088),
    "foot": Row("Foot", 10010, 19966),
    "chinese-lion": Row("Chinese Lion", 17334, 34421),
    "david-head": Row("David Head", 23889, 47280),
    "stanford-bunny": Row("Stanford Bunny", 32717, 65221),
    "human-brain": Row("Human Brain", 48463, 96811),
    "ho-pouting-face": Row("Ho's Pouting Face", 49596, 98316),
    "ho-neutral-face": Row("Ho's Neutral Face", 50779, 100675),
    "left-hand": Row("Left Hand", 53054, 105860),
    "statue-of-liberty": Row("Statue of Liberty", 95283, 190162),
    "liu-neutral-face": Row("Liu's Neutral Face", 97264, 193298),
    "liu-smile-face": Row("Liu's Smile Face", 103230, 205207),
    "liu-pouting-face": Row("Liu's Pouting Face", 104497, 207721),
    "liu-wry-face": Row("Liu's Wry Face", 104786, 208283),
    "isis-statue": Row("Isis Statue", 187277, 374309),
    "bimba-statue": Row("Bimba Statue", 418951, 836740),
    "knit-cap-man": Row("Knit Cap Man", 644029, 1287579),
}
