"""The models of the usual paper with their counts, which the stand-ins match."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cembench.results.papers import usual_paper


@dataclass(frozen=True)
class Row:
    """A model of a paper: its printed name and counts."""

    model: str
    vertices: int
    faces: int

    @property
    def boundary(self) -> int:
        """Number of boundary vertices of a disk with these counts (Euler characteristic 1)."""
        return 2 * self.vertices - self.faces - 2

    def boundary_at(self, faces: int) -> int:
        """Return the number of boundary vertices at another size; it grows as the root of `faces`.

        Its parity is that required of a disk with this many triangles.
        """
        count = max(12, round(self.boundary * float(np.sqrt(faces / self.faces))))
        return count + (count - faces) % 2


def _rows() -> Mapping[str, Row]:
    paper = usual_paper()
    return {
        model.lower().replace("'s ", " ").replace(" ", "-") + "-stand-in": Row(
            model, paper.count(model, "vertices"), paper.faces(model)
        )
        for model in paper.models
    }


#: The rows under the names of their stand-ins ("ho-pouting-face-stand-in").
ROWS = _rows()
