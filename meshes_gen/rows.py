"""The twenty rows of the paper's Table 2: what each stand-in has to match."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cembench.results import paper


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


def _rows() -> Mapping[str, Row]:
    found = {}
    for model, counts in paper.table(2).items():
        vertices, faces = counts["vertices"], counts["faces"]
        assert vertices is not None
        assert faces is not None
        name = model.lower().replace("'s ", " ").replace(" ", "-")
        found[name] = Row(model, int(vertices), int(faces))
    return found


#: The rows in the paper's order, under the names of their stand-ins ("ho-pouting-face").
ROWS = _rows()
