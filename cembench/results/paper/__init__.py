"""The paper's printed Tables 1 to 4 as data, with known misprints.

An empty cell, printed as a dash, is None. The source is "An Efficient Energy Minimization
for Conformal Parameterizations", Tables 1-4, twenty models each.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from types import MappingProxyType
from typing import TypeAlias

#: Columns by name.
Row: TypeAlias = "MappingProxyType[str, float | None]"


@dataclass(frozen=True)
class Citation:
    """Where a paper was published; `place` is the journal with volume, year and pages."""

    title: str
    authors: str
    place: str
    doi: str

    @property
    def address(self) -> str:
        """The address that the doi resolves to."""
        return f"https://doi.org/{self.doi}"


#: The paper whose tables these are, as in docs/bibliography.md.
CITATION = Citation(
    title="An Efficient Energy Minimization for Conformal Parameterizations",
    authors="Mei-Heng Yueh, Wen-Wei Lin, Chin-Tien Wu, Shing-Tung Yau",
    place="Journal of Scientific Computing 73 (2017), 203-227",
    doi="10.1007/s10915-017-0414-y",
)
SOURCE = f"{CITATION.title}, Tables 1-4"

#: The algorithms of the tables under their names in cembench, in the order of the columns.
ALGORITHMS = ("qiem", "fdm", "ldm", "cem")

_FILES = {
    1: "table1_time_seconds.csv",
    2: "table2_speedup_rate.csv",
    3: "table3_conformal_energy.csv",
    4: "table4_angular_distortion_degrees.csv",
}

#: Printed cells that contradict the rest of the paper: (table, model, column) -> reason.
ERRATA = MappingProxyType(
    {
        (2, "Knit Cap Man", "fdm"): (
            "printed 29.07; Table 1 gives 385.70 / 13.27 - 1 = 28.07, and only with that is the "
            "mean rate 17.2"
        ),
    }
)


@lru_cache(maxsize=4)
def table(number: int) -> MappingProxyType[str, Row]:
    """Return the rows of a table by model, in the paper's order, with misprints (:data:`ERRATA`).

    Raises
    ------
    KeyError
        The number is not 1, 2, 3 or 4.

    """
    text = (files(__name__) / _FILES[number]).read_text(encoding="utf-8")
    rows = {}
    for line in csv.DictReader(text.splitlines()):
        model = line.pop("model")
        rows[model] = MappingProxyType({k: float(v) if v else None for k, v in line.items()})
    return MappingProxyType(rows)


def faces(model: str) -> int:
    """Return the number of triangles of a model of the paper."""
    count = table(1)[model]["faces"]
    assert count is not None
    return int(count)
