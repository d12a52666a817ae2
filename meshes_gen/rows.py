"""The models of the usual paper with what the stand-ins match: their counts and difficulty.

`rows.toml` has the levers of each stand-in, fitted to figures that the paper prints for its model
by ``python -m benchmarks calibration``, and the figures that they reached.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cembench.results.papers import usual_paper

from .levers import NO_LEVERS, Levers

#: Kept levers, by stand-in.
FILE = Path(__file__).with_name("rows.toml")


@dataclass(frozen=True)
class Row:
    """A model of a paper: its printed name and counts, and how its stand-in is made as hard.

    `levers` were fitted to the printed energy and angle errors of the algorithm `fitted`; `reached`
    are those of the stand-in, by the metrics' names.
    """

    model: str
    vertices: int
    faces: int
    levers: Levers = NO_LEVERS
    fitted: str = ""
    reached: Mapping[str, float] = field(default_factory=dict)

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
    with FILE.open("rb") as file:
        kept = tomllib.load(file)
    rows = {}
    for model in paper.models:
        name = model.lower().replace("'s ", " ").replace(" ", "-") + "-stand-in"
        fit = kept.get(name, {})
        rows[name] = Row(
            model,
            paper.count(model, "vertices"),
            paper.faces(model),
            Levers(**fit.get("levers", {})),
            fit.get("fitted", ""),
            fit.get("reached", {}),
        )
    return rows


#: The rows under the names of their stand-ins ("ho-pouting-face-stand-in").
ROWS = _rows()
